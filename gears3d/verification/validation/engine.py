"""The engine by itself: its solids, helical gears, Bullet's own contact, and the order of its step."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, tan

import numpy as np

from gears3d.comparison import compare
from gears3d.engine import Bench
from gears3d.engine import simulate as run_engine
from gears3d.engine.mesh import meshed
from gears3d.gears import Pair, contact_lines, nearest_gap, piece_budget, solid
from gears3d.gears.surface import facing
from gears3d.recording import Recording
from gears3d.scenario import Scenario
from gears3d.simulation import simulate
from gears3d.verification.validation.check import Check, fig5

CHORD = 0.2e-6  # Largest error of the solids [m]


def chord_error(pair: Pair, which: str) -> float:
    """Return how far the solid's chords lie off the involute at most [m], from the solid's vertices alone.

    A string unwound from the base circle to a point at radius r has the length t = sqrt(r² - rb²) and leaves the circle
    at the polar angle of the point plus t/rb - atan(t/rb), the same angle for every point of one involute. At the
    middle of a chord it differs by the chord's sag over rb.
    """
    gear = pair.gear(which)
    body = solid(pair, which, chord=CHORD)
    corners = body.triangles[np.abs(body.face_normals[:, 2]) < 0.5][:, :, :2]
    edges = np.concatenate([corners[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    radius = np.linalg.norm(edges, axis=2)
    start = gear.base_radius * np.hypot(1.0, pair.start_roll(which))
    on_flank = (radius.min(axis=1) > start) & (radius.max(axis=1) <= gear.tip_radius + 1e-12)
    on_flank &= np.ptp(radius, axis=1) > 1e-9
    tips = edges[np.abs(radius - gear.tip_radius) < 1e-12]
    turn = np.exp(1j * gear.teeth * np.arctan2(tips[:, 1], tips[:, 0]))
    centre = float(np.angle(turn.mean()) / gear.teeth)
    ends = _foot(edges[on_flank], gear.base_radius, gear.teeth, centre)
    middle = _foot(edges[on_flank].mean(axis=1), gear.base_radius, gear.teeth, centre)
    return float(np.abs(middle - ends.mean(axis=1)).max() * gear.base_radius)


def _foot(points: np.ndarray, base: float, teeth: int, centre: float) -> np.ndarray:
    """Return the angle from the tooth's centre line at which a point's involute leaves the base circle [rad]."""
    unwound = np.sqrt(np.sum(points**2, axis=-1) / base**2 - 1)
    pitch = 2 * np.pi / teeth
    angle = np.arctan2(points[..., 1], points[..., 0]) - centre
    return np.abs(angle - pitch * np.round(angle / pitch)) + unwound - np.arctan(unwound)


def refined_backlash(pair: Pair, theta: float) -> float:
    """Return the gap on the reverse flank while the active one touches, from the flank surfaces [m].

    Units: ``theta`` [rad].
    """
    flanks = pair.compiled()
    loose = theta * pair.drive.base_radius / pair.loose.base_radius
    for _ in range(3):
        found = nearest_gap(flanks, theta, loose, 0)
        loose -= found[2] / found[4]
    return float(nearest_gap(flanks, theta, loose, 1)[2])


def raw_error() -> float:
    """Return the error of Bullet's own measure of the backlash, both flanks together, over 0.4 s of figure 5 [m]."""
    budget = simulate(fig5(run__duration="0.4 s")).meta["error_budget"]
    return abs(2.0 * (budget["raw_minus_refined_mean"] + budget["hull_margins"]))


def check_solids(quick: bool = False) -> Iterator[Check]:
    """The solids: watertight, flanks on the involute, the backlash that was asked."""
    pair = fig5().pair()
    for which in ("drive", "loose"):
        body = solid(pair, which, chord=CHORD)
        yield Check(f"{which}: watertight, wound consistently, one body: faults", float(not _whole(body)), 0)
        yield Check(f"{which}: chords off the involute", chord_error(pair, which), CHORD, "m")
    angles = np.linspace(0, 2 * np.pi, 181)
    worst = max(abs(refined_backlash(pair, float(theta)) - 250e-6) for theta in angles)
    yield Check("backlash asked, refined on the flanks over a revolution: largest error", worst, 0.01e-6, "m")
    yield Check("backlash asked, raw in Bullet less its margins, both flanks: mean error", raw_error(), 0.5e-6, "m")
    yield Check("hull pieces: chord error", piece_budget(pair)["chord_error_m"], 0.2e-6, "m")


def _whole(body) -> bool:  # type: ignore[no-untyped-def]
    return bool(body.is_watertight and body.is_winding_consistent and body.body_count == 1 and body.volume > 0)


# Unequal teeth with profile shifts
UNEQUAL = {
    "gears.module": "3 mm",
    "gears.helix_angle": "25 deg",
    "gears.face_width": "14 mm",
    "gears.drive.teeth": 19,
    "gears.loose.teeth": 31,
    "gears.drive.profile_shift": 0.3,
    "gears.loose.profile_shift": -0.2,
}
TWIN = {"gears.helix_angle": "25 deg"}  # The bench of figure 5 with helical teeth


def ratio_off(scenario: Scenario) -> float:
    """Return how far the displacement of resting gears varies on either flank, over a revolution [m]."""
    pair = scenario.pair()
    times = np.linspace(0.0, 2.0 * pi / scenario.motion.mean, 400)
    off = 0.0
    with Bench(scenario) as bench:
        drive = np.array([bench.drive(time)[0] for time in times])
        for side, place in ((0, 0.0), (1, pair.backlash)):
            moved = pair.loose.base_radius * bench.rest(side, times) - pair.drive.base_radius * drive
            off = max(off, float(np.abs(moved - place).max()))
    return off


def lines_off(scenario: Scenario) -> float:
    """Return how far the engine's lines of contact end off those of the plane of action, along the face [m]."""
    pair, off = scenario.pair(), 0.0
    mesh = meshed(pair)
    for theta in np.linspace(0.0, 2.0 * pi, 97):
        for side, flank in enumerate(("active", "reverse")):
            lines = contact_lines(pair, float(theta), flank)
            loose = (pair.drive.base_radius * theta + side * pair.backlash) / pair.loose.base_radius
            for teeth, points in zip(lines.teeth, lines.points, strict=True):
                both = (int(teeth[0]), int(teeth[1]))
                found = facing(mesh.along.surfaces, (float(theta), loose), both, side, 0.0)[:2]
                off = max(off, float(np.abs(np.array(found) - np.sort(points[:, 2])).max()))
    return off


def thrust_off(made: Recording, scenario: Scenario) -> float:
    """Return how far axial over tangential impulse differs from the tangent of the helix angle, relative."""
    pair, hits = scenario.pair(), made.impacts
    mass = scenario.rig().inertia / pair.loose.base_radius**2
    tangential = mass * (hits["rebound_m_s"] - hits["velocity_m_s"]) * cos(pair.working_pressure_angle)
    return float(np.abs(np.abs(hits["axial_impulse_N_s"] / tangential) / tan(pair.drive.helix_angle) - 1.0).max())


def check_helical(quick: bool = False) -> Iterator[Check]:
    """Helical gears: lines of contact, ratio and thrust are those of geometry, impacts those of the twin."""
    unequal = fig5(motion__harmonics=[]).with_({**UNEQUAL, "run.duration": "1 s"})
    yield Check("19:31 with shifts, 25 deg: ratio off a constant, over a revolution", ratio_off(unequal), 1e-7, "m")
    yield Check("19:31 with shifts, 25 deg: ends of lines of contact off", lines_off(unequal), 1e-9, "m")
    for restitution in (0.3,) if quick else (0.3, 0.7):
        scenario = fig5(impact__restitution=restitution).with_(TWIN)
        made = simulate(scenario)
        found = compare(made, simulate(scenario, "rigid"), flight_height_min=0.05e-6).to_dict()
        case = f"90:90, 25 deg, e = {restitution}"
        yield Check(f"{case}: impacts missed or invented", found["impacts_missed"] + found["impacts_invented"], 0)
        yield Check(f"{case}: impacts compared", found["impacts_compared"], 12, at_least=True)
        yield Check(f"{case}: impact speed, median error", found["velocity_error_median"], 0.005)
        yield Check(f"{case}: impact speed, 95 % of the errors", found["velocity_error_p95"], 0.015)
        yield Check(f"{case}: axial over tangential impulse off", thrust_off(made, scenario), 0.01)


def realised(restitution: float, mean: int, harder: float = 0.01) -> np.ndarray:
    """Return the realised restitution of each native impact, (k,).

    Units: ``mean`` [rpm]; ``harder`` [m/s].

    The speed of the drive has an amplitude of 2 rpm at 30 Hz, the excitation of figure 5 with 10 % of its speed.
    """
    swing = [{"amplitude": "2 rpm", "frequency": "30 Hz"}]
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm", run__duration="0.3 s")
    impacts = simulate(scenario.with_({"motion.harmonics": swing}), contact="native").impacts
    hard = np.abs(impacts["velocity_m_s"]) > harder
    return -impacts["rebound_m_s"][hard] / impacts["velocity_m_s"][hard]


def check_native(quick: bool = False) -> Iterator[Check]:
    """Bullet's own contact with the exact-impact settings, and what it does wrong once the pair turns.

    At zero mean speed the facets of the hulls hardly move through the contact, and the realised restitution is the one
    that was asked. At full rotation they tilt the normal, and it scatters: that is why located contact is the default.
    """
    for restitution in (0.5,) if quick else (0.3, 0.5, 0.7):
        found = realised(restitution, mean=0)
        yield Check(f"e = {restitution}, mean speed zero: impacts", len(found), 8, at_least=True)
        worst = float(np.abs(found - restitution).max()) if len(found) else np.nan
        yield Check(f"e = {restitution}, mean speed zero: realised restitution, largest error", worst, 0.01)
    if not quick:
        scatter = float(np.std(realised(0.7, mean=750)))
        yield Check("e = 0.7, 750 rpm: scatter that the facets make", scatter, 0.1, at_least=True)


AMPLITUDE, ORDER, VISCOUS = 0.6, 36, 0.05  # N m, per revolution of the loose gear, N m s/rad
EFFECTS = [
    {"kind": "drag_position", "amplitude": f"{AMPLITUDE} N m", "order": ORDER},
    {"kind": "drag_viscous", "coefficient": f"{VISCOUS} N m s/rad"},
]
STEP = 5e-4  # s


def varying(duration: float) -> Scenario:
    """Return figure 5 with torques that change all the time.

    Units: ``duration`` [s].
    """
    rate = {"run.output_rate": "20 kHz", "impact.restitution": 0.5}
    return fig5().with_({"effect": EFFECTS, "run.duration": f"{duration} s", **rate})


def work_off(made: Recording, scenario: Scenario) -> float:
    """Return how far the works on the loose gear differ from its kinetic energy, in parts of the loss.

    In flight drag takes energy, at an impact the drive gives some and the flanks lose some; stretches of permanent
    contact are left out.
    """
    rig, signals, hits = scenario.rig(), made.signals, made.impacts
    time, omega, theta = signals["time_s"], signals["omega_loose_rad_s"], signals["theta_loose_rad"]
    torque = rig.drag_torque * np.sign(omega) + VISCOUS * omega + AMPLITUDE * np.cos(ORDER * theta)
    drag = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * ((torque * omega)[1:] + (torque * omega)[:-1]))])
    energy = 0.5 * rig.inertia * omega**2
    mass = rig.inertia / rig.base_radius_loose**2
    flank = rig.base_radius_drive * np.interp(hits["time_s"], time, signals["omega_drive_rad_s"])
    before, after = hits["velocity_m_s"], hits["rebound_m_s"]
    given, lost = hits["impulse_N_s"] * flank, 0.5 * mass * (before**2 - after**2)
    resting = np.array(made.meta["contacts"]).reshape(-1, 3)
    free = [0.0, *resting[:, 1:].ravel(), time[-1]]
    off, taken = 0.0, 0.0
    for start, end in zip(free[::2], free[1::2], strict=True):
        first, last = np.searchsorted(time, (start, end)) + np.array([1, -1])
        if last <= first:
            continue
        some = (hits["time_s"] > time[first]) & (hits["time_s"] <= time[last])
        spent = float(lost[some].sum()) + drag[last] - drag[first]
        off += abs(float(given[some].sum()) - spent - (energy[last] - energy[first]))
        taken += abs(spent)
    return float(off / taken)


def check_convergence(quick: bool = False) -> Iterator[Check]:
    """The step of the engine: the order of its error, the error that half the step tells, and the books of work.

    Under constant torques flights are parabolas and nothing depends on the step. Here the torque varies with the loose
    gear's angle and grows with its speed. A flight shorter than the step is a single one, at any step: the order shows
    where flights are longer, so it is the median over the impacts.
    """
    scenario = varying(0.4)
    exact = _speeds(run_engine(scenario, step=STEP / 8))
    coarse, fine = run_engine(scenario, step=STEP, error_estimate=True), run_engine(scenario, step=STEP / 2)
    errors = [np.abs(_speeds(run) - exact) for run in (coarse, fine)]
    name = "torque over angle and speed: order of the error of impact speeds"
    yield Check(name, float(np.median(np.log2(errors[0] / errors[1]))), 3.7, at_least=True)
    told = coarse.meta["error_estimate"]["impact_velocity_m_s"]
    yield Check(
        "step of 0.5 ms: that error, estimated with half the step, off the true one",
        abs(told / errors[0].max() - 1.0),
        0.1,
    )
    usual = run_engine(scenario, error_estimate=True).meta["error_estimate"]
    yield Check("the step that is chosen: error of the displacement, told", usual["displacement_m"], 1e-10, "m")
    yield Check("the step that is chosen: error of an impact speed, told", usual["impact_velocity_m_s"], 1e-7, "m/s")
    long = varying(2.0)
    yield Check("work of drive, drag and impacts off the kinetic energy", work_off(run_engine(long), long), 0.005)


def _speeds(made: Recording) -> np.ndarray:
    return made.impacts["velocity_m_s"]

"""The engine against the twin: at full rotation, in published cases, with every effect."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gears3d.comparison import Comparison, compare
from gears3d.recording import Recording
from gears3d.scenario import Scenario, load
from gears3d.scenario.document import shipped
from gears3d.signals import window
from gears3d.simulation import simulate
from gears3d.simulation.excitation import assess
from gears3d.verification.validation.check import Check, fig5

RESTITUTIONS = (0.0, 0.3, 0.5, 0.7)  # From plastic to the largest of the papers
MEAN_SPEEDS = (30, 90, 750)  # rpm


def _tooth(gear: str, flank: str, tooth: int, offset: str) -> dict[str, Any]:
    return {"effect": [{"kind": "pitch_error", "gear": gear, "flank": flank, "tooth": tooth, "offset": offset}]}


# Overrides of figure 5 by the shape that they give the flanks; each is felt by impacts
SHAPES: dict[str, dict[str, Any]] = {
    "tooth 14 of the drive +20 um, active flank": _tooth("drive", "active", 14, "20 um"),
    "tooth 8 of the drive +20 um, reverse flank": _tooth("drive", "reverse", 8, "-20 um"),
    "tooth 14 of the loose gear +20 um, active flank": _tooth("loose", "active", 14, "20 um"),
    "tooth 9 of the loose gear +20 um, reverse flank": _tooth("loose", "reverse", 9, "-20 um"),
    "tip relief of 20 um over 7 mm": {"gears.tip_relief": {"amount": "20 um", "length": "7 mm"}},
    "profile slope of the drive 10 um": {"gears.drive.profile_slope": {"amount": "10 um"}},
    "profile slope of the loose gear 10 um": {"gears.loose.profile_slope": {"amount": "10 um"}},
    "drive 40 um eccentric": {"gears.drive.eccentricity": {"offset": "40 um", "phase": "0.6 rad"}},
    "loose gear 40 um eccentric": {"gears.loose.eccentricity": {"offset": "40 um", "phase": "0.6 rad"}},
}


@cache
def on_fig5(restitution: float, mean: int) -> Comparison:
    """Run engine and twin on one case and compare them.

    Units: ``mean`` [rpm].
    """
    scenario = fig5(impact__restitution=restitution, motion__mean=f"{mean} rpm")
    return compare(simulate(scenario), simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def fig5_claims(comparison: Comparison, case: str) -> Iterator[Check]:
    """Give the checks of one case."""
    found = comparison.to_dict()
    yield Check(f"{case}: impacts missed or invented", found["impacts_missed"] + found["impacts_invented"], 0)
    yield Check(f"{case}: impacts compared", found["impacts_compared"], 12, at_least=True)
    yield Check(f"{case}: impact speed, median error", found["velocity_error_median"], 0.002)
    yield Check(f"{case}: impact speed, 95 % of the errors", found["velocity_error_p95"], 0.006)
    yield Check(f"{case}: impact speed, bias", abs(found["velocity_bias"]), 0.001)
    yield Check(f"{case}: phase, median error", found["phase_error_median_cycles"], 1e-4, "cycle")
    yield Check(f"{case}: regime differs", 0.0 if found["regime_equal"] else 1.0, 0)


def along_action(recording: Recording, scenario: Scenario) -> Recording:
    """Return the engine's recording with the speeds of impacts along the line of action, as the twin's are.

    The engine has them along the flanks' common normal. It leans by the slope of the loose gear's deviation, so that
    its lever is not the base radius; speeds and impulse of an impact tell the lever.

    Args:
        recording: of the engine, without friction of the flanks.
        scenario: for the loose gear's inertia and base radius.
    """
    rig, table = scenario.rig(), recording.impacts
    change = table["rebound_m_s"] - table["velocity_m_s"]
    lever = np.sqrt(rig.inertia * change / table["impulse_N_s"])
    turned = {name: table[name] * rig.base_radius_loose / lever for name in ("velocity_m_s", "rebound_m_s")}
    return replace(recording, impacts={**table, **turned})


@cache
def on_shape(name: str, restitution: float) -> Comparison:
    """Run engine and twin on figure 5 with other flanks and compare them."""
    scenario = fig5(impact__restitution=restitution).with_(SHAPES[name])
    engine = along_action(simulate(scenario), scenario)
    return compare(engine, simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def shape_claims(name: str) -> Iterator[Check]:
    """Give the checks of one shape, each the worse of restitution 0 and 0.5."""
    both = [on_shape(name, restitution).to_dict() for restitution in (0.0, 0.5)]
    worst = {key: max(abs(one[key]) for one in both) for key in both[0] if key.startswith(("velocity_", "phase_"))}
    counted = [one["impacts_missed"] + one["impacts_invented"] for one in both]
    yield Check(f"{name}: impacts missed or invented", max(counted), 0)
    yield Check(f"{name}: impact speed, median error", worst["velocity_error_median"], 0.002)
    yield Check(f"{name}: impact speed, 95 % of the errors", worst["velocity_error_p95"], 0.006)
    yield Check(f"{name}: impact speed, bias", worst["velocity_bias"], 0.001)
    yield Check(f"{name}: phase, median error", worst["phase_error_median_cycles"], 1e-4, "cycle")


def check_agreement(quick: bool = False) -> Iterator[Check]:
    """Located engine against the rigid twin, at full rotation.

    The engine finds the touching teeth with PyBullet and refines the gap on the true flanks; the twin knows base radii
    and a backlash. Cases: figure 5 of Rigaud & Perret-Liaudet 2020 at 20 rpm and 3 Hz, over restitution and mean speed;
    then with flanks that the twin rolls on the gears' surfaces beforehand and the engine touches one by one.
    """
    for mean in MEAN_SPEEDS:
        for restitution in RESTITUTIONS:
            if not quick or (mean, restitution) in ((30, 0.3), (750, 0.7)):
                yield from fig5_claims(on_fig5(restitution, mean), f"e = {restitution}, {mean} rpm")
    for name in SHAPES:
        if not quick or name.startswith("tip relief"):
            yield from shape_claims(name)


# Of Rigaud & Perret-Liaudet 2020
FIGURES = (
    *(f"fig5-{speed}rpm" for speed in ("0", "1.6", "5", "20")),
    *(f"fig6-{frequency}Hz" for frequency in ("0.7", "1", "3", "5", "10")),
    *("fig8", "fig10", "fig11", "fig12-0rpm", "fig12-1.6rpm-3Hz", "fig12-20rpm-3Hz"),
    *(f"fig12-5rpm-{frequency}Hz" for frequency in (1, 3, 5, 10)),
)
SPEEDS = (250, 500, 750, 1000)  # Mean speeds of table 1 of Kadmiri et al. 2012 [rpm]
EXCITATIONS = (1.5, 3.0, 6.0)  # Λ of that pair
# Errors of impact speeds, median and 95 %, of spur and of helical gears
BOUNDS = {False: (0.002, 0.006), True: (0.005, 0.015)}


def rigaud(figure: str) -> Scenario:
    """Return the scenario of a figure."""
    return load(shipped() / "rigaud-2020" / f"{figure}.toml")


def kadmiri(speed: int, excitation: float) -> Scenario:
    """Return the pair 19:37 at a mean speed, with the drag of table 1, with two periods of fluctuation per revolution.

    Units: ``speed`` [rpm].

    >>> round(assess(kadmiri(500, 3.0)).excitation_total, 2)
    3.0
    """
    still = load(shipped() / "kadmiri-2012" / f"table1-{speed}rpm.toml")
    unit = assess(still).harmonics[0].threshold_amplitude_rad_s
    swing = {"motion.harmonics[0].amplitude": f"{excitation * unit!r} rad/s"}
    return still.with_({**swing, "run.duration": "40 periods", "run.settle": "10 periods"})


def against_twin(scenario: Scenario) -> Comparison:
    """Run engine and twin and compare them."""
    return compare(simulate(scenario), simulate(scenario, "rigid"), flight_height_min=0.05e-6)


def claims_of(scenario: Scenario, case: str) -> Iterator[Check]:
    """Give the checks of one case that is not chaotic."""
    found = against_twin(scenario)
    median, most = BOUNDS[scenario.pair().drive.helix_angle != 0.0]
    yield Check(f"{case}: chaotic", float(found.mode != "trajectory"), 0)
    yield Check(f"{case}: impacts missed or invented", _known(found.impacts_missed) + _known(found.impacts_invented), 0)
    yield Check(f"{case}: regime differs", float(not found.regime_equal), 0)
    if found.impacts_compared:
        about = f"{case}: speed of {found.impacts_compared} impacts"
        yield Check(f"{about}, median error", _known(found.velocity_error_median), median)
        yield Check(f"{about}, 95 % of the errors", _known(found.velocity_error_p95), most)


def _known(error: float | None) -> float:
    """Return an error, or not a number where nothing was matched: no check holds by that."""
    return float("nan") if error is None else error


def check_published(quick: bool = False) -> Iterator[Check]:
    """Published cases in the engine against the twin.

    Figures 5, 6, 8 and 10 to 12 of Rigaud & Perret-Liaudet 2020 run as they are shipped, those of fig. 12 with their
    transmission error; the pair 19:37 of Kadmiri et al. 2012 at the four speeds of its table 1, swinging at Λ = 1.5, 3
    and 6. Each is held impact by impact against the twin; the chaotic case on the bench of fig. 5 by statistics.
    """
    for figure in ("fig8",) if quick else FIGURES:
        yield from claims_of(rigaud(figure), figure.replace("fig", "fig. ", 1).replace("-", ", ", 1))
    for speed in (1000,) if quick else SPEEDS:
        for excitation in (3.0,) if quick else EXCITATIONS:
            case = f"19:37 helical, {speed} rpm, excitation {excitation:g}"
            yield from claims_of(kadmiri(speed, excitation), case)
    if not quick:
        yield from chaotic_claims()


CASE = "fig. 5 at e = 0.95"
# So long that distributions distinguish speeds by less than 10 %
BRIGHT = {"impact.restitution": 0.95, "run.duration": "160 s", "run.settle": "3 s", "run.output_rate": "1 kHz"}
# Of the drive at the start of a run [deg]; chosen before any of them was run
PHASES = (11, 56, 101, 146, 191, 236, 281, 326)
SENSITIVE = 0.1  # Relative change of the speeds that distributions must be able to show
HEIGHT = 0.05e-6  # Impacts count after higher flights [m]
CONFIDENCE = 0.99
WIDTH = 0.01  # Half the interval of a ratio of means: a difference twice as large is found nine times in ten and more


def bright(phase: float) -> Scenario:
    """Return the scenario with the drive at a phase.

    Units: ``phase`` [deg].

    >>> bright(90).motion.harmonics[0].phase
    1.5707963267948966
    """
    return load(shipped() / "rigaud-2020" / "fig5-20rpm.toml", {**BRIGHT, "motion.harmonics[0].phase": f"{phase} deg"})


def summary(run: Recording) -> tuple[float, float]:
    """Return how many impacts there are in a second and their mean speed [m/s]."""
    begin, end = window(run.signals, run.meta)
    time = run.impacts["time_s"]
    kept = (time >= begin) & (time <= end) & (run.impacts["flight_height_m"] > HEIGHT)
    return kept.sum() / (end - begin), float(np.abs(run.impacts["velocity_m_s"][kept]).mean())


def ratio(one: ArrayLike, other: ArrayLike) -> tuple[float, float]:
    """Return the interval of the ratio of two means (Welch 1947, of logarithms: the runs differ by little).

    Shapes: ``one`` (n,); ``other`` (m,).

    >>> [round(float(end), 2) for end in ratio(np.array([1.0, 1.1, 0.9]), np.array([2.0, 2.2, 1.8]))]
    [0.34, 0.73]
    """
    from scipy.stats import ttest_ind

    found = ttest_ind(np.log(one), np.log(other), equal_var=False).confidence_interval(CONFIDENCE)
    return float(np.exp(found.low)), float(np.exp(found.high))


def chaotic_claims() -> Iterator[Check]:
    """Give the checks of the chaotic case, bright steel on the bench of fig. 5: engine and twin by statistics.

    Two right simulations of it part after a few impacts, so their impacts are held by distribution, with the change of
    speeds that these detect with a probability of 90 %. The rate of impacts and their mean speed drift for minutes,
    which one run cannot tell from a difference: they are held over several runs from different phases of the drive.
    """
    runs = [(simulate(bright(phase)), simulate(bright(phase), "rigid")) for phase in PHASES]
    yield from of_distributions(*runs[0])
    said = [[summary(run) for run in models] for models in zip(*runs, strict=True)]
    about = f"{CASE}, {len(PHASES)} runs"
    for name, engine, twin in zip(
        ("impact rates", "mean speeds"), *(zip(*one, strict=True) for one in said), strict=True
    ):
        low, high = ratio(list(engine), list(twin))
        yield Check(f"{about}: half the 99 % interval of the ratio of {name}", (high - low) / 2, WIDTH)
        yield Check(f"{about}: one lies off the interval of the ratio of {name}", float(not low <= 1.0 <= high), 0)


def of_distributions(engine: Recording, twin: Recording) -> Iterator[Check]:
    """Give the checks of one run and its reference by distribution."""
    found = compare(engine, twin, flight_height_min=HEIGHT)
    yield Check(f"{CASE}: impacts compared as distributions", found.impacts_compared, 1000, at_least=True)
    yield Check(f"{CASE}: not chaotic", float(found.mode != "distribution"), 0)
    yield Check(f"{CASE}: distributions that differ", sum(one.different for one in found.tests), 0)
    speeds = [one for one in found.tests if one.quantity.endswith("speed")]
    yield Check(f"{CASE}: distributions of speeds tested", len(speeds), 2, at_least=True)
    least = max((one.detectable or 1.0 for one in speeds), default=1.0)
    yield Check(f"{CASE}: change of speeds that would have been found nine times in ten", least, SENSITIVE)


AGREEMENT = 0.05  # Of the effect, relative: an effect that one model omits or has twice differs by 100 %
FIRST = 8  # How many impacts after the start are compared: four on either flank

Effect = dict[str, Any]

# Effects whose size can go to zero: kind, fixed parameters, scaled parameter at an engineer's size
SIZES: dict[str, tuple[str, Effect, str]] = {
    "transmission error, drive": ("transmission_error", {"order": 7, "phase": "40 deg"}, "amplitude=5e-6 m"),
    "transmission error, loose": ("transmission_error", {"order": 5, "gear": "loose"}, "amplitude=5e-6 m"),
    "transmission error, active flank": ("transmission_error", {"order": 3, "flank": "active"}, "amplitude=5e-6 m"),
    "eccentricity, drive": ("eccentricity", {"phase": "40 deg"}, "offset=5e-6 m"),
    "eccentricity, loose": ("eccentricity", {"phase": "-70 deg", "gear": "loose"}, "offset=5e-6 m"),
    "backlash offset": ("backlash_offset", {}, "offset=2e-5 m"),
    "backlash variation": ("backlash_variation", {"order": 4, "phase": "40 deg"}, "amplitude=1e-5 m"),
    "Coulomb drag": ("drag_coulomb", {}, "torque=0.02 N m"),
    "viscous drag": ("drag_viscous", {}, "coefficient=5e-3 N m s/rad"),
    "drag as a power of speed": ("drag_power", {"exponent": 1.5}, "coefficient=5e-3 N m"),
    "drag against a shaft": ("drag_differential", {"shaft_speed": "60 rpm"}, "coefficient=5e-3 N m s/rad"),
    "drag over position": ("drag_position", {"order": 5, "phase": "40 deg"}, "amplitude=0.02 N m"),
    "stick-slip": ("drag_stick_slip", {"angle": "50 deg", "phase": "40 deg"}, "amplitude=0.02 N m"),
    "drag that drifts": ("drag_drift", {"time_constant": "0.1 s"}, "relative_change=0.1"),
    "drag in mesh": ("mesh_drag", {}, "coefficient=5e-3 N m s/rad"),
    "restitution offset": ("restitution_offset", {}, "offset=0.05"),
    "restitution over speed": ("restitution_speed", {}, "slope=-3 s/m"),
    "restitution asymmetry": ("restitution_asymmetry", {}, "asymmetry=0.1"),
    "drive motion, order": ("drive_motion", {"order": 28, "phase": "40 deg"}, "amplitude=0.02 rad/s"),
    "drive motion, angle": ("drive_motion", {"frequency": "7 Hz"}, "amplitude=5e-4 rad"),
}

# Effects that have one sign
RESIST = ("stick-slip", "viscous drag", "drag as a power of speed", "drag against a shaft", "drag in mesh")


def effect(name: str, scale: float) -> list[Effect]:
    """Return the effect as a scenario has it."""
    kind, fixed, sized = SIZES[name]
    key, text = sized.split("=")
    number, _, unit = text.partition(" ")
    size = float(number) * scale
    return [{"kind": kind, **fixed, key: f"{size!r} {unit}" if unit else size}]


@cache
def run(model: str, name: str = "", scale: float = 1.0) -> Recording:
    """Run figure 5 with one effect, or with none."""
    scenario = fig5(run__duration="0.34 s")
    return simulate(scenario.with_({"effect": effect(name, scale)}) if name else scenario, model)


def change(model: str, name: str, scale: float) -> np.ndarray:
    """Return the change that an effect makes, as lengths and speeds over their typical size, (2·FIRST,)."""
    plain, more = run(model).impacts, run(model, name, scale).impacts
    moved = [more[key][:FIRST] - plain[key][:FIRST] for key in ("time_s", "velocity_m_s")]
    return np.concatenate([moved[0] * np.abs(plain["velocity_m_s"][:FIRST]), moved[1] * 1e-2])


def disagreement(name: str, scale: float) -> float:
    """Return how far the engine's change is from the twin's, over the size of the twin's."""
    engine, twin = change("bullet", name, scale), change("rigid", name, scale)
    return float(np.linalg.norm(engine - twin) / np.linalg.norm(twin))


def smallest(name: str) -> float:
    """Return the factor at which the effect moves the impacts by ten times the engine's error budget."""
    budget = run("bullet").meta["error_budget"]["total"]
    probe = 1e-3
    moved = np.abs(change("rigid", name, probe)[:FIRST]).max()
    return float(probe * 10 * budget / moved)


def check_effects(quick: bool = False) -> Iterator[Check]:
    """Effects: the change that each makes in the engine is the change that it makes in the twin.

    Every effect is tried at a size that an engineer meets, and as small as ten times the engine's own error budget of
    the gap: the parameter is scaled down until the impacts move by that length. What is compared is the *change* (with
    minus without) of times and speeds of the first impacts on both flanks.
    """
    for name in SIZES:
        signs = (1,) if quick or name in RESIST else (1, -1)
        for sign in signs:
            for words, scale in (("", 1.0),) if quick else (("", 1.0), (", at 10 x the budget", smallest(name))):
                sized = f"{name}{' reversed' if sign < 0 else ''}{words}"
                yield Check(f"{sized}: change off the twin's", disagreement(name, sign * scale), AGREEMENT)
    yield from carried()
    yield from compliance()
    yield from friction()


def carried() -> Iterator[Check]:
    """Give the checks of a carried body, which has no size that goes to zero: a small one is a stiff system."""
    body = {"kind": "carried_inertia", "inertia": "5e-3 kg m^2", "stiffness": "400 N m/rad"}
    body |= {"damping": "0.05 N m s/rad"}
    scenario = fig5(run__duration="0.34 s")
    for words, play in (("", "0 rad"), (" with a play of 0.2 mrad", "0.2 mrad")):
        more = scenario.with_({"effect": [{**body, "play": play}]})
        changes = []
        for model in ("bullet", "rigid"):
            plain, found = run(model).impacts, simulate(more, model).impacts
            moved = [found[key][:FIRST] - plain[key][:FIRST] for key in ("time_s", "velocity_m_s")]
            changes.append(np.concatenate([moved[0] * np.abs(plain["velocity_m_s"][:FIRST]), moved[1] * 1e-2]))
        off = np.linalg.norm(changes[0] - changes[1]) / np.linalg.norm(changes[1])
        yield Check(f"carried body{words}: change off the twin's", float(off), AGREEMENT)


def compliance() -> Iterator[Check]:
    """Give the checks of compliant teeth, which take the place of the restitution law."""
    scenario = fig5(run__duration="0.34 s")
    spring = {"kind": "tooth_compliance", "stiffness": "2.6e6 N/m", "damping": "1200 N s/m"}
    soft = scenario.with_({"effect": [spring]})
    changes = []
    for model in ("bullet", "rigid"):
        hard, more = simulate(scenario, model).impacts, simulate(soft, model).impacts
        moved = [more[key][:2] - hard[key][:2] for key in ("velocity_m_s", "rebound_m_s")]
        changes.append(np.concatenate([moved[0], moved[1]]))
    off = np.linalg.norm(changes[0] - changes[1]) / np.linalg.norm(changes[1])
    yield Check("tooth compliance, 2.6 N/µm: change off the twin's", float(off), AGREEMENT)


def friction() -> Iterator[Check]:
    """Give the checks of friction between rigid flanks, which changes impulses and nothing else."""
    scenario = fig5(run__duration="0.34 s")
    rough = scenario.with_({"effect": [{"kind": "mesh_friction", "coefficient": 0.05}]})
    plain, engine, twin = simulate(scenario), simulate(rough), simulate(rough, "rigid")
    paid = (run.impacts["impulse_N_s"][:FIRST] / plain.impacts["impulse_N_s"][:FIRST] - 1.0 for run in (engine, twin))
    ours, theirs = paid
    off = float(np.linalg.norm(ours - theirs) / np.linalg.norm(theirs))
    yield Check("friction in mesh: change of the impulses off the twin's", off, AGREEMENT)
    moved = np.abs(engine.signals["displacement_m"] - plain.signals["displacement_m"]).max()
    yield Check("friction in mesh: change of the motion of rigid flanks", float(moved), 1e-10, "m")

"""The lubricated model against independent integrations, closed forms and its own accounts of energy."""

from math import cos, inf, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gears3d.laws import film
from gears3d.lumped import layout as at
from gears3d.lumped import rigid
from gears3d.lumped.lubricated.model import pack
from gears3d.lumped.run import run as advance
from gears3d.scenario import load

CASE = "scenarios/dct-helical-lubricated/fig13.toml"
BARE = {"lubricated.friction": "none", "lubricated.ramp": "0 um", "lubricated.harmonics": 0}


def oil(viscosity="0.01 Pa s", **more):
    return {"kind": "oil_film", "viscosity": viscosity, "minimum_thickness": "1 um", **more}


def teeth(stiffness, damping):
    return {"kind": "tooth_compliance", "stiffness": f"{stiffness!r} N/m", "damping": f"{damping!r} N s/m"}


def run(m, duration, start="active", spacing=inf, tolerance=1e-7, settle=0.0, lyapunov=False):
    m = m._replace(tolerance=tolerance, settle=settle, works=True)
    return advance(m, duration, spacing, start, lyapunov=lyapunov)


def scenario(*effects, **changes):
    named = {key.replace("__", "."): value for key, value in changes.items()}
    return load(CASE, {"run.settle": "0 s", "run.duration": "0.1 s", "effect": list(effects) or [oil()], **named})


def law(s, m, torque=lambda t, angle: 0.0):
    """The equation of motion from the laws along the normal, and the teeth from the table of the model.

    ``torque`` is what effects add to the drag, over time and the loose gear's angle.
    """
    rig = s.rig()
    angles = (rig.working_pressure_angle, rig.base_helix_angle)
    length = film.contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = film.equivalent_radius(rig.base_radius_drive, rig.base_radius_loose, *angles)
    roll = [film.rolling_radius(rb, *angles) for rb in (rig.base_radius_drive, rig.base_radius_loose)]
    eta, least, tilt = s.effects[0].viscosity, s.effects[0].minimum_thickness, cos(rig.base_helix_angle)
    harmonic = s.motion.harmonics[0]
    omega, mass = 2 * pi * harmonic.frequency, rig.inertia / (rig.base_radius_loose * tilt) ** 2
    mean, amplitude = s.motion.mean, harmonic.amplitude
    coarse = m.teeth.table[:, :, -1]
    table = np.vstack([coarse, coarse[:1]])
    share = np.linspace(0.0, 1.0, len(table))

    def change(t, y):
        x, v = y  # along the normal, towards the active flank
        speed, up = mean + amplitude * sin(omega * t), amplitude * omega * cos(omega * t)
        angle = mean * t - amplitude / omega * (cos(omega * t) - 1.0)
        turned = (angle * rig.teeth_drive / (2 * pi)) % 1.0
        loose = (rig.base_radius_drive * speed - v / tilt) / rig.base_radius_loose
        half = 0.5 * rig.backlash * tilt
        force = float(film.mesh_film_force(x, v, half, roll[0] * speed + roll[1] * loose, length, eta, radius, least))
        for flank, (side, gap, rate) in enumerate(((1.0, half - x, -v), (-1.0, half + x, v))):
            deep = least - gap
            if deep > 0.0:
                stiffness = np.interp(turned, share, table[:, flank]) / tilt**2
                damping = 2.0 * s.lubricated.damping_ratio * sqrt(stiffness * mass)
                force += side * max(0.0, stiffness * deep - damping * rate)
        # x'' = −(s − φ)''·cos βb
        drag = rig.drag_torque + torque(t, ((half - x) / tilt + rig.base_radius_drive * angle) / rig.base_radius_loose)
        return [v, (rig.base_radius_drive * up + drag / (mass * rig.base_radius_loose * tilt**2)) * tilt
                - force / mass]  # fmt: skip

    return change


@pytest.mark.parametrize(("viscosity", "harmonics"), [("0.01 Pa s", 0), ("0.1 Pa s", 6)])
def test_the_motion_is_that_of_an_independent_integration_along_the_normal(viscosity, harmonics):
    s = scenario(oil(viscosity), start__state="free").with_({**BARE, "lubricated.harmonics": harmonics})
    m = pack(s)
    ours = run(m, 0.03, "free", 1e-4, tolerance=1e-9).samples
    rig = s.rig()
    tilt = cos(rig.base_helix_angle)
    theirs = solve_ivp(
        law(s, m), (0.0, 0.0301), [0.0, 0.0], "DOP853", ours[:, 0], rtol=1e-10, atol=1e-15, max_step=1e-5
    ).y
    place = (0.5 * rig.backlash * tilt - theirs[0]) / tilt
    assert np.ptp(place) > 0.8 * rig.backlash
    assert np.abs(ours[:, 5] - place).max() < 1e-4 * rig.backlash
    assert np.abs(ours[:, 6] + theirs[1] / tilt).max() < 1e-3 * np.abs(ours[:, 6]).max()


@pytest.mark.slow
def test_torques_over_angle_and_time_act():
    more = [
        {"kind": "drag_position", "amplitude": "0.05 N m", "order": 5, "phase": "0.3 rad"},
        {"kind": "drag_drift", "relative_change": 0.4, "time_constant": "10 ms"},
    ]
    s = scenario(oil("0.05 Pa s"), *more, start__state="free").with_(BARE)
    m = pack(s)
    ours = run(m, 0.03, "free", 1e-4, tolerance=1e-9).samples

    def torque(t, angle):
        return 0.05 * cos(5.0 * angle + 0.3) + 0.04 * (1.0 - np.exp(-t / 0.01))

    theirs, alone = (
        solve_ivp(one, (0.0, 0.0301), [0.0, 0.0], "DOP853", ours[:, 0], rtol=1e-10, atol=1e-15, max_step=1e-5).y
        for one in (law(s, m, torque), law(s, m))
    )
    tilt = cos(s.rig().base_helix_angle)
    place = (0.5 * s.rig().backlash * tilt - theirs[0]) / tilt
    assert np.abs(theirs[0] - alone[0]).max() > 0.1 * s.rig().backlash
    assert np.abs(ours[:, 5] - place).max() < 1e-4 * s.rig().backlash


def rebound_of(ratio):
    """What a linear spring and damper that never pull give back: they part where the force is gone, not the depth."""
    root = sqrt(1.0 - ratio**2)
    turn = np.arctan2(2.0 * ratio * root, 2.0 * ratio**2 - 1.0)
    return np.exp(-ratio * turn / root)


def test_thin_oil_on_stiff_teeth_tends_to_the_rigid_twin():
    """Ever thinner oil and stiffer teeth come to the impacts of rigid flanks with the restitution of their damping."""
    ratio, off = 0.28, []
    e = float(rebound_of(ratio))
    bare = {"effect": [], "impact.restitution": e, "start.state": "free", "run.settle": "0 s", "run.duration": "0.04 s"}
    rigid_ones = rigid.simulate(load(CASE, bare)).impacts
    for step in (1.0, 0.3, 0.1):
        stiffness = 1e8 / step**2
        effects = [
            oil(f"{1e-5 * step!r} Pa s", minimum_thickness=f"{0.1 * step!r} um", felt_height=f"{0.5 * step!r} um"),
            teeth(stiffness, 2.0 * ratio * sqrt(stiffness * 0.96797)),
        ]
        s = scenario(*effects, impact__restitution=e, start__state="free")
        hits = run(pack(s.with_(BARE)), 0.04, "free", tolerance=1e-8).impacts[:4]
        assert hits[:, 1].tolist() == rigid_ones["flank"][:4].tolist()
        off.append(np.abs(hits[:, 0] - rigid_ones["time_s"][:4]).max())
    assert off[0] > 2.0 * off[1] > 4.0 * off[2]
    assert off[2] < 4e-5
    assert hits[:, 2] == pytest.approx(rigid_ones["velocity_m_s"][:4], rel=2e-2)
    assert hits[:, 3] == pytest.approx(rigid_ones["rebound_m_s"][:4], rel=2e-2)


@pytest.mark.parametrize("friction", ["lines", "published", "none"])
def test_the_accounts_of_energy_close(friction):
    s = scenario(lubricated__friction=friction)
    m = pack(s)
    done = run(m, 0.2, "active", tolerance=1e-11)
    start = run(m, 0.0).state
    mesh, drag, rubbed, spring, damping, squeeze, wedge, drive = done.works
    rig = s.rig()

    def energy(state):
        return 0.5 * rig.inertia * state[at.SPEED] ** 2

    gained = energy(done.state) - energy(start)
    assert gained == pytest.approx(mesh - drag + rubbed, abs=1e-8 * drag)
    assert mesh == pytest.approx(drive + spring + damping + squeeze + wedge, rel=1e-9)
    assert damping < 0.0
    assert squeeze < 0.0
    if friction != "published":  # one place for all lines may give as well as take
        assert (rubbed < 0.0) == (friction == "lines")


def test_even_teeth_give_back_what_they_take():
    s = scenario(oil(), teeth(2.5e8, 0.0), start__state="free")
    done = run(pack(s.with_(BARE)), 0.1, "free", tolerance=1e-9)
    assert done.counters["touches"] > 8
    assert done.state[at.DISPLACEMENT] > 2e-6
    assert abs(done.works[3]) < 1e-9
    assert done.works[4] == 0.0


def test_smaller_tolerances_take_the_error_down_with_them():
    m = pack(scenario().with_(BARE))
    best = run(m, 0.05, "free", tolerance=1e-12).state[at.DISPLACEMENT]
    off = [abs(run(m, 0.05, "free", tolerance=tol).state[at.DISPLACEMENT] - best) for tol in (1e-5, 1e-7, 1e-9)]
    assert off[0] < 1e-7
    assert off[2] < 1e-3 * off[0]
    steps = [run(m, 0.05, "free", tolerance=tol).counters["steps"] for tol in (1e-8, 1e-11)]
    assert steps[1] / steps[0] < 1.6 * 10 ** (3 / 8)  # order 8


def test_at_rest_the_wedge_carries_the_drag():
    s = scenario(oil(), motion__harmonics=[])
    done = run(pack(s.with_(BARE)), 0.5, "active", tolerance=1e-9)
    rig = s.rig()
    tilt = cos(rig.base_helix_angle)
    angles = (rig.working_pressure_angle, rig.base_helix_angle)
    length = film.contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    radius = film.equivalent_radius(rig.base_radius_drive, rig.base_radius_loose, *angles)
    u = 2.0 * s.motion.mean * film.rolling_radius(rig.base_radius_drive, *angles)
    load_ = rig.drag_torque / (rig.base_radius_loose * tilt)
    alone = film.resting_thickness(load_, u, length, 0.01, radius)
    found = done.state[at.DISPLACEMENT] * tilt
    assert 1.0 / found - 1.0 / (rig.backlash * tilt - found) == pytest.approx(1.0 / alone, rel=1e-6)  # both films push
    assert abs(done.state[at.RATES]) < 1e-9


@pytest.mark.parametrize(("viscosity", "least"), [("1 Pa s", "10 nm"), ("10 Pa s", "0.1 um"), ("1e-6 Pa s", "10 nm")])
def test_it_survives_thick_oil_and_the_thinnest_films(viscosity, least):
    s = scenario(oil(viscosity, minimum_thickness=least))
    done = run(pack(s), 0.06, "free", tolerance=1e-6)
    assert np.isfinite(done.state[[at.DISPLACEMENT, at.SPEED]]).all()
    assert -1e-6 < done.state[at.DISPLACEMENT] < s.rig().backlash + 1e-6


def test_only_the_published_dead_zone_pulls():
    wide = {"lubricated.friction": "none", "lubricated.published_gap": "5 um"}
    s = scenario(run__output_rate="1 MHz").with_(wide)
    for dead_zone, pulls in (("continuous", False), ("published", True)):
        m = pack(s.with_({"lubricated.dead_zone": dead_zone}))
        strongest = run(m, 0.02, "free", 1e-6, tolerance=1e-7).forces.min()
        assert (strongest < -1.0) == pulls
    assert strongest < -0.5 * m.stiffness * m.teeth.layer  # Km·hmax where teeth close


def test_a_repeating_motion_forgets_a_disturbance_and_a_chaotic_one_does_not():
    calm = run(pack(scenario()), 1.0, settle=0.4, lyapunov=True)
    wild = run(pack(scenario(drag__torque="0.3 N m")), 1.0, settle=0.4, lyapunov=True)
    assert calm.lyapunov < -5.0
    assert wild.lyapunov > 10.0


def test_the_rattle_index_has_a_limit_where_damping_comes_in_gently():
    m = pack(scenario())
    found = [sqrt(run(m, 0.5, settle=0.3, tolerance=tol).jerk) for tol in (1e-6, 1e-8)]
    assert found[0] == pytest.approx(found[1], rel=0.03)

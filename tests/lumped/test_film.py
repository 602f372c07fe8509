"""Oil films in the kernel: against an independent stiff integration of the laws, and against closed forms."""

from math import cos, inf, pi, sin

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from gears3d.effects import Flank, Gear, Rig, flank_harmonic, gap_film, gap_spring
from gears3d.effects.oil_film import OilFilm
from gears3d.errors import InputError
from gears3d.laws import film
from gears3d.lumped import layout as at
from gears3d.lumped.kernel import advance, start_state
from gears3d.scenario import load
from gears3d.simulation import simulate
from tests.lumped.rig import RPM, model, run

RB1, RB2, J, B = 24.476e-3, 61.909e-3, 3.71e-3, 133.72e-6
ALPHA, BETA = 0.391006, 0.456892
MASS = J / RB2**2


def rig(drag=0.1, mean=1500 * RPM, e=0.3):
    return Rig(RB1, RB2, J, drag, B, e, mean, 17, 43, ALPHA, BETA, 16e-3, 1.372)


def pair(effect, acceleration=0.0, frequency=50.0, rows=(), **about):
    """Return the packed model of the representative pair; ``acceleration`` of the drive in rad/s²."""
    here = rig(**about)
    drive = [(acceleration / (2 * pi * frequency), frequency, 0.0)] if acceleration else []
    return model(here, drive, [*(effect.rows(here) if isinstance(effect, OilFilm) else [effect]), *rows])


def right(effect, acceleration, frequency, drag, mean, stiffness=0.0, damping=0.0):
    """The equation of motion from the laws, along the normal and with the gears' own angles."""
    length, radius = film.contact_length(16e-3, 1.372, BETA), film.equivalent_radius(RB1, RB2, ALPHA, BETA)
    r1, r2 = (film.rolling_radius(rb, ALPHA, BETA) for rb in (RB1, RB2))
    omega = 2 * pi * frequency

    def change(t, y):
        s, w2 = y
        w1 = mean + acceleration / omega * sin(omega * t)
        v = RB2 * w2 - RB1 * w1
        half = 0.5 * B * cos(BETA)
        xn, vn = half - s * cos(BETA), -v * cos(BETA)
        oil = (r1 * w1 + r2 * w2, length, effect.viscosity, radius, effect.minimum_thickness)
        force = float(film.mesh_film_force(xn, vn, half, *oil)) * cos(BETA)
        for side, gap, rate in ((1.0, s, v), (-1.0, B - s, -v)):
            deep = effect.minimum_thickness / cos(BETA) - gap
            if stiffness and deep > 0.0:
                force += side * max(0.0, stiffness * deep - damping * rate)
        return [v, (RB2 * force - drag * np.sign(w2)) / J]

    return change


def radau(law, begin, times):
    """Return the states at the times."""
    done = solve_ivp(law, (0, times[-1] + 1e-9), begin, "Radau", times, rtol=1e-9, atol=[1e-15, 1e-12], max_step=1e-5)
    return done.y


def start_speed(mean):
    return mean * RB1 / RB2


@pytest.mark.parametrize(
    ("eta", "acceleration", "frequency", "drag", "mean", "spring"),
    [
        (0.01, 0.0, 50.0, 0.1, 1500 * RPM, (2.5e8, 0.0)),
        (0.1, 300.0, 50.0, 0.1, 1500 * RPM, (0.0, 0.0)),
        pytest.param(0.1, 60.0, 10.0, 0.1, 60 * RPM, (2.5e8, 0.0), marks=pytest.mark.slow),
        (0.3, 600.0, 40.0, 0.0, 0.0, (2.5e8, 0.0)),  # the rolling turns back and forth
    ],
)
def test_the_motion_is_that_of_an_independent_stiff_integration(eta, acceleration, frequency, drag, mean, spring):
    effect = OilFilm(viscosity=eta)
    rows = [gap_spring(*spring)] if spring[0] else []
    m = pair(effect, acceleration, frequency, rows, drag=drag, mean=mean)
    ours = run(m, 0.03, 1e-4, "free").samples
    law = right(effect, acceleration, frequency, drag, mean, *spring)
    theirs = radau(law, [B / 2, start_speed(mean)], ours[:, 0])
    assert np.ptp(ours[:, 5]) > 1e-5
    assert np.abs(ours[:, 5] - theirs[0]).max() < 1e-6 * B
    assert np.abs(ours[:, 4] - theirs[1]).max() < 1e-5 * np.abs(ours[:, 6]).max() / RB2


def shot(m, speed, duration, spacing=inf, samples=0):
    """Return tables and samples after a start amid the backlash with a speed towards the active flank."""
    out, state, count = at.buffers(len(m.torques) + len(m.flanks), 99, 99, samples, spacing), start_state("free"), None
    count = np.zeros(at.COUNTERS, dtype=np.int64)
    numbers = m.flat()
    advance(numbers, state, count, out, 0.0)
    state[at.SPEED] -= speed / RB2
    state[at.RATES], state[at.RATES + 1] = -speed, speed
    state[at.SIGN] = np.sign(state[at.SPEED])
    assert advance(numbers, state, count, out, duration) == at.DONE
    return out.impacts[: count[at.N_IMPACTS]], out.contacts[: count[at.N_CONTACTS]], out.samples, count


def squeeze_only(effect, felt=20e-6, **about):
    """A film that rolls nothing: only its squeeze acts."""
    _, squeeze, _, _, minimum, _ = effect.rows(rig())[0].p
    return pair(gap_film(0.0, squeeze, 0.0, 0.0, minimum, felt), drag=0.0, mean=100.0, **about), squeeze, minimum


@pytest.mark.parametrize("speed", [2.5e-3, 20e-3, 0.3])
def test_a_pure_squeeze_has_its_closed_form(speed):
    m, squeeze, minimum = squeeze_only(OilFilm(viscosity=0.01))
    until = 0.55 * B / speed
    samples = shot(m, speed, until, until / 400, 400)[2]
    h, v = samples[:, 5], -samples[:, 6]
    expected = speed - 2 * squeeze / MASS * (h**-0.5 - (B / 2) ** -0.5)
    coming = (v > 0.0) & (h > minimum)
    assert h.min() < 5e-6
    assert coming.sum() > 200
    assert np.abs(v - expected)[coming].max() < 1e-9 * speed


@pytest.mark.parametrize("speed", [3e-3, 20e-3, 0.3])
def test_a_passage_loses_what_squeeze_and_restitution_take(speed):
    """e_eff = e·(v − Δv)/v with the same Δv for every speed, and the impulse is all the momentum changed."""
    m, squeeze, minimum = squeeze_only(OilFilm(viscosity=0.01), e=0.5)
    impacts, contacts, _, count = shot(m, speed, 2 * B / speed)
    felt = minimum + m.film[5]
    entry = speed - 2 * squeeze / MASS * (felt**-0.5 - (B / 2) ** -0.5)
    touch = speed - 2 * squeeze / MASS * (minimum**-0.5 - (B / 2) ** -0.5)
    assert len(contacts) == 0
    assert count[at.TOUCHES] == 1
    time, flank, velocity, rebound, impulse, place, height = impacts[0]
    assert (flank, place) == (0, pytest.approx(felt, rel=1e-12))
    assert velocity == pytest.approx(-entry, rel=1e-9)
    other = 2 * squeeze / MASS * ((B - felt) ** -0.5 - (B - minimum) ** -0.5)  # the reverse flank's film
    assert rebound == pytest.approx(0.5 * touch - other, rel=1e-9)
    assert impulse == pytest.approx(MASS * (0.5 * touch + entry), rel=1e-9)
    assert height == pytest.approx(B / 2 - minimum, rel=1e-9)
    assert time > (B / 2 - felt) / speed


def test_wedges_at_constant_rolling_keep_the_energy_and_squeeze_only_takes_it():
    wedge, squeeze, r1, _, minimum, felt = OilFilm(viscosity=0.1).rows(rig())[0].p
    for factor in (0.0, 1.0):
        m = pair(gap_film(wedge, factor * squeeze, r1, 0.0, minimum, felt))
        done = run(m._replace(tolerance=1e-12), 0.2, 1e-5, "free")
        s, v = done.samples[:, 5], done.samples[:, 6]
        potential = 0.1 / RB2 * s - wedge * r1 * 1500 * RPM * (np.log(s) + np.log(B - s))
        energy = 0.5 * MASS * v**2 + potential
        scale = np.ptp(potential)
        assert done.counters["touches"] == 0
        if factor:
            assert np.diff(energy).max() < 1e-11 * scale
            assert energy[0] - energy[-1] > 0.1 * scale
        else:
            assert np.ptp(energy) < 2e-9 * scale
            assert done.counters["impacts"] > 5
            assert np.abs(done.impacts[:, 3] / -done.impacts[:, 2] - 1).max() < 1e-9


@pytest.mark.parametrize("eta", [0.003, 0.01, 0.03])
def test_a_run_starts_at_rest_on_the_film_that_bears_the_drag(eta):
    m = pair(OilFilm(viscosity=eta))
    wedge, _, r1, r2, *_ = m.film
    u = 1500 * RPM * (r1 + r2 * RB1 / RB2)
    rest = brentq(lambda h: wedge * u * (1 / h - 1 / (B - h)) - 0.1 / RB2, 1e-7, B / 2, xtol=1e-22, rtol=1e-15)
    done = run(m, 0.1, 1e-4)
    assert np.abs(done.samples[:, 5] / rest - 1).max() < 1e-9
    assert done.contacts.tolist() == [[0, 0, 0.1]]
    assert done.counters["impacts"] == 0


def test_one_wedge_carries_its_load_at_the_height_of_the_law():
    """Far from the other flank: h0 = wedge·u/F."""
    here = Rig(RB1, RB2, J, 0.1, 1.0, 0.3, 1500 * RPM, 17, 43, ALPHA, BETA, 16e-3, 1.372)
    m = model(here, [], OilFilm(viscosity=0.01).rows(here))
    wedge, _, r1, r2, *_ = m.film
    alone = wedge * 1500 * RPM * (r1 + r2 * RB1 / RB2) / (0.1 / RB2)
    assert run(m, 0.01, 1e-3).samples[-1, 5] == pytest.approx(alone, rel=1e-5)


def test_a_gear_set_free_comes_to_rest_on_its_film():
    m = pair(OilFilm(viscosity=0.02))
    done = run(m, 3.0, 1e-3, "free")
    rest = run(m, 1e-3, 1e-3).samples[0, 5]
    assert done.samples[-1, 5] == pytest.approx(rest, rel=1e-9)
    assert done.impacts[-1, 3] == 0.0
    assert done.contacts[-1].tolist() == [0, done.impacts[-1, 0], 3.0]


def test_the_representative_pair_rides_on_six_micrometres():
    """Steady rolling: no rattle, 6.4 µm of oil along the normal."""
    oil = {"effect": [{"kind": "oil_film", "viscosity": "10 mPa s"}], "run.duration": "0.2 s"}
    scenario = load("scenarios/base/helical-17-43.toml", oil)
    done = simulate(scenario, "rigid")
    thickness = done.signals["displacement_m"] * cos(scenario.rig().base_helix_angle)
    assert np.abs(thickness - 6.4e-6).max() < 0.05e-6
    assert len(done.impacts["time_s"]) == 0
    assert done.meta["contacts"] == [[0, 0, 0.2]]


def test_ever_thinner_oil_tends_to_rigid_flanks():
    """The floor left alone, impacts are those of a backlash that is two floors narrower."""
    bare = model(rig(e=0.5), [(0.955, 50.0, 0.0)], [flank_harmonic(Gear.DRIVE, flank, 0, 1e-6, 0.0) for flank in Flank])
    rigid = run(bare, 0.2).impacts
    rigid = rigid[rigid[:, 6] > 1e-5]
    off = []
    for eta in (1e-5, 1e-6):
        effect = OilFilm(viscosity=eta, minimum_thickness=1e-6 * cos(BETA))
        found = run(model(rig(e=0.5), [(0.955, 50.0, 0.0)], effect.rows(rig())), 0.2).impacts
        found = found[found[:, 6] > 1e-5]
        n = min(len(found), 12)
        assert np.array_equal(found[:n, 1], rigid[:n, 1])
        off.append(np.abs(found[:n, [0, 2, 3]] / rigid[:n, [0, 2, 3]] - 1).max())
    assert off[1] < 2e-3
    assert off[0] / off[1] > 5


def test_heavy_load_presses_the_flanks_together_through_the_film():
    m = pair(OilFilm(viscosity=1e-3), drag=1.0)
    done = run(m, 0.05, 1e-3)
    assert done.samples[:, 5] == pytest.approx(m.film[4], rel=1e-12)
    assert done.contacts.tolist() == [[0, 0, 0.05]]
    soft = pair(OilFilm(viscosity=1e-3), drag=1.0, rows=[gap_spring(1e8, 1e3)])
    wedge, _, r1, r2, minimum, _ = soft.film
    u = 1500 * RPM * (r1 + r2 * RB1 / RB2)
    left = 1.0 / RB2 - wedge * u * (1 / minimum - 1 / (B - minimum))
    done = run(soft, 0.05, 1e-3)
    assert done.samples[:, 5] == pytest.approx(minimum - left / 1e8, rel=1e-4)
    assert done.contacts.tolist() == [[0, 0, 0.05]]


def test_contact_on_the_floor_is_lost_where_film_and_inertia_lift_the_gear():
    """J·ω̇2 + T = Rb2·(film at the floor): the reaction of the bare flank is gone."""
    effect = OilFilm(viscosity=1e-3, squeeze=0.0)
    m = pair(effect, 300.0, drag=0.25, e=0.0)
    wedge, _, r1, r2, minimum, _ = m.film
    done = run(m, 0.02, 1e-6)
    omega = 100 * pi

    def reaction(t):
        w1 = 1500 * RPM + 300 / omega * sin(omega * t)
        push = wedge * w1 * (r1 + r2 * RB1 / RB2) * (1 / minimum - 1 / (B - minimum))
        return J * RB1 / RB2 * 300 * cos(omega * t) + 0.25 - RB2 * push

    lost = brentq(reaction, 0.0, 0.01, xtol=1e-15)
    on_floor = done.samples[:, 5] <= minimum * (1 + 1e-12)
    assert done.samples[on_floor, 0][0] == 0.0
    first = np.argmin(on_floor)
    assert first * 1e-6 == pytest.approx(lost, abs=2.1e-6)


def test_passages_by_the_flanks_own_motion_follow_the_integration_too():
    """Flanks of either gear that wave: the squeezes of both films turn at different moments."""
    waves = [
        flank_harmonic(Gear.DRIVE, Flank.ACTIVE, 17, 5e-6, 0.3),
        flank_harmonic(Gear.LOOSE, Flank.REVERSE, 43, 4e-6, 1.0),
    ]
    effect = OilFilm(viscosity=0.1)
    m = pair(effect, 200.0, rows=waves)
    ours = run(m, 0.03, 1e-4, "free").samples
    wedge, squeeze, r1, r2, minimum, _ = m.film

    def change(t, y):
        s, w2 = y
        w1 = 1500 * RPM + 200 / (100 * pi) * sin(100 * pi * t)
        th1 = 1500 * RPM * t - 200 / (100 * pi) ** 2 * (cos(100 * pi * t) - 1)
        th2 = (s + RB1 * th1) / RB2
        v = RB2 * w2 - RB1 * w1
        a, da = 5e-6 * cos(17 * th1 + 0.3), -17 * 5e-6 * sin(17 * th1 + 0.3) * w1
        r, dr = 4e-6 * cos(43 * th2 + 1.0), -43 * 4e-6 * sin(43 * th2 + 1.0) * w2
        force = 0.0
        for side, gap, rate in ((1.0, s - a, v - da), (-1.0, B - s - r, -v - dr)):
            h = max(gap, minimum)
            force += side * (wedge * abs(r1 * w1 + r2 * w2) / h - squeeze * min(rate, 0.0) / h**1.5)
        return [v, (RB2 * force - 0.1) / J]

    begin = [ours[0, 5], ours[0, 4]]
    theirs = radau(change, begin, ours[:, 0])
    assert np.abs(ours[:, 5] - theirs[0]).max() < 1e-6 * B


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([gap_film(1e-6, 1e-6, 0.01, 0.01, 1e-6)] * 2, "2 oil films"),
        ([gap_film(1e-6, 1e-6, 0.01, 0.01, 70e-6)], "fills the backlash"),
    ],
)
def test_films_that_cannot_be_are_refused(rows, message):
    with pytest.raises(InputError, match=message):
        model(rig(), [], rows)

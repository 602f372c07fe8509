"""The operating space: its distributions, the truth of its records against the twin, and the dirt of its sensors."""

from dataclasses import replace

import numpy as np
import pytest

from gears3d.simulation import simulate
from gears3d.verification.challenge.hiding import plan
from gears3d.verification.challenge.sensing import sense
from gears3d.verification.challenge.space import DIRT, ORDERS, draw
from gears3d.verification.challenge.taking import take

RIGS = 512
DECILES = {
    "teeth of the drive": (17, 20, 23, 26, 30, 34, 40, 45, 52),
    "ratio": (0.7895, 0.9474, 1, 1.05, 1.31, 1.64, 2.034, 2.4, 2.933),
    "module": (0.0013, 0.001599, 0.0019, 0.0022, 0.0025, 0.0028, 0.0031, 0.0034, 0.0037),
    "base radius": (0.01869, 0.02549, 0.03196, 0.03953, 0.04863, 0.05969, 0.07358, 0.09405, 0.1295),
    "backlash": (5.035e-05, 6.34e-05, 7.979e-05, 0.0001005, 0.0001265, 0.0001593, 0.0002004, 0.0002524, 0.0003177),
    "deceleration": (0.5097, 0.8653, 1.471, 2.498, 4.243, 7.205, 12.23, 20.79, 35.31),
    "inertia": (2.623e-05, 0.0001108, 0.0003036, 0.0007409, 0.001767, 0.004154, 0.01033, 0.02841, 0.1194),
    "drag": (0.003348, 0.01196, 0.03234, 0.07228, 0.1542, 0.3352, 0.7422, 1.842, 6.582),
    "restitution": (0.1251, 0.2, 0.275, 0.3501, 0.425, 0.5, 0.575, 0.65, 0.7251),
    "falls per period": (0.4564, 0.6948, 1.058, 1.609, 2.449, 3.727, 5.674, 8.633, 13.14),
    "frequency": (8.3, 15.75, 25.9, 40.05, 50.13, 78.84, 108, 186.1, 300.8),
    "excitation": (1.402, 1.873, 2.507, 3.347, 4.477, 6.006, 8.043, 10.86, 14.71),
    "excitation of the last record": (1.221, 1.729, 2.369, 3.188, 4.269, 5.701, 7.824, 10.7, 15.62),
    "mean speed": (16.79, 31.13, 50.55, 76.13, 114.6, 174.7, 278.5, 496.3, 630),
    "fluctuation": (0.0008631, 0.002258, 0.004996, 0.01054, 0.0198, 0.03285, 0.05632, 0.1045, 0.2373),
    "duration": (2, 2, 2, 2, 2.001, 3.072, 4.81, 7.787, 16.27),
    "spread": (1, 1, 1, 1.043, 1.079, 1.515, 2.108, 2.941, 4.187),
    "records": (1, 2, 2, 2, 3, 3, 4, 5, 6),
    "samples per fall": (88.94, 131.1, 194.1, 287, 424.1, 626.1, 893.9, 1258, 1821),
    "counts per backlash": (13.9, 24.14, 41.94, 72.83, 126.3, 212.3, 344.3, 554.7, 922.2),
    "noise": (2.344e-05, 5.488e-05, 0.0001289, 0.0003016, 0.0007066, 0.001658, 0.003886, 0.009106, 0.02134),
    "helix": (0, 0, 0, 0, 0, 0.2164, 0.2932, 0.37, 0.4468),
}
"""Deciles of the specified space over 16 384 rigs."""
FACTS = {
    "teeth of the drive": lambda rig: rig.teeth[0],
    "ratio": lambda rig: rig.ratio,
    "module": lambda rig: rig.module,
    "base radius": lambda rig: rig.base_radius[1],
    "backlash": lambda rig: rig.backlash,
    "deceleration": lambda rig: rig.deceleration,
    "inertia": lambda rig: rig.inertia,
    "drag": lambda rig: rig.drag,
    "restitution": lambda rig: rig.restitution,
    "falls per period": lambda rig: rig.falls_per_period,
    "frequency": lambda rig: rig.conditions[0].frequency,
    "excitation": lambda rig: rig.conditions[0].excitation,
    "excitation of the last record": lambda rig: rig.conditions[-1].excitation,
    "mean speed": lambda rig: rig.conditions[0].mean,
    "fluctuation": lambda rig: rig.conditions[0].amplitude / rig.conditions[0].mean,
    "duration": lambda rig: rig.conditions[0].duration,
    "spread": lambda rig: max(one.mean for one in rig.conditions) / min(one.mean for one in rig.conditions),
    "records": lambda rig: len(rig.conditions),
    "samples per fall": lambda rig: rig.rate * rig.fall,
    "counts per backlash": lambda rig: rig.counts_per_backlash,
    "noise": lambda rig: rig.noise_share,
    "helix": lambda rig: rig.helix,
}
KOLMOGOROV = 1.63
"""Bound of the statistic times √n of a chance of 1 %; a Sobol sequence is more even than chance."""
SHARES = {"locked": 0.5, "dirty": 0.477, "same teeth": 0.171, **dict.fromkeys(DIRT, 0.2)}


@pytest.fixture(scope="module")
def rigs():
    return draw(RIGS, 1)


@pytest.mark.parametrize("name", DECILES)
def test_a_factor_is_distributed_as_specified(rigs, name):
    values = np.array([FACTS[name](rig) for rig in rigs], float)
    within = KOLMOGOROV / np.sqrt(RIGS)
    for chance, at in zip(np.arange(0.1, 0.95, 0.1), DECILES[name], strict=True):
        slack = 1e-3 * abs(at)  # the table has four digits; values that many rigs share lie on either side
        assert np.mean(values < at - slack) - within < chance < np.mean(values <= at + slack) + within


def test_shares_are_as_specified(rigs):
    found = {
        "locked": np.mean([rig.locked for rig in rigs]),
        "dirty": np.mean([bool(rig.dirt) for rig in rigs]),
        "same teeth": np.mean([rig.teeth[0] == rig.teeth[1] for rig in rigs]),
        **{kind: np.mean([kind in rig.dirt for rig in rigs]) for kind in DIRT},
    }
    for name, share in SHARES.items():
        assert abs(found[name] - share) < 2.58 * np.sqrt(share * (1.0 - share) / RIGS), name
    orders = [rig.conditions[0].order for rig in rigs if rig.locked]
    assert {order: orders.count(order) > len(orders) / 12 for order in ORDERS} == dict.fromkeys(ORDERS, True)


def test_every_rig_is_one_that_a_scenario_can_state(rigs):
    for rig in rigs[:96]:
        pair = rig.scenario(len(rig.conditions) - 1).pair()
        assert (pair.drive.base_radius, pair.loose.base_radius) == pytest.approx(rig.base_radius, rel=1e-9)
        assert pair.backlash == pytest.approx(rig.backlash, rel=1e-6)


def test_teeth_are_hidden_as_soft_as_a_scenario_can_state_them():
    """In a small rig with little drag, half of the unit size would be below the least stiffness."""
    rig = draw(1278, 1020)[1277].scenario()
    (teeth,) = plan(1, ("tooth_compliance",), rig=rig, size=0.5).effects
    assert rig.with_([("effect[+]", teeth)]).effects[-1].stiffness == 1e3


def test_a_seed_and_an_index_repeat_a_rig():
    assert draw(5, 3)[4] == draw(40, 3)[4]
    assert draw(1, 3) != draw(1, 4)


@pytest.mark.parametrize(
    ("index", "waves"), [*((each, False) for each in (1, 2, 3, 4, 6, 9, 15, 17, 27, 42)), (9, True), (42, True)]
)
def test_the_truth_is_the_twins(index, waves):
    """Rattle that rests on both flanks or one, that only strikes, and that bounces for long: none is chaotic."""
    rig = draw(64, 2)[index]
    taken = take(rig, dirt=False, waves=waves, samples=20_000)
    truth = taken.truth
    begin, fall, fast = truth.begin, rig.fall, np.sqrt(2.0 * rig.backlash * rig.deceleration)
    lasts = {"run.duration": f"{begin + truth.duration!r} s", "run.output_rate": f"{20 / fall!r} Hz"}
    effects = [
        {"kind": "transmission_error", "order": n, "amplitude": f"{size!r} m", "phase": f"{phase!r} rad"}
        for n, size, phase in truth.waves
    ]
    assert len(effects) == 3 * waves
    twin = simulate(taken.scenario.with_({**lasts, "effect": effects}), "rigid")
    hard = (twin.impacts["time_s"] >= begin) & (np.abs(twin.impacts["velocity_m_s"]) > 1e-2 * fast)
    theirs = {name: values[hard] for name, values in twin.impacts.items()}
    hard = np.abs(truth.impacts["velocity_m_s"]) > 1e-2 * fast
    ours = {name: values[hard] for name, values in truth.impacts.items()}
    assert len(ours["time_s"]) > 30
    np.testing.assert_array_equal(ours["flank"], theirs["flank"])
    np.testing.assert_allclose(ours["time_s"], theirs["time_s"] - begin, rtol=0.0, atol=1e-5 * fall)
    for name in ("velocity_m_s", "rebound_m_s"):
        np.testing.assert_allclose(ours[name], theirs[name], rtol=0.0, atol=1e-5 * fast)
    np.testing.assert_allclose(ours["flight_height_m"], theirs["flight_height_m"], rtol=2e-3, atol=1e-9)
    rests = np.array([each for each in twin.meta["contacts"] if each[2] > begin]).reshape(-1, 3)
    rests[:, 1:] = np.clip(rests[:, 1:] - begin, 0.0, truth.duration)
    for flank in (0, 1):
        own, other = (np.diff(each[each[:, 0] == flank, 1:]).sum() for each in (truth.contacts, rests))
        assert own == pytest.approx(other, abs=1e-4 * truth.duration)


def test_flights_and_contacts_fill_a_record_without_overlap():
    truth = take(draw(64, 2)[38], dirt=False, samples=20_000).truth
    spans = np.vstack([truth.contacts[:, 1:], np.column_stack([truth.flights["start_s"], truth.flights["end_s"]])])
    spans = spans[np.argsort(spans[:, 0])]
    assert np.diff(spans).min() >= 0.0
    assert np.abs(spans[1:, 0] - spans[:-1, 1]).max() < 1e-9
    assert truth.regime() == "double_sided"
    assert truth.regime(2.0 * truth.backlash) == "contact"


def test_a_record_is_shortened_but_keeps_thirty_periods():
    rig = draw(5, 1)[4]
    taken = take(rig, samples=1000)
    assert taken.truth.duration < rig.conditions[0].duration
    assert taken.truth.duration * rig.conditions[0].frequency == pytest.approx(30.0, abs=0.1)
    assert taken.scenario.motion.harmonics[0].amplitude == pytest.approx(rig.conditions[0].amplitude)


def sensed(kinds, rate=20e3, n=40_000, turning=12.3, counts=4_000_000, noise=1e-9):
    """What encoders write of an even rotation, with some dirt; the columns, their sizes and the true angle."""
    rig = replace(draw(1, 1)[0], dirt=kinds, rate=rate, counts=counts, noise=noise)
    time = np.arange(n) / rate
    angle = turning * time + 1e-3 * np.sin(40.0 * time)
    columns, sizes = sense(rig, time, (angle, angle), np.random.default_rng(5), True)
    return rig, columns, sizes, angle


def error_of(column, angle):
    error = column - angle
    return error - error.mean()


def test_clean_readings_are_counts_of_noisy_angles():
    _, columns, sizes, angle = sensed((), counts=5000, noise=3e-4)
    edge = 2 * np.pi / 5000
    steps = columns["theta_loose_rad"] / edge
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    spread = error_of(columns["theta_loose_rad"], angle).std()
    assert spread == pytest.approx(np.hypot(3e-4, edge / np.sqrt(12)), rel=0.03)
    assert sizes == {}


def test_coloured_noise_has_its_rms_and_falls_with_the_frequency():
    rig, columns, sizes, angle = sensed(("one_over_f",))
    errors = [error_of(columns[f"theta_{gear}_rad"], angle) for gear in ("drive", "loose")]
    errors = [error * radius for error, radius in zip(errors, rig.base_radius, strict=True)]
    assert 1e-3 < sizes["one_over_f"] < 2e-2
    assert np.hypot(*(error.std() for error in errors)) == pytest.approx(sizes["one_over_f"] * rig.backlash, rel=0.02)
    power = np.abs(np.fft.rfft(errors[1])) ** 2
    low, high = power[10:100].mean(), power[1000:1900].mean()
    assert low / high == pytest.approx(1450 / 39.1, rel=0.6)  # means of 1/f over the two bands


def test_interpolation_errs_once_and_twice_a_line():
    _, columns, sizes, angle = sensed(("interpolation",))
    error = error_of(columns["theta_loose_rad"], angle)
    line = 2 * np.pi / sizes["lines"]
    parts = [2.0 * abs(np.mean(error * np.exp(-2j * np.pi * n * angle / line))) / line for n in (1, 2, 3)]
    assert parts[0] == pytest.approx(sizes["interpolation"], rel=0.05)
    assert parts[1] == pytest.approx(0.5 * sizes["interpolation"], rel=0.05)
    assert parts[2] < 0.05 * sizes["interpolation"]


def test_jitter_and_clock_act_on_time():
    _, columns, sizes, angle = sensed(("jitter",))
    error = error_of(columns["theta_drive_rad"], angle)
    assert (error / 12.3 * 20e3).std() == pytest.approx(sizes["jitter"], rel=0.1)
    np.testing.assert_allclose(error_of(columns["theta_loose_rad"], angle), error, atol=4e-6)  # one clock latches both
    _, columns, sizes, _ = sensed(("clock",))
    assert abs(sizes["clock"]) == 30e-6
    assert columns["time_s"][-1] == pytest.approx(39_999 / 20e3 * (1 + sizes["clock"]), rel=1e-12)


def test_held_readings_are_those_of_before():
    _, columns, sizes, _ = sensed(("held",))
    same = np.flatnonzero(np.diff(columns["theta_loose_rad"]) == 0.0) + 1
    np.testing.assert_array_equal(same, np.arange(int(sizes["held"]), 40_000, int(sizes["held"])))


def test_the_harmonics_of_a_drive_are_in_the_record_and_not_in_the_rig():
    rig = next(one for one in draw(64, 1) if "drive_harmonics" in one.dirt and one.locked)
    taken = take(replace(rig, noise=0.0, counts=4_000_000, dirt=("drive_harmonics",)), samples=20_000)
    now, time = rig.conditions[0], taken.record.time
    assert len(taken.scenario.motion.harmonics) == 1
    whole = int(len(time) // (rig.rate / now.frequency)) / now.frequency
    some = time < whole
    angle = taken.record.signals["theta_drive_rad"][some] - now.mean * time[some]
    turn = 2 * np.pi * now.frequency * time[some]
    basis = np.column_stack([np.ones_like(turn), *(f(n * turn) for n in (1, 2, 3) for f in (np.sin, np.cos))])
    fit = np.linalg.lstsq(basis, angle, rcond=None)[0][1:].reshape(3, 2)
    speeds = np.hypot(*fit.T) * 2 * np.pi * now.frequency * np.array([1, 2, 3])
    np.testing.assert_allclose(speeds / now.amplitude, [1.0, 0.05, 0.05], rtol=0.05)
    moved = taken.truth.drive_speed(time)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (moved[1:] + moved[:-1]) * np.diff(time))])
    read = taken.record.signals["theta_drive_rad"]
    assert np.abs(read - read[0] - turned).max() < 1e-3 * now.amplitude / now.frequency + 4e-6

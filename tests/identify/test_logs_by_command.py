"""Raw logs of coast-downs through the command: which part is used, what is repaired and said, inertia from spin-ups."""

import json
import tomllib

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy.integrate import solve_ivp

from gears3d import cli
from gears3d.identify import identify_coastdown, make_tracks
from gears3d.identify.motion import Law, spinning_up
from tests.identify import dirty_scores

INERTIA = 0.02
DRY, SLOPE = 0.04, 0.0004
"""Drag torque [N·m] and its slope [N·m·s/rad]."""
RIG = "scenarios/rigaud-2020/fig5-20rpm.toml"
KNOWN = ("--inertia", "0.02 kg m^2")


def speed(since, start=100.0):
    """Return the speed of the coast-down in closed form [rad/s]."""
    far = DRY / SLOPE
    return np.maximum((start + far) * np.exp(-SLOPE / INERTIA * since) - far, 0.0)


def angle(since, start=100.0):
    """Return the angle of the coast-down in closed form, until it rests [rad]."""
    far, rate = DRY / SLOPE, SLOPE / INERTIA
    since = np.minimum(since, np.log(start / far + 1.0) / rate)
    return (start + far) * -np.expm1(-rate * since) / rate - far * since


def said(capsys, *words):
    """Return exit code, output and error output of a command."""
    with pytest.raises(SystemExit) as stop:
        cli.main([str(word) for word in words])
    shown = capsys.readouterr()
    return stop.value.code or 0, shown.out, " ".join(shown.err.split())


def answered(capsys, *words):
    """Return the JSON of ``identify coastdown`` and what it says on the terminal."""
    code, out, err = said(capsys, "identify", "coastdown", *words, "--json")
    assert code == 0, err
    return json.loads(out), err


def write(folder, columns, more="", torn=()):
    """Write a log and its map; return the path of the map."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in rows)]
    for at in torn:
        lines[at] = lines[at][: len(lines[at]) // 3]
    (folder / "log.csv").write_text("\n".join(lines) + "\n")
    (folder / "record.toml").write_text(f'format = 1\nfile = "log.csv"\n{more}')
    return folder / "record.toml"


SPEEDS = '[time]\nchannel = "t"\nunit = "s"\n{more}[loose]\nchannel = "n"\nunit = "rad/s"\n'


def speeds(folder, time, values, more="", torn=()):
    """Write a log of speeds with its map."""
    return write(folder, {"t": time, "n": values}, SPEEDS.format(more=more), torn)


def covers(answer, truth=((DRY, "coulomb"), (SLOPE, "viscous"))):
    """Check that the right law was found, and its true numbers within twice their 95 % intervals, which are narrow.

    One draw in twenty lies outside a right interval, one in ten thousand outside twice that.
    """
    assert answer["law"] == "coulomb+viscous"
    for value, name in truth:
        low, high = answer["parameters"][name]["ci95"]
        assert abs(value - 0.5 * (low + high)) <= high - low < 0.05 * value, name


def kinds(answer):
    """Return the sizes of the findings by kind."""
    return {one["kind"]: one["size"] for one in answer["goodness"]["findings"]}


def test_several_coast_downs_of_one_file_are_used_and_their_times_said(tmp_path, capsys):
    time = np.arange(0.0, 80.0, 0.02)
    values = np.where(time < 5.0, 100.0, np.where(time < 45.0, speed(time - 5.0), 0.0))
    values = np.where((time > 45.0) & (time <= 48.0), 30.0 * (time - 45.0), values)
    values = np.where(time > 48.0, speed(time - 48.0, 90.0), values)
    noisy = values + 0.05 * np.random.default_rng(1).normal(size=len(time)) * (values > 0.0)
    answer, err = answered(capsys, speeds(tmp_path, time, noisy), *KNOWN)
    covers(answer)
    first, second = answer["goodness"]["coastdowns"]
    assert 5.0 <= first["from_s"] < 6.0
    assert 48.0 <= second["from_s"] < 49.0
    assert first["measured"] == second["measured"] == "speed"
    assert "2 free coast-downs found" in err
    assert set(answer["goodness"]["held_out"]) >= {"coulomb", "viscous", "coulomb+viscous"}


@pytest.mark.parametrize("way", ["map", "options"])
def test_the_part_that_is_used_is_given_by_map_or_options(tmp_path, capsys, way):
    time = np.arange(0.0, 30.0, 0.02)
    noisy = speed(time) + 0.05 * np.random.default_rng(2).normal(size=len(time))
    noisy[time < 4.0] += 20.0 * np.sin(3.0 * time[time < 4.0])  # no coast-down there
    limits = 'from = "5 s"\nto = "25000 ms"\n' if way == "map" else ""
    words = ("--from", "5 s", "--to", "25000 ms") if way == "options" else ()
    answer, err = answered(capsys, speeds(tmp_path, time, noisy, limits), *KNOWN, *words)
    covers(answer)
    (used,) = answer["goodness"]["coastdowns"]
    assert (used["from_s"], used["to_s"]) == pytest.approx((5.0, 25.0), abs=0.05)
    if way == "map":
        assert "part-used: time_s: 5 to 25 s of 0 to 29.98 s are used, 1001 of 1500 rows" in err


VERBS = {
    "measure": ("measure",),
    "diagnose": ("diagnose",),
    **{kind: ("identify", kind) for kind in ("restitution", "threshold", "backlash", "transmission-error")},
}


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_that_reads_records_takes_times(tmp_path, capsys, verb):
    time = np.linspace(0.0, 1.0, 2001)
    columns = {"time_s": time, "theta_drive_rad": 9.0 * time, "theta_loose_rad": 9.0 * time}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet")
    words = (*VERBS[verb], tmp_path / "log.parquet", "--rig", RIG)
    code, _, err = said(capsys, *words, "--from", "2 s")
    assert code == 3
    assert "--from, --to: has 0 rows from 2 s to the end, the record covers 0 to 1 s" in err
    code, _, err = said(capsys, *words, "--from", "0.5 s", "--to", "0.2 s")
    assert code == 3
    assert "give an earlier and a later time" in err


def test_a_map_whose_times_lie_outside_names_them(tmp_path, capsys):
    time = np.arange(0.0, 30.0, 0.02)
    code, _, err = said(capsys, "identify", "coastdown", speeds(tmp_path, time, speed(time), 'from = "90 s"\n'), *KNOWN)
    assert code == 3
    assert "time.from: is '90 s': no row lies there" in err


def test_held_readings_dropouts_and_torn_rows_are_reported(tmp_path, capsys):
    time = np.arange(0.0, 30.0, 0.01)
    held = speed(time[::5]) + 0.05 * np.random.default_rng(3).normal(size=600)
    values = np.repeat(held, 5)
    values[1000:1004] = 0.0
    answer, err = answered(capsys, speeds(tmp_path, time, values, torn=(2100, 3000)), *KNOWN)
    covers(answer)
    found = kinds(answer)
    assert found["held"] == pytest.approx(5.0, abs=0.1)
    assert found["dropouts"] == 4
    assert found["torn-rows"] == 2
    assert answer["goodness"]["coastdowns"][0]["points"] < 605  # one reading of each update
    assert "each reading is held for 5 rows" in err
    assert "4 readings of 0 amid motion: excluded" in err


PULSES = '[loose]\nchannel = "pulse"\nunit = "ms"\ncounts_per_revolution = 6\n[loose.decode]\nkind = "stamps"\n'


def pulses(uneven=0.0):
    """Return the times of pulses in ms, six magnets a revolution, down to a tenth of the speed."""
    fine = np.linspace(0.0, 29.0, 300_001)
    place = np.arange(0.1, angle(29.0), 2 * np.pi / 6)
    shift = uneven * 2 * np.pi / 6 * np.random.default_rng(4).normal(size=6)
    time = np.interp(place + shift[np.arange(len(place)) % 6], angle(fine), fine)
    return 1e3 * time + 1e-3 * np.random.default_rng(5).normal(size=len(time))


@pytest.mark.parametrize("dirt", ["missing-pulses", "extra-pulses", "uneven-magnets"])
def test_pulses_in_ms_are_repaired_and_reported(tmp_path, capsys, dirt):
    """Stamps in ms taken for seconds would make the dry friction too small by a million."""
    random = np.random.default_rng(6)
    time = pulses(0.03 * (dirt == "uneven-magnets"))
    if dirt == "missing-pulses":
        time = time[random.random(len(time)) > 0.3]
    if dirt == "extra-pulses":
        at = random.choice(len(time) - 1, 20, replace=False)
        time = np.sort(np.append(time, time[at] + np.diff(time)[at] * random.uniform(0.3, 0.7, 20)))
    answer, err = answered(capsys, write(tmp_path, {"pulse": time}, PULSES), *KNOWN)
    covers(answer)
    assert dirt in kinds(answer)
    assert dirt in err
    assert answer["goodness"]["coastdowns"][0]["measured"] == "pulses"
    assert answer["goodness"]["coastdowns"][0]["to_s"] < 30.0
    assert not {"gaps", "jitter"} & kinds(answer).keys()


def test_waits_between_pulses_are_added_up(tmp_path, capsys):
    time = pulses()
    chart = write(tmp_path, {"pulse": np.diff(time, prepend=0.0)}, PULSES.replace("unit", "increments = true\nunit"))
    answer, _ = answered(capsys, chart, *KNOWN)
    covers(answer)


@pytest.mark.parametrize(
    ("unit", "remedy"), [("ticks", "give decode.clock"), ("rpm", "unit"), ("ms", "give unit or decode.clock")]
)
def test_a_unit_that_stamps_cannot_have_is_an_error(tmp_path, capsys, unit, remedy):
    clock = 'clock = "1 MHz"\n' if unit == "ms" else ""
    chart = write(tmp_path, {"pulse": pulses()}, PULSES.replace('"ms"', f'"{unit}"') + clock)
    code, _, err = said(capsys, "identify", "coastdown", chart, *KNOWN)
    assert code == 3
    assert "loose.unit" in err
    assert remedy in err


def test_eight_zeros_among_five_thousand_rows_are_excluded(tmp_path, capsys):
    time = np.linspace(0.0, 30.0, 5000)
    values = 50.0 + angle(time)
    values[np.arange(600, 4600, 500)] = 0.0
    chart = write(
        tmp_path, {"t": time, "phi": values}, SPEEDS.format(more="").replace("rad/s", "rad").replace('"n"', '"phi"')
    )
    answer, err = answered(capsys, chart, *KNOWN)
    covers(answer)
    assert kinds(answer)["drop-outs"] == 8
    assert "(excluded)" in err


def test_a_negative_number_is_said_and_kept(tmp_path, capsys):
    time = np.arange(0.0, 20.0, 0.01)
    values = 10.0 + 50.0 * np.exp(-0.1 * time) - 3.0 * time / 20.0
    noisy = values[values > 8.0] + 0.01 * np.random.default_rng(1).normal(size=(values > 8.0).sum())
    chart = speeds(tmp_path, time[: len(noisy)], noisy)
    answer, _ = answered(capsys, chart, *KNOWN, "--law", "coulomb+viscous")
    assert answer["parameters"]["coulomb"]["ci95"][1] < 0.0
    assert any("coulomb is negative" in note for note in answer["warnings"])
    assert "the constant torque of the fit is negative" in answer["snippet"]


def test_seven_readings_by_hand_are_fitted_with_wide_intervals(tmp_path, capsys):
    """A wheel on bearings with oil, read every two minutes to 2 rpm."""
    minutes = np.arange(0.0, 14.0, 2.0)
    rpm = np.round(690.0 * np.exp(-6.5e-4 * 60.0 * minutes) + 2.0 * np.random.default_rng(8).normal(size=7))
    more = '[time]\nchannel = "t"\nunit = "min"\n[loose]\nchannel = "n"\nunit = "rpm"\n'
    answer, err = answered(capsys, write(tmp_path, {"t": minutes, "n": rpm}, more), "--inertia", "1 kg m^2")
    assert answer["law"] == "viscous"
    low, high = answer["parameters"]["viscous"]["ci95"]
    assert low <= 6.5e-4 <= high
    assert 0.01 < (high - low) / 6.5e-4 < 0.3
    assert any("7 readings only" in note for note in answer["warnings"])
    code, _, err = said(
        capsys, "identify", "coastdown", write(tmp_path, {"t": minutes[:4], "n": rpm[:4]}, more), *KNOWN
    )
    assert code == 3
    assert "has 4 rows" in err


@pytest.mark.parametrize("form", ["parquet", "hdf5"])
def test_epochs_in_nanoseconds_keep_every_digit(tmp_path, capsys, form):
    """Rounded to float64, 1.8e18 ns is known to 256 ns; here a fine encoder is read every 2 us."""
    time = np.arange(0, 60_000_000, 2_000, dtype=np.int64)
    values = 1.4e4 * 1e-9 * time - 0.5 * 2e5 * (1e-9 * time) ** 2  # 14,000 rad/s, slowed by 200,000 rad/s^2
    stamps = np.int64(1_800_000_000_123_456_789) + time
    file = tmp_path / f"log.{form}"
    if form == "parquet":
        pq.write_table(pa.table({"t": stamps, "phi": values}), file)
    else:
        with h5py.File(file, "w") as made:
            made["t"], made["phi"] = stamps, values
    chart = tmp_path / "record.toml"
    chart.write_text(
        f'format = 1\nfile = "{file.name}"\n[time]\nchannel = "t"\nunit = "ns"\n'
        '[loose]\nchannel = "phi"\nunit = "rad"\n'
    )
    answer, _ = answered(capsys, chart, *KNOWN, "--law", "coulomb")
    assert answer["parameters"]["coulomb"]["value"] == pytest.approx(2e5 * INERTIA, rel=1e-9)


def spun(torque, seed, law=None, rise=12.0, noise=0.05):
    """Return time and speed of a spin-up from rest under a torque and the coast-down after it, by scipy."""
    drag = law or (lambda w: DRY + SLOPE * w)
    up = solve_ivp(lambda t, y: [(torque - drag(y[0])) / INERTIA], (0, rise), [0.0], rtol=1e-10, atol=1e-10,
                   dense_output=True)  # fmt: skip
    down = solve_ivp(
        lambda t, y: [-drag(y[0]) / INERTIA], (0, 25), [up.y[0, -1]], rtol=1e-10, atol=1e-10, dense_output=True
    )
    time = np.arange(0.0, 2.0 + rise + 25.0, 0.02)
    values = np.where(time < 2.0 + rise, up.sol(np.clip(time - 2.0, 0.0, rise))[0],
                      down.sol(np.clip(time - 2.0 - rise, 0.0, 25.0))[0])  # fmt: skip
    values[time < 2.0] = 0.0
    return time, values + noise * np.random.default_rng(seed).normal(size=len(time)) * (time > 2.0)


def test_a_spin_up_is_that_of_the_closed_form():
    """Torque, dry and viscous friction: a rise towards the terminal speed."""
    since = np.linspace(0.0, 20.0, 41)
    law, start = Law(coulomb=2.0, viscous=0.3, push=14.0), 5.0
    last = (14.0 - 2.0) / 0.3
    angles, rates = spinning_up(law, start, since)
    assert rates == pytest.approx(last + (start - last) * np.exp(-0.3 * since), rel=1e-7)
    assert angles == pytest.approx(last * since + (start - last) / 0.3 * -np.expm1(-0.3 * since), rel=1e-7)
    assert spinning_up(law._replace(push=1.0), start, since) is None  # less than the dry friction


def test_spin_ups_under_a_known_torque_identify_inertia_and_drag(tmp_path, capsys):
    chart = speeds(tmp_path, *spun(0.3, 9))
    answer, err = answered(capsys, chart, "--torque", "0.3 N m")
    covers(answer, ((INERTIA, "inertia"), (DRY, "coulomb"), (SLOPE, "viscous")))
    low, high = answer["parameters"]["inertia"]["ci95"]
    assert high - low < 0.002 * INERTIA
    assert "1 free coast-down and 1 spin-up found" in err
    assert [one.get("torque_N_m") for one in answer["goodness"]["coastdowns"]] == [0.3, None]
    snippet = tomllib.loads(answer["snippet"])
    assert float(snippet["gears"]["loose"]["inertia"].removesuffix(" kg m^2")) == pytest.approx(INERTIA, rel=1e-3)
    unsure, _ = answered(capsys, chart, "--torque", "0.3 N m", "--torque-uncertainty", "0.006 N m")
    low, high = unsure["parameters"]["inertia"]["ci95"]
    assert (high - low) / INERTIA == pytest.approx(4 * 0.02, rel=0.05)


def test_a_spin_up_alone_gives_the_drag_where_the_inertia_is_known(tmp_path, capsys):
    chart = speeds(tmp_path, *spun(0.3, 10))
    answer, _ = answered(capsys, chart, "--torque", "0.3 N m", "--to", "13.5 s", *KNOWN)
    covers(answer)
    assert "gears" not in tomllib.loads(answer["snippet"])  # that the user gave the inertia changes no rig
    code, _, err = said(capsys, "identify", "coastdown", chart, "--torque", "0.3 N m", "--to", "13.5 s")
    assert code == 3
    assert "inertia: is not known: 0 coast-downs and 1 spin-ups" in err


@pytest.mark.slow
def test_a_torque_that_is_not_constant_is_said_first(tmp_path, capsys):
    """A motor whose torque falls by a tenth with the speed."""
    falling = lambda w: DRY + SLOPE * w + 0.0003 * w  # noqa: E731
    up, down = spun(0.3, 11, falling), spun(0.3, 11)
    values = np.where(up[0] < 14.0, up[1], down[1] * up[1][699] / down[1][699])
    answer, _ = answered(capsys, speeds(tmp_path, up[0], values), "--torque", "0.3 N m")
    low, high = answer["parameters"]["inertia"]["ci95"]
    assert answer["warnings"][0].startswith("the residual has structure") or low <= INERTIA <= high


def shown(what, hits):
    """Print a share and return it: ``pytest --slow -s -k draws`` shows the shares."""
    print(f"{what}: {sum(hits)} of {len(hits)}")  # noqa: T201 - the documentation has these numbers
    return float(np.mean(hits))


@pytest.mark.slow
def test_draws_of_spin_ups_are_covered():
    hits = {name: [] for name in ("inertia", "coulomb", "viscous")}
    for seed in range(100, 140):
        tracks = make_tracks(*spun(0.3, seed), "speed", torque=0.3)
        found = identify_coastdown(tracks, None, law="coulomb+viscous").parameters
        for name, truth in (("inertia", INERTIA), ("coulomb", DRY), ("viscous", SLOPE)):
            hits[name].append(found[name].low <= truth <= found[name].high)
    for name, one in hits.items():
        assert shown(name, one) >= 0.9


@pytest.mark.slow
@pytest.mark.parametrize("law", ["viscous", "coulomb", "coulomb+viscous"])
def test_draws_of_seven_readings_are_covered(law):
    """Torques at a quarter, half and three quarters of the speeds, all three within, whichever law was taken."""
    rate = 6.5e-4
    drag = {
        "viscous": lambda w: rate * w,
        "coulomb": lambda w: 0.04,
        "coulomb+viscous": lambda w: 0.8 * rate * (w + 30),
    }
    time = np.arange(0.0, 840.0, 120.0)
    true = {"viscous": 72.0 * np.exp(-rate * time), "coulomb": 72.0 - 0.04 * time,
            "coulomb+viscous": 102.0 * np.exp(-0.8 * rate * time) - 30.0}[law]  # fmt: skip
    hits = []
    for seed in range(60):
        rpm = np.round(true * 30 / np.pi + 2.0 * np.random.default_rng(seed).normal(size=7))
        found = identify_coastdown(make_tracks(time, rpm * np.pi / 30, "speed"), 1.0)
        low, high = found.goodness["speed_rad_s"]
        within = []
        for part in dirty_scores.SPEEDS:
            at = low + part * (high - low)
            _, least, most = dirty_scores.torque_at(found, at)
            within.append(least <= drag[law](at) <= most)
        hits.append(all(within))
    assert shown(law, hits) >= 0.9

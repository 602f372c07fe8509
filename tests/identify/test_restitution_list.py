"""Lists of impacts: the coefficient that made them comes back with its interval."""

import json

import numpy as np
import pytest

from gears3d.cli import main

RANDOM = np.random.default_rng(4)


def identified(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["identify", "restitution", *map(str, arguments), "--json"])
    out = capsys.readouterr()
    assert end.value.code in (0, None), out.err
    return json.loads(out.out)


def table(path, header, *columns):
    rows = zip(*columns, strict=True)
    path.write_text(header + "\n" + "\n".join(",".join(f"{each:.9g}" for each in row) for row in rows) + "\n")
    return path


def drops(count, bounces, law, spread, seed):
    """Return drop numbers and speeds from bounce to bounce, (count, bounces)."""
    random = np.random.default_rng(seed)
    speed = np.zeros((count, bounces))
    speed[:, 0] = random.uniform(1.0, 3.0, count)
    for k in range(1, bounces):
        speed[:, k] = speed[:, k - 1] * np.clip(law(speed[:, k - 1]) + spread * random.normal(size=count), 0.01, 0.99)
    return speed


@pytest.mark.parametrize(
    ("header", "scale"), [("velocity_before [mm/s],velocity_after [mm/s]", 1e3), ("v_approach,v_rebound", 1.0)]
)
def test_speeds_give_the_linear_law(header, scale, tmp_path, capsys):
    before = RANDOM.uniform(0.1, 2.0, 300)
    after = before * (0.8 - 0.1 * before + 0.02 * RANDOM.normal(size=300))
    found = identified(capsys, table(tmp_path / "a.csv", header, scale * before, -scale * after))
    assert found["law"] == "linear"
    for name, value in (("restitution", 0.8), ("slope", -0.1), ("standard_deviation", 0.02)):
        low, high = found["parameters"][name]["ci95"]
        assert low < value < high
        assert high - low < 0.4 * abs(value)
    assert 'kind = "restitution_speed"' in found["snippet"]


def test_angular_speeds_and_few_impacts_give_a_constant(tmp_path, capsys):
    before = np.array([3.0, 2.0, 4.0, 5.0])
    path = table(
        tmp_path / "a.csv", "omega_before [rad/s],omega_after [rad/s]", before, before * [0.5, 0.52, 0.48, 0.5]
    )
    found = identified(capsys, path)
    assert found["law"] == "constant"
    assert found["parameters"]["restitution"]["value"] == pytest.approx(0.5)


@pytest.mark.parametrize("seed", range(6))
def test_bounce_times_and_heights_cover_the_truth(seed, tmp_path, capsys):
    speed = drops(12, 6, lambda v: 0.7, 0.01, seed)
    number = np.repeat(np.arange(12), 6)
    lasted = 2.0 * speed / 9.81
    times = np.concatenate([np.zeros((12, 1)), np.cumsum(lasted, axis=1)], axis=1)
    e = {
        "times": table(tmp_path / "t.csv", "drop,bounce_time [ms]", np.repeat(np.arange(12), 7), 1e3 * times.ravel()),
        "lasted": table(tmp_path / "d.csv", "drop,flight_duration_s", number, lasted.ravel()),
        "heights": table(tmp_path / "h.csv", "drop,bounce_height [cm]", number, 100 * speed.ravel() ** 2 / 2 / 9.81),
    }
    found = {name: identified(capsys, path)["parameters"] for name, path in e.items()}
    values = [one["restitution"]["value"] for one in found.values()]
    assert np.ptp(values) < 1e-6
    assert values[0] == pytest.approx(0.7, abs=0.006)
    low, high = found["times"]["standard_deviation"]["ci95"]
    assert low < 0.01 < high * 1.1


def test_the_interval_covers_as_often_as_it_says():
    from gears3d.identify.restitution_list import ImpactList, identify_restitution_list

    hits = 0
    for seed in range(300):
        random = np.random.default_rng(seed)
        before = random.uniform(1.0, 2.0, 8)
        after = before * np.exp(np.log(0.6) + 0.05 * random.normal(size=8))
        one = ImpactList("durations", before, after, np.zeros(8), False, "a")
        p = identify_restitution_list([one]).parameters["restitution"]
        hits += p.low < 0.6 < p.high
    assert 0.91 < hits / 300 < 0.985


def test_drop_and_bounce_heights_in_one_row(tmp_path, capsys):
    path = table(tmp_path / "h.csv", "drop_height,bounce_height", [100.0, 100.0, 50.0], [36.0, 36.0, 18.0])
    assert identified(capsys, path)["parameters"]["restitution"]["value"] == pytest.approx(0.6)


def test_zeros_behind_the_last_bounce_are_no_bounces(tmp_path, capsys):
    path = table(tmp_path / "a.csv", "Interval (s)", [0.8, 0.4, 0.2, 0.1, 0.0, 0.0])
    found = identified(capsys, path)
    assert found["parameters"]["restitution"]["value"] == pytest.approx(0.5)
    assert found["goodness"]["pairs"] == 3


def test_a_coefficient_that_changes_is_reported(tmp_path, capsys):
    speed = drops(10, 6, lambda v: 0.9 - 0.15 * v, 0.005, 1)
    path = table(tmp_path / "d.csv", "drop,flight_duration", np.repeat(np.arange(10), 6), 2.0 * speed.ravel() / 9.81)
    found = identified(capsys, path)
    assert any("e changes with the durations before the impact" in note for note in found["warnings"])


@pytest.mark.parametrize(
    ("header", "columns", "message"),
    [
        ("bounce_height", [[3.0, 2.0, 4.0, 1.0]], "the heights rise from 2 to 4 at bounce 2"),
        ("v_before,v_after", [[1.0, 0.0, 1.0], [0.5, 0.5, 0.5]], "row 2 has 0 before and 0.5 after"),
        ("v_before,v_after", [[1.0, 1.0], [0.5, 0.5]], "shows 2 impacts, 3 are needed"),
        ("v_before [kg],v_after [kg]", [[1.0, 1.0, 1.0], [0.5, 0.5, 0.5]], "v_before"),
        ("a,b", [[1.0, 2.0], [0.5, 0.5]], "Missing option '--rig'"),
    ],
)
def test_what_is_no_list_is_one_line(header, columns, message, tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        main(["identify", "restitution", str(table(tmp_path / "a.csv", header, *columns))])
    error = capsys.readouterr().err
    assert end.value.code
    assert message in error
    assert "Traceback" not in error


def test_columns_that_occur_again_are_further_drops(tmp_path, capsys):
    lasted = 0.8 * 0.7 ** np.arange(6)[:, None] * np.exp([0.02, -0.01, 0.0, 0.01] * np.arange(6)[:, None])
    rows = [";".join(f"{each:.6f};" for each in row) for row in lasted]
    path = tmp_path / "a.csv"
    path.write_text("Interval (s);;" * 4 + "\n" + "\n".join(rows) + "\n")
    found = identified(capsys, path)
    assert (found["goodness"]["drops"], found["goodness"]["pairs"]) == (4, 20)
    assert found["parameters"]["restitution"]["value"] == pytest.approx(0.7 * np.exp(0.005), rel=1e-4)


@pytest.mark.parametrize("between", [0.0, 0.03])
def test_the_interval_counts_that_drops_differ(between):
    from gears3d.identify.restitution_list import ImpactList, identify_restitution_list

    hits, reported = 0, 0
    for seed in range(300):
        random = np.random.default_rng(seed)
        drop = np.repeat(np.arange(8), 6)
        before = random.uniform(1.0, 2.0, 48)
        e = np.log(0.6) + between * random.normal(size=8)[drop] + 0.01 * random.normal(size=48)
        found = identify_restitution_list([ImpactList("durations", before, before * np.exp(e), drop, False, "a")])
        hits += found.parameters["restitution"].low < 0.6 < found.parameters["restitution"].high
        reported += any("e differs between the 8 drops" in note for note in found.warnings)
    assert 0.91 < hits / 300 < 0.99
    assert reported / 300 > 0.95 if between else reported / 300 < 0.03


def test_a_scatter_that_is_not_normal_is_reported_with_mean_and_median(tmp_path, capsys):
    random = np.random.default_rng(1)
    before = random.uniform(0.9, 1.4, 200)
    e = 0.25 + random.exponential(0.06, size=200)
    found = identified(capsys, table(tmp_path / "a.csv", "v_before,v_after", before, before * e))
    low, high = found["parameters"]["restitution"]["ci95"]
    assert low <= e.mean() + 1e-3
    assert low <= np.median(e) + 1e-3
    assert high >= e.mean() - 1e-3
    assert any("the scatter of e is not normal" in note for note in found["warnings"])


@pytest.mark.parametrize("signs", [1.0, -1.0])
def test_impacts_that_move_on_are_excluded(signs, tmp_path, capsys):
    before = np.linspace(1.0, 2.0, 30)
    after = signs * before * (0.5 + 0.01 * np.sin(np.arange(30)))
    after[7] *= -1.0
    found = identified(capsys, table(tmp_path / "a.csv", "v_before,v_after", before, after))
    assert found["goodness"]["pairs"] == 29
    assert any("1 of 30 impacts excluded, the first in row 8" in note for note in found["warnings"])
    after[10:16] *= -1.0
    with pytest.raises(SystemExit):
        main(["identify", "restitution", str(table(tmp_path / "b.csv", "v_before,v_after", before, after))])
    assert "7 of 30 rebounds have another sense than the rest" in capsys.readouterr().err

"""What is varied is read with units and refused with a remedy."""

import numpy as np
import pytest

from gears3d.errors import InputError, UsageError
from gears3d.scenario import load
from gears3d.sweep import make_plan, parse_axis

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml")
AMPLITUDE = "motion.harmonics[0].amplitude"


def test_values_are_those_that_the_scenario_would_read():
    axis = parse_axis(RIG, f"{AMPLITUDE}=1..5 rpm lin 5")
    for written, value in zip(axis.written, axis.values, strict=True):
        assert RIG.with_({AMPLITUDE: written}).motion.harmonics[0].amplitude == value
    assert axis.values[1] == RIG.with_({AMPLITUDE: "2 rpm"}).motion.harmonics[0].amplitude


def test_logarithmic_values_have_one_ratio():
    values = np.array(parse_axis(RIG, "drag.torque=0.1..1.6 N m log 5").values)
    np.testing.assert_allclose(values[1:] / values[:-1], 2.0, rtol=1e-12)


def test_one_unit_at_the_end_serves_a_list():
    assert parse_axis(RIG, "drag.torque=220, 460, 750 mN m").values == (0.22, 0.46, 0.75)


def test_the_last_of_a_list_is_counted_from_the_front():
    assert parse_axis(RIG, "motion.harmonics[-1].frequency=1,2 Hz").key == "motion.harmonics[0].frequency"


def test_values_come_from_a_file(tmp_path):
    file = tmp_path / "torques.csv"
    file.write_text("torque,note\n# measured\n0.22 N m,a\n0.46,b\n")
    assert parse_axis(RIG, f"drag.torque=@{file} N m").values == (0.22, 0.46)


def test_parameters_of_effects_and_words_are_varied():
    oily = load("scenarios/dct-helical-lubricated/fig13.toml")
    assert parse_axis(oily, "effect[0].viscosity=10..30 mPa s lin 3").values == (0.01, 0.02, 0.03)
    assert parse_axis(oily, "start.state=free,active").written == ("free", "active")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("drag.torqe=1..2 N m lin 3", "did you mean 'drag.torque'"),
        ("motion.harmonics[1].phase=0..1 rad lin 3", "not a known key"),
        ("motion.harmonics[0].frequency=1..10 rpm lin 3", "is a rotational speed, not a frequency"),
        ("drag.torque=1..2 lin 3", "has no unit"),
        ("drag.torque=1..2 N m lin 0", "the grid would be empty"),
        ("drag.torque=1..2 N m lin x", "the grid would be empty"),
        ("drag.torque=1..2 N m cubic 3", "neither lin nor log"),
        ("drag.torque=1..2 N m lin 1", "a range of one value"),
        ("drag.torque=0..2 N m log 3", "not above 0"),
        ("drag.torque=@/no/such.csv N m", "cannot be read"),
        ("drag.torque=1 N m, 1000 mN m", "twice"),
        ("impact.restitution=0..2 lin 3", "at most 1"),
        ("start.state=flying", "not allowed"),
        ("run.duration=1,2 s", "--periods"),
        ("torque=1..2 N m lin 3", "did you mean 'drag.torque'"),
        ("title=a,b", "schema` tells all keys"),
        ("motion.record=a,b", "is a text"),
        ("gears.drive.teeth=20..21 lin 4", "no whole numbers"),
        ("motion.harmonics[0].amplitude=1 rpm, 2 rad/s^2", "mixes"),
    ],
)
def test_what_makes_no_axis_is_refused_with_a_remedy(text, message):
    with pytest.raises(InputError, match=message):
        parse_axis(RIG, text)


def test_all_faults_are_told_at_once():
    with pytest.raises(InputError) as caught:
        make_plan(RIG, ["drag.torqe=1,2 N m", "impact.restitution=2"], measures=["regimes"])
    assert len(caught.value.faults) == 3


def test_a_plan_needs_something_to_vary_and_periods_to_keep():
    with pytest.raises(UsageError, match="nothing is varied"):
        make_plan(RIG, [])
    with pytest.raises(UsageError, match="nothing remains"):
        make_plan(RIG, ["drag.torque=1,2 N m"], periods=2, settle=2)
    with pytest.raises(UsageError, match="did you mean 'rigid'"):
        make_plan(RIG, ["drag.torque=1,2 N m"], "rigyd")
    with pytest.raises(InputError, match="is varied twice"):
        make_plan(RIG, ["drag.torque=1,2 N m", "drag.torque=3 N m"])
    with pytest.raises(InputError, match="is not varied"):
        make_plan(RIG, ["drag.torque=1,2 N m"], follow="impact.restitution")
    with pytest.raises(InputError, match="has no 'ri'"):
        make_plan(RIG, ["drag.torque=1,2 N m"], measures=["ri"])


def test_the_key_changes_with_everything_that_the_numbers_depend_on():
    ask = ["drag.torque=0.2..0.8 N m lin 4"]
    base = make_plan(RIG, ask)
    others = [
        make_plan(RIG, ["drag.torque=0.2..0.8 N m lin 5"]),
        make_plan(RIG.with_({"impact.restitution": 0.31}), ask),
        make_plan(RIG.with_({"run.seed": 1}), ask),
        make_plan(RIG, ask, "plastic"),
        make_plan(RIG, ask, periods=16),
        make_plan(RIG, ask, settle=3),
        make_plan(RIG, ask, strobe=0.5),
        make_plan(RIG, ask, follow="drag.torque"),
        make_plan(RIG, ask, measures=["regime"]),
    ]
    assert len({base.key, *(plan.key for plan in others)}) == 10
    assert make_plan(RIG, ask).key == base.key


def test_seeds_go_by_the_values_of_a_point_alone():
    few = make_plan(RIG, ["drag.torque=0.2,0.4 N m", "impact.restitution=0.1,0.3"])
    many = make_plan(RIG, ["impact.restitution=0.3,0.2,0.1", "drag.torque=0.4,0.3,0.2 N m"])

    def table(plan):
        points = np.arange(plan.size)
        values = plan.values(points)
        rows = zip(values["drag.torque"].tolist(), values["impact.restitution"].tolist(), strict=True)
        return dict(zip(rows, plan.seeds(points).tolist(), strict=True))

    ours, theirs = table(few), table(many)
    assert ours.items() <= theirs.items()
    assert len(set(theirs.values())) == 9
    asked = make_plan(RIG, ["run.seed=7,8"])
    assert asked.seeds(np.arange(2)).tolist() == [7, 8]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("drag.torque=0.1..1 N m lin 1000000000000", "of memory"),
        ("drag.torque=0.1..1 N m lin " + "9" * 400, "is not a number of values"),
        ("drag.torque=" + " " * 100_000 + "0.1..", "is no"),
        ("drag.torque=0.1.." + "1 " * 50_000, "is not a range"),
        ("drag.torque=1" + " " * 100_000 + "N m, 2 N m", "is not a quantity"),
        ("drag.torque=@/dev/zero N m", "is a device"),
        ("drag.torque=@nowhere.csv N m", "No such file"),
    ],
)
def test_an_axis_that_would_hang_or_fill_the_memory_is_refused(text, why):
    with pytest.raises(InputError, match=why):
        parse_axis(RIG, text)


def test_a_value_that_is_there_twice_is_found_among_many(tmp_path):
    (tmp_path / "values.csv").write_text("".join(f"{1 + k}\n" for k in range(20_000)) + "7\n")
    with pytest.raises(InputError, match="has '7 N m' twice"):
        parse_axis(RIG, f"drag.torque=@{tmp_path / 'values.csv'} N m")

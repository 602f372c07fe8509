"""The papers' open questions: what could be the cause is run again by other ways, what cannot is scanned again."""

import math
from functools import cache

import numpy as np
import pytest

from gears3d.effects import catalogue
from gears3d.verification.papers import Bench, hold, paper
from gears3d.verification.papers.findings import QUESTIONS, answer, page, question, recorded, rows_of, solve

BY_DEFAULT = ("drive_motion", "drag_coulomb", "drag_position", "inertia", "backlash_variation")
"""Causes whose row on record is tested by default: those that other tests find by other ways, and a null."""


@pytest.fixture(scope="module")
def bench():
    return Bench()


def cause(name, start):
    return next(each for each in question(name).causes if each.name.startswith(start))


@pytest.fixture(scope="module")
def answered(bench):
    """Return the answer for a cause of a question, each found once."""

    @cache
    def found(name, of):
        asked = question(name)
        return answer(asked, next(each for each in asked.causes if each.name == of), bench)

    return found


def listed(names):
    for name in names:
        for i, each in enumerate(question(name).causes):
            soon = each.name.startswith(BY_DEFAULT) and name != "ottewill-2010"
            yield pytest.param(name, i, marks=() if soon else pytest.mark.slow, id=each.name)


@pytest.mark.parametrize(("name", "which"), [*listed(QUESTIONS)])
def test_the_answer_on_record_is_what_comes_out(bench, answered, name, which):
    asked = question(name)
    found = answered(name, asked.causes[which].name)
    (row,) = rows_of(asked, [found], bench)
    kept = [one for one in recorded(name) if (one["effect"], one["values"]) == (row["effect"], row["values"])]
    assert [(one["verdict"], one["size"]) for one in kept] == [(row["verdict"], row["size"])]


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_cause_is_on_record_and_on_the_page(name):
    asked, rows = question(name), recorded(name)
    assert sorted(row["effect"] for row in rows) == sorted(cause.name for cause in asked.causes)
    lines = page([(asked, rows)]).splitlines()
    for row in rows:
        line = next(one for one in lines if one.startswith(f"| {row['effect']} | ") and row["values"] in one)
        assert row["size"] in line
        assert ("**could**" in line) == (row["verdict"] == "could")


@pytest.mark.parametrize("name", QUESTIONS)
def test_every_kind_is_a_cause_or_is_listed_as_not_tried(name):
    asked = question(name)
    named = " ".join([*(each.name for each in asked.causes), *asked.left_out])
    assert not [kind for kind in catalogue() if kind not in named and kind != "drag_drift"]


@pytest.mark.parametrize("multiple", [2, 3, 6, 12])
def test_a_harmonic_of_the_drive_needs_what_the_closed_form_says(answered, multiple):
    """At its worst phase the n-th harmonic decelerates n times its share: the excitation is 1/(1 + n*share)."""
    asked = question("kadmiri-2012")
    found = answered("kadmiri-2012", cause("kadmiri-2012", f"drive_motion, {multiple}x").name)
    assert found.size == pytest.approx((1 / asked.target - 1) / multiple, rel=0.03)


KADMIRI = {
    "drive_motion, 3x": lambda size, swing: {
        "motion.harmonics": [
            {"amplitude": f"{swing} rad/s", "order": 2, "phase": "90 deg"},
            {"amplitude": f"{swing * size} rad/s", "order": 6, "phase": "270 deg"},
        ]
    },
    "drag_coulomb or": lambda size, swing: {"drag.torque": f"{0.893 * (1 - size)} N m"},
    "inertia": lambda size, swing: {"gears.loose.inertia": f"{9.884e-4 * (1 + size)} kg m^2"},
    "drag_position": lambda size, swing: {
        "effect": [{"kind": "drag_position", "amplitude": f"{0.893 * size} N m", "order": 1}]
    },
}


@pytest.mark.parametrize("name", KADMIRI)
def test_the_size_makes_the_scenario_rattle_where_the_gearbox_did(bench, answered, name):
    found = answered("kadmiri-2012", cause("kadmiri-2012", name).name)
    impacts = []
    for part in (0.92, 1.08):
        swing = 4.19 * 0.35 / 0.3741 * part
        more = {"motion.harmonics": [{"amplitude": f"{swing} rad/s", "order": 2, "phase": "90 deg"}]}
        told = bench.outcome("kadmiri-2012/table1-750rpm.toml", more | KADMIRI[name](found.size, swing))
        impacts.append(told["impacts"])
    assert impacts[0] == 0 < impacts[1]


@pytest.mark.parametrize("name", ["drive_motion, 2x", "drive_motion, 3x"])
def test_the_harmonic_gives_both_impact_speeds_of_rigaud(bench, answered, name):
    found = answered("rigaud-2020", cause("rigaud-2020", name).name)
    first = {"amplitude": "20 rpm", "frequency": "3 Hz"}
    more = {
        "amplitude": f"{20 * found.nearest} rpm",
        "frequency": f"{3 * int(name[-2])} Hz",
        "phase": f"{(math.pi / 2 + found.phase) % (2 * math.pi)} rad",
    }
    told = bench.outcome(
        "rigaud-2020/fig5-20rpm.toml",
        {"motion.harmonics": [first, more], "mount.backlash": f"{found.values[2]} um", "impact.restitution": 0}
        | {"run.duration": "22 periods", "run.output_rate": "2 kHz"},
    )  # fmt: skip
    assert -1e3 * told["active_crossing_velocity_mean_m_s"] == pytest.approx(22.3, abs=0.2)
    assert 1e3 * told["reverse_crossing_velocity_mean_m_s"] == pytest.approx(19.9, abs=0.2)


@pytest.mark.parametrize(
    "name", ["drag_coulomb, more", "restitution_asymmetry, reverse", "transmission_error, order 1"]
)
def test_no_size_up_to_the_bound_slows_the_reverse_flank(bench, name):
    asked, who = question("rigaud-2020"), cause("rigaud-2020", name)
    for size in np.geomspace(0.03, 1.0, 5) * who.bound:
        assert asked.evaluation.values(bench, who, size, 0.0)[1] > 21.0


def test_a_wandering_drag_shifts_the_contours_of_ottewill(bench):
    asked, who = question("ottewill-2010"), cause("ottewill-2010", "drag_position, order 1")
    assert asked.evaluation.holds(asked.evaluation.values(bench, who, 0.3, 0.75 * math.pi))


@pytest.mark.slow
def test_a_wandering_drag_shifts_the_contours_of_ottewill_on_their_own_grid(bench):
    """Held against the full contours of the paper's rows, which have other amplitudes and phases."""
    (row,) = (each for each in paper("ottewill-2010").claims if "a drag that varies" in each.quantity)
    assert hold(row, bench).computed > math.pi - 0.5


@pytest.mark.parametrize("start", ["mesh_friction", "transmission_error, order 1", "backlash_offset"])
def test_what_cannot_shift_the_contours(bench, start):
    asked, who = question("ottewill-2010"), cause("ottewill-2010", start)
    assert not asked.evaluation.holds(asked.evaluation.values(bench, who, who.bound, 0.0))


@pytest.mark.parametrize("name", ["mesh_friction", "transmission_error, order 19"])
def test_no_size_up_to_the_bound_gives_the_four_excitations(bench, name):
    asked, who = question("kadmiri-2012"), cause("kadmiri-2012", name)
    for size in np.geomspace(0.02, 1.0, 5) * who.bound:
        assert not asked.evaluation.holds(asked.evaluation.values(bench, who, size, 1.0))


def test_a_jump_past_the_target_is_no_size():
    assert solve(lambda size: math.copysign(1.0, size - 1.05), 3.0, 1e-3, 10)[0] is None

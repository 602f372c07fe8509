"""Effects that a generator with equations of its own hides are found, and nothing where nothing is hidden.

The fast ones run the search on two short records; the slow ones go through the command's own door on whole challenges.
"""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gears3d import cli
from gears3d.diagnosis import diagnose
from gears3d.errors import Fault, InputError
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan, reveal
from tests.diagnosis.blind import Case, play

pytestmark = pytest.mark.usefixtures("low_orders")
SEPARABLE = (
    "transmission_error", "eccentricity", "backlash_offset", "backlash_variation", "drag_coulomb", "drag_viscous",
    "drag_power", "drag_position", "restitution_offset", "restitution_asymmetry", "restitution_scatter", "drive_motion",
    "encoder_eccentricity", "encoder_skew", "mesh_drag",
)  # fmt: skip


def run(arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(arguments)
    return stop.value.code or 0


def judged(folder: Path):
    """Return diagnosis and score of a challenge."""
    rig = load(folder / "rig.toml")
    admitted = [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])]
    found = diagnose(admitted, rig)
    file = folder / "diagnosis.json"
    file.write_text(json.dumps(found.to_dict()), encoding="utf-8")
    return found, reveal(folder, file)


def hidden(folder: Path, kinds, seed=1, **options):
    hide(plan(seed, kinds, **options), folder)
    return judged(folder)


@pytest.mark.parametrize("kind", ["encoder_eccentricity", pytest.param("drag_viscous", marks=pytest.mark.slow)])
def test_a_hidden_effect_is_named_and_measured(tmp_path, kind):
    found, score = hidden(tmp_path / "c", (kind,), size=0.3, records=2, duration=2.0)
    assert score["kinds_first"], found.to_dict()
    assert not score["wrong_names"]
    assert all(abs(one["error"]) < 0.05 for one in score["parameters"] if one["error"] is not None)
    assert found.to_dict()["heldout"]["gain"] > 0.9
    assert found.extended.effects[-1].kind == kind


def test_records_that_cannot_be_segmented_agree_by_their_path(tmp_path, monkeypatch):
    def refuse(*_):
        raise InputError(Fault("", "does not fly", "record faster"))

    hide(plan(1, (), records=2, duration=2.0), tmp_path / "c")
    monkeypatch.setattr("gears3d.diagnosis.diagnosis.segmented", refuse)
    found = diagnose(tmp_path / "c" / "record.toml", tmp_path / "c" / "rig.toml")
    assert found.verdict == "nothing_to_add"
    assert max(found.power.values()) < 0.1


def test_a_search_without_an_end_decides_nothing(tmp_path):
    hide(plan(1, ("encoder_eccentricity",), size=0.3, records=2, duration=2.0), tmp_path / "c")
    found = diagnose(tmp_path / "c" / "record.toml", tmp_path / "c" / "rig.toml", effort=0.001)
    assert found.verdict == "not_decidable"
    assert not found.causes
    assert "search-incomplete" in [one.kind for one in found.notes if one.blocks]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [10, 7])
def test_a_power_of_the_speed_is_told_at_one_mean_speed(seed):
    # far from the exponent that is tried first; a straight step in coefficient and exponent leads nowhere there
    found = play(
        Case("sets", seed, ("drag_power",), (("duration", 2.0), ("records", 3), ("noise", 0.003)), "one speed")
    )
    assert found["kinds_first"], found["causes"]
    assert not found["wrong_names"]
    assert all(abs(one["error"]) < 0.05 for one in found["parameters"] if one["error"] is not None)


@pytest.mark.slow
def test_a_torque_over_a_difference_of_speeds_is_told_from_wherever_its_fit_begins():
    # straight are the coefficient and its product with the other speed; a power with a dry drag fitted better here
    found = play(Case("kinds", 62, ("drag_differential",), (("duration", 3.0), ("noise", 0.003))))
    assert found["kinds_first"], found["causes"]
    assert not found["wrong_names"]
    assert all(abs(one["error"]) < 0.001 for one in found["parameters"])


@pytest.mark.slow
def test_a_mesh_drag_is_found_from_far_off():
    # it is felt with its square, and a bit more of it holds contact for ever: straight steps from far off overshoot
    found = play(Case("kinds", 218, ("mesh_drag",), (("duration", 2.0), ("noise", 0.003), ("records", 3))))
    assert [one["kind"] for one in found["causes"]] == ["mesh_drag"]
    assert abs(found["parameters"][0]["error"]) < 0.02


@pytest.mark.slow
def test_records_are_freed_of_a_delay_that_only_the_search_finds(tmp_path):
    found, score = hidden(tmp_path / "c", ("encoder_skew",), 10, size=0.03, records=2, duration=2.0, noise=0.003)
    assert not any(each["kind"] == "skew" for one in found.findings.values() for each in one)  # the gate sees none
    assert score["kinds_first"], found.to_dict()
    assert not score["wrong_names"]
    assert all(abs(one["error"]) < 0.01 for one in score["parameters"] if one["error"] is not None)


@pytest.mark.slow
def test_a_delay_passes_for_no_law_of_restitution():
    # flanks that move with the speed were drawn amiss by microns, and every blow was off by what falls in that
    found = play(Case("limits", 209, ("encoder_skew",), (("size", 0.04), ("noise", 0.003))))
    assert [one["kind"] for one in found["causes"]] == ["encoder_skew"]


@pytest.mark.slow
def test_blows_about_a_single_tooth_pass_for_no_law_of_restitution():
    # the tooth throws the gear at the other flank and meets it again before its rebound is seen
    found = play(Case("kinds", 377, ("pitch_error",), (("noise", 0.015),)))
    assert [one["kind"] for one in found["causes"]] == ["pitch_error"]


@pytest.mark.slow
def test_a_constant_drag_at_one_speed_stands_in_its_set():
    """It was reported as `drag_differential` with a shaft of -3,273 rad/s, `drag_coulomb` not among its hypotheses."""
    told = play(Case("kinds", 231, ("drag_coulomb",), (("noise", 0.003),), "one speed"))
    (one,) = told["causes"]
    assert "drag_coulomb" in (one["kind"], *one["or"])
    assert told["wrong_names"] == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [31, 32])
def test_orders_of_a_fluctuation_locked_to_the_drive_are_no_errors_of_its_teeth(tmp_path, seed):
    """Multiples of a fluctuation of order 12 were reported as transmission errors of orders 12, 24, 36 and 60."""
    made, each = plan(seed, (), duration=4.0), []
    for one in made.conditions:
        mean = float(one["motion.mean"].split()[0])
        sine = {**one["motion.harmonics"][0], "frequency": f"{12.0 * mean / (2.0 * np.pi)!r} Hz"}
        each.append({**one, "motion.harmonics": [sine]})
    hide(replace(made, conditions=tuple(each)), tmp_path / "c")
    found, _ = judged(tmp_path / "c")
    assert not found.causes, found.to_dict()


@pytest.mark.slow
@pytest.mark.parametrize("kind", SEPARABLE)
def test_each_separable_kind_is_right_first(tmp_path, kind):
    found, score = hidden(tmp_path / "c", (kind,), seed=5, size=0.3)
    assert score["set_right"], found.to_dict()
    assert not score["wrong_names"], found.to_dict()


@pytest.mark.slow
def test_a_fresh_seed_with_nothing_hidden_is_silent(tmp_path):
    seed = int.from_bytes(os.urandom(2), "big")
    print(f"seed {seed}")  # noqa: T201
    found, _ = hidden(tmp_path / "c", (), seed=seed)
    assert not found.causes, f"seed {seed}: {found.to_dict()}"


@pytest.mark.parametrize(
    "without",
    [("--no-3d", "--no-experiments", "--no-replay"), pytest.param((), marks=pytest.mark.slow)],
    ids=["numbers", "all"],
)
def test_the_command_writes_what_it_says(tmp_path, without):
    hide(plan(2, ("drag_coulomb",), size=0.4, records=2, duration=2.0), tmp_path / "c")
    arguments = ["diagnose", str(tmp_path / "c/record.toml"), "--rig", str(tmp_path / "c/rig.toml"), "--out",
                 str(tmp_path / "d"), "--json", *without]  # fmt: skip
    assert run(arguments) == 0
    told = json.loads((tmp_path / "d/diagnosis.json").read_text())
    assert told["verdict"] in ("explained", "partly_explained")
    assert told["causes"][0]["kind"] == "drag_coulomb"
    assert load(tmp_path / "d/extended.toml").effects[-1].kind == "drag_coulomb"
    score = reveal(tmp_path / "c", tmp_path / "d/diagnosis.json")
    assert score["kinds_first"]


def test_a_missing_rig_is_named(tmp_path, capsys):
    assert run(["diagnose", str(tmp_path / "none.parquet")]) == 2
    assert "--rig" in capsys.readouterr().err

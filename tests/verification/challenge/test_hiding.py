"""Challenges: what is drawn stays drawn, what is sealed stays sealed, what is scored is what was hidden."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gears3d.effects import catalogue
from gears3d.errors import InputError, UsageError
from gears3d.scenario import load
from gears3d.verification.challenge import ASKED, KINDS, UNKNOWN, hide, observe, plan, reveal, score
from gears3d.verification.challenge.machine import machine
from gears3d.verification.challenge.physics import ACTIVE, REVERSE, flank

HERE = Path(__file__).parent


def frozen(name):
    return dict(line.split() for line in (HERE / name).read_text().splitlines())


@pytest.mark.parametrize(("name", "seeds"), [("seeds-tune.txt", (0, 7, 99)), ("seeds-test.txt", (100, 333, 499))])
def test_seeds_are_frozen(name, seeds):
    digests = frozen(name)
    for seed in seeds:
        assert plan(seed).digest() == digests[str(seed)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["seeds-tune.txt", "seeds-test.txt"])
def test_all_seeds_are_frozen(name):
    digests = frozen(name)
    assert len(set(digests.values())) == len(digests)
    assert {seed: plan(int(seed)).digest() for seed in digests} == digests


def test_every_kind_of_the_catalogue_can_be_hidden():
    assert {*KINDS, *ASKED} == set(catalogue())
    assert not {*KINDS} & {*ASKED}


@pytest.mark.parametrize("kind", [*KINDS, *ASKED])
def test_a_kind_is_drawn_in_its_size(kind):
    drawn = plan(3, (kind,), size=0.3)
    effect = drawn.told()["effects"][0]
    assert effect["kind"] == kind
    made = drawn.rig.with_({"effect": [drawn.effects[0]]}).effects[0]
    leading = effect[next(iter(catalogue()[kind].params))]
    share = made.unit_size(drawn.rig.rig()) / leading if kind == "tooth_compliance" else leading
    unit = 1.0 if kind == "tooth_compliance" else made.unit_size(drawn.rig.rig())
    assert abs(share / unit) == pytest.approx(0.3, rel=1e-4)


def test_unknown_kinds_are_told():
    with pytest.raises(UsageError, match="did you mean 'drag_viscous'"):
        plan(1, ("drag_viscos",))


@pytest.mark.parametrize("name", [*UNKNOWN, "encoder_skew", "oil_film", "carried_inertia", "drag_stick_slip"])
def test_what_is_hidden_shows_in_the_records(name):
    signals = []
    for kinds in ((name,), ()):
        drawn = plan(5, kinds, size=0.3, noise=0.0, duration=1.0, records=1)
        if not signals:
            bench = drawn.rig
        drawn = plan(5, kinds, rig=bench, size=0.3, noise=0.0, records=1)
        signals.append(observe(drawn, 0).signals)
    moved = np.abs(signals[0]["theta_loose_rad"] - signals[1]["theta_loose_rad"]).max()
    assert moved > 2e-3 * bench.pair().backlash / bench.pair().loose.base_radius


@pytest.fixture
def blind(tmp_path):
    made = plan(4, ("drag_viscous",), duration=0.5, records=1)
    hide(made, tmp_path / "blind")
    return made, tmp_path / "blind"


def diagnosis(path, causes, verdict="explained"):
    path.write_text(json.dumps({"verdict": verdict, "causes": causes, "remaining": {"structure": "none"}}))
    return path


def test_a_challenge_is_written_sealed_and_scored(blind, tmp_path):
    made, folder = blind
    for text in ("answer.sealed", "challenge.json", "rig.toml", "record.toml"):
        assert "viscous" not in (folder / text).read_text()
    true = made.told()["effects"][0]["coefficient"]
    value = {"value": 1.02 * true, "unit": "N m s/rad", "ci95": [0.99 * true, 1.05 * true]}
    told = reveal(
        folder, diagnosis(tmp_path / "d.json", [{"kind": "drag_viscous", "parameters": {"coefficient": value}}])
    )
    assert told["kinds_first"]
    assert told["verdict_right"]
    assert told["changed"] == []
    assert told["wrong_names"] == []
    assert told["parameters"][0]["error"] == pytest.approx(0.02)
    assert told["parameters"][0]["covered"]


def test_a_diagnosis_is_named_by_its_file_or_its_folder(blind, tmp_path):
    _, folder = blind
    kept = diagnosis(tmp_path / "diagnosis.json", [])
    assert reveal(folder, tmp_path) == reveal(folder, kept)
    for wrong in (folder, folder / "challenge.json", tmp_path / "none.json"):
        with pytest.raises(InputError) as raised:
            reveal(folder, wrong)
        assert "diagnose" in (raised.value.faults[0].remedy or ""), wrong
    with pytest.raises(InputError) as raised:
        reveal(tmp_path / "nowhere", kept)
    assert "gears3d challenge" in (raised.value.faults[0].remedy or "")


def test_records_come_in_by_the_gate(blind):
    from gears3d.measured.checks import admit

    made, folder = blind
    admitted = admit(folder / "record-1.parquet", load(folder / "rig.toml"), folder / "record.toml")
    assert admitted.rig.motion.mean == pytest.approx(float(made.conditions[0]["motion.mean"].split()[0]))


def test_a_changed_answer_is_refused(blind, tmp_path):
    _, folder = blind
    sealed = (folder / "answer.sealed").read_text()
    (folder / "answer.sealed").write_text(("A" if sealed[0] != "A" else "B") + sealed[1:])
    with pytest.raises(InputError, match="was changed"):
        reveal(folder, diagnosis(tmp_path / "d.json", []))


def test_a_wrong_name_is_counted_and_an_inseparable_one_excused():
    answer = {"effects": [{"kind": "oil_film"}], "unknown": [], "visible": True}
    alone = {"verdict": "explained", "causes": [{"kind": "restitution_speed"}]}
    assert score(answer, alone)["wrong_names"] == ["restitution_speed"]
    among = {"verdict": "explained", "causes": [{"kind": "restitution_speed", "alternatives": [{"kind": "oil_film"}]}]}
    told = score(answer, among)
    assert told["wrong_names"] == []
    assert told["set_right"]
    assert not told["kinds_first"]


def test_nothing_and_the_unknown_have_their_verdicts():
    nothing = {"effects": [], "unknown": [], "visible": True}
    assert score(nothing, {"verdict": "nothing_to_add"})["verdict_right"]
    assert not score(nothing, {"verdict": "explained", "causes": [{"kind": "oil_film"}]})["verdict_right"]
    strange = {"effects": [], "unknown": [{"name": "x", "coordinates": ["flight.gap"]}], "visible": True}
    told = score(strange, {"verdict": "unexplained", "causes": [], "remaining": {"structure": "flight.gap"}})
    assert told["verdict_right"]
    assert told["coordinate_right"]


@pytest.mark.parametrize("late", [3.5e-5, -3.5e-5, -4e-4])
def test_an_encoder_that_reads_late_reads_what_was(late):
    from gears3d.verification.challenge import happen
    from tests.verification.challenge.bench import rattle

    scenario = rattle([], "0.3 s")
    true = happen(scenario).signals
    read = happen(scenario, late=late).signals
    speed = np.diff(true["theta_loose_rad"], prepend=0.0) / np.diff(true["time_s"], prepend=-1.0)
    shift = np.median((true["theta_loose_rad"] - read["theta_loose_rad"])[100:] / speed[100:])
    assert shift == pytest.approx(late, rel=1e-3)


def test_arbitrary_zeros_move_what_is_read_and_nothing_else():
    about = {"records": 2, "duration": 1.0}
    plain, moved = (plan(10071, ("eccentricity",), zero=zero, **about) for zero in ("common", "arbitrary"))
    assert moved.told() == {**plain.told(), "zeros": [list(pair) for pair in moved.zeros]}
    for number, pair in enumerate(moved.zeros):
        a, b = (observe(one, number).signals for one in (plain, moved))
        for gear, turned in zip(("drive", "loose"), pair, strict=True):
            assert abs(turned) <= np.pi
            assert np.ptp(b[f"theta_{gear}_rad"] - a[f"theta_{gear}_rad"]) < 1e-9
            assert b[f"theta_{gear}_rad"][0] - a[f"theta_{gear}_rad"][0] == pytest.approx(turned, abs=1e-9)


def test_phases_and_teeth_are_scored_from_the_zeros_of_the_record_that_they_refer_to():
    effects = [{"kind": "transmission_error", "gear": "loose", "order": 3, "phase": 1.0},
               {"kind": "pitch_error", "gear": "drive", "tooth": 30},
               {"kind": "drag_position", "order": 1, "phase": 0.2}]  # fmt: skip
    pitch = 2.0 * np.pi / 31
    answer = {"effects": effects, "unknown": [], "visible": True, "ratio": [31, 53], "zeros": [[3.2 * pitch, 0.5]]}
    phase = {"unit": "rad", "ci95": None}
    causes = [{"kind": "transmission_error", "parameters": {"phase": {"value": -0.5, **phase}}},
              {"kind": "pitch_error", "parameters": {"tooth": 2}},
              {"kind": "drag_position", "parameters": {"phase": {"value": None, **phase}}}]  # fmt: skip
    rows = score(answer, {"verdict": "explained", "causes": causes})["parameters"]
    assert rows[0]["error"] == pytest.approx(0.0)
    assert rows[1]["right"]
    assert (rows[2]["error"], rows[2]["right"]) == (None, None)
    answer["zeros"] = [[1.0, 2.0], *answer["zeros"]]
    causes[:2] = [{**one, "phase_from": "/elsewhere/record-2.parquet"} for one in causes[:2]]
    names = ["record-1.parquet", "record-2.parquet"]
    rows = score(answer, {"verdict": "explained", "causes": causes}, names)["parameters"]
    assert rows[0]["error"] == pytest.approx(0.0)
    assert rows[1]["right"]


def test_a_sort_of_zero_that_is_not_there_is_named():
    with pytest.raises(UsageError, match="arbitrary"):
        plan(10071, (), zero="arbitary")


def test_a_tooth_that_stands_back_where_two_others_carry_moves_nothing_and_is_told_so():
    """Contact ratio and overlap come to 1.997: the tooth carries alone for 0.3 % of a pitch, sinking by nanometres."""
    for offset, visible, least, most in (("0.1 mm", False, 0.0, 1e-8), ("-0.02 mm", True, 1e-6, 1e-3)):
        error = {"kind": "pitch_error", "offset": offset, "tooth": 21, "gear": "drive", "flank": "reverse"}
        made = replace(plan(86, (), duration=4.0), effects=(error,))
        plain, odd = (observe(one, 0).signals["theta_loose_rad"] for one in (replace(made, effects=()), made))
        assert made.told()["visible"] == visible
        assert least <= np.max(np.abs(plain - odd)) * made.rig.pair().loose.base_radius <= most


@pytest.mark.parametrize("teeth", [(23, 16), (15, 15), (90, 90)])
def test_a_tooth_moves_a_flank_by_its_error_at_most(teeth):
    """Tips of few teeth turn back before they reach the next flank: no other pair carries there."""
    error = {"kind": "pitch_error", "offset": "-6 um", "tooth": 1, "gear": "loose", "flank": "reverse"}
    gears = {"gears.drive.teeth": teeth[0], "gears.loose.teeth": teeth[1], "gears.helix_angle": "0 deg"}
    rig = machine(plan(86, ()).rig.with_({**gears, "effect": [error]}))
    angles = np.linspace(0.0, 2.0 * np.pi * teeth[1], 100_000)
    for side, most in ((ACTIVE, 1e-12), (REVERSE, 6e-6 + 1e-12)):
        moved = np.array([flank(rig, side, 0.0, at, 0.0)[0] for at in angles]) - side * rig["backlash"]
        assert np.max(np.abs(moved)) <= most

"""Laws of contact beside other causes: both are named and measured, in paths that nothing was cut of."""

import numpy as np
import pytest

from gears3d.diagnosis import Candidate, begin
from gears3d.diagnosis.contact_law import (
    LAW_CHANNELS,
    contact_episodes,
    fit_episodes,
    promised_gains,
    shortlist,
    subset,
    with_further_causes,
)
from gears3d.effects import catalogue
from gears3d.measured.segmentation import path_of
from gears3d.views.pages.diagnosed import render
from tests.diagnosis.blind import cases, play
from tests.diagnosis.test_gap_laws import hidden, judged


@pytest.mark.slow
def test_a_cause_beside_a_known_law_is_found_in_uncut_paths(tmp_path):
    _, admitted = hidden(tmp_path / "c", ("oil_film", "eccentricity"), 20, records=2, duration=4.0)
    seen = []
    for one in admitted:
        assert one.rig is not None
        seen.append(contact_episodes(path_of(one.recording, one.rig, one.file), one.rig, one.file))
    few = subset([one for one in seen if one is not None], 20)
    rig = few[0].rig
    unit = catalogue()["oil_film"](viscosity=1e-3).unit_size(rig)
    law = begin(Candidate("oil_film", {}, "viscosity", unit, False, LAW_CHANNELS), np.array([0.1]))
    now, known = fit_episodes(few, [], [law], rounds=3), shortlist(rig)
    promised = promised_gains(few, now, [begin(one, np.full(1 + one.phased, 1e-6)) for one in known])
    assert known[int(np.argmax(promised))].kind in ("eccentricity", "transmission_error")
    found = with_further_causes(few, now, known)
    assert [one.candidate.kind for one in found.causes] == ["oil_film", "eccentricity"]
    assert found.cost < 0.1 * now.cost


@pytest.mark.slow
@pytest.mark.parametrize(("kinds", "seed"), [(("oil_film", "eccentricity"), 20), (("oil_film", "drag_coulomb"), 21)])
def test_a_law_and_what_stands_beside_it_are_both_named(tmp_path, kinds, seed):
    found, score = judged(tmp_path / "c", *hidden(tmp_path / "c", kinds, seed, noise=0.003))
    assert score["kinds_first"], found.to_dict()
    assert not score["wrong_names"]
    assert found.verdict == "explained"
    assert max(abs(one["error"]) for one in score["parameters"] if one["error"] is not None and one["true"]) < 0.03
    assert found.to_dict()["heldout"]["gain"] > 0.9
    assert all(f"{kind} (" in render(found) for kind in kinds)


@pytest.mark.slow
@pytest.mark.parametrize("unknown", ["cogging_speed", "bearing_defect"])
def test_no_law_is_named_for_what_is_unknown(tmp_path, unknown):
    found, score = judged(tmp_path / "c", *hidden(tmp_path / "c", (unknown,), 20, noise=0.015))
    assert not {"oil_film", "tooth_compliance", "mesh_friction"} & {one.kind for one in found.causes}
    assert not score["wrong_names"], found.to_dict()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "kinds"),
    [
        (334, {"backlash_offset", "oil_film"}),  # errors of the encoder of the drive stood for both
        (338, {"backlash_offset", "oil_film"}),  # only windows that diverge show the first
        (346, {"eccentricity", "tooth_compliance"}),  # a film of oil stood for the second
    ],
)
def test_a_law_of_contact_with_others_is_named_anywhere(seed, kinds):
    """Rigs of the whole operating space; a third cause of each is below what its records show, or nearly."""
    told = play(next(iter(cases("space3", seed, 1))))
    assert set(told["kinds_right"]) == kinds
    assert told["wrong_names"] == []

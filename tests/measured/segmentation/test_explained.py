"""What flights and contact do not explain is not reported; what they explain is."""

import json

import numpy as np
import pytest

import gears3d
from gears3d import cli
from gears3d.errors import InputError
from gears3d.identify import identify_restitution
from gears3d.measured.segmentation import NotExplained, explain, measure, path_of, segments_of
from gears3d.recording import describe, read
from gears3d.scenario import load
from tests.measured.segmentation import adversaries
from tests.measured.segmentation.truth import FIG5, cut, happened, seen

SLOW = pytest.mark.slow


@pytest.mark.parametrize("make", adversaries.ALL, ids=lambda make: make.__name__)
@pytest.mark.parametrize("noise", [2e-6, pytest.param(1e-7, marks=SLOW), pytest.param(2e-5, marks=SLOW)])
@pytest.mark.parametrize("seed", [5, *(pytest.param(seed, marks=SLOW) for seed in range(6, 10))])
def test_motion_without_free_flight_is_not_reported_as_rattle(make, noise, seed):
    record, rig = make(seed, noise), load(FIG5)
    try:
        found = measure(record, rig)
    except InputError:  # noise or counts hide the backlash: that is said, too
        return
    summary = found.summary
    assert summary["status"] == "unexplained"
    assert summary["regime"] is None
    assert summary["impacts"] is None
    assert summary["flanks"]["backlash_m"] is None
    assert not len(found.recording.impacts["time_s"])
    assert summary["warnings"][0].startswith("no impacts, regime or backlash are reported")
    json.dumps(summary)


def test_what_is_visible_is_stated_of_a_record_that_is_not_explained():
    record, rig = adversaries.planetary_stage(seed=2), load(FIG5)
    visible = measure(record, rig).summary["visible"]
    assert visible["ratio_loose_over_drive"] == pytest.approx(1.0 / 4.2, rel=1e-3)
    assert visible["ratio_of_base_radii"] == pytest.approx(1.0)
    assert visible["drive_speed_mean_rad_s"] == pytest.approx(12.0, rel=0.01)
    drive, loose = (record.signals[f"theta_{gear}_rad"] for gear in ("drive", "loose"))
    assert visible["displacement_range_m"] == pytest.approx(
        rig.rig().base_radius_loose * np.ptp(loose - drive), rel=1e-3
    )


@pytest.mark.parametrize(("restitution", "wander"), [(0.0, 0.0), (0.3, 125e-6), (0.7, 60e-6)])
def test_a_rattle_is_explained(restitution, wander):
    scenario, truth = happened(restitution, wander)
    found = explain(cut(scenario, seen(scenario, truth, 0.015, seed=61)))
    assert found.reasons == ()
    assert found.time > 0.97
    assert found.path > 0.9


@pytest.mark.slow
def test_whatever_needs_impacts_refuses_a_record_that_is_not_explained(tmp_path, capsys):
    record, rig = adversaries.compliant_gearbox(seed=3), load(FIG5)
    with pytest.raises(NotExplained, match="does not move as a gear that flies freely"):
        segments_of(path_of(record, rig), rig)
    record.write(tmp_path / "r.parquet")
    out = tmp_path / "measured"
    with pytest.raises(SystemExit) as stop:
        cli.main(["segment", str(tmp_path / "r.parquet"), "--rig", FIG5, "--out", str(out)])
    assert not stop.value.code
    said = capsys.readouterr()
    assert "warning: no impacts, regime or backlash are reported" in said.err
    assert "withheld" in said.out
    assert "are withheld" in (out / "report.html").read_text()
    written = read(out)
    for refused in (lambda: describe(written), lambda: gears3d.compare(written, written)):
        with pytest.raises(InputError, match="has no impacts"):
            refused()
    with pytest.raises(InputError, match="has no impacts"):
        identify_restitution([measure(record, rig)], rig.rig())


@pytest.mark.slow
def test_a_backlash_that_differs_between_the_halves_is_not_reported():
    scenario, truth = happened()
    record = seen(scenario, truth, 0.001, seed=62)
    late = record.time > 0.5 * record.time[-1]
    angle = record.signals["theta_loose_rad"]
    place = truth.signals["displacement_m"]
    grown = np.where(late, 0.3 * np.clip(place, 0.0, None), 0.0) / scenario.rig().base_radius_loose  # 250 to 325 um
    widened = type(record)({**record.signals, "theta_loose_rad": angle + grown})
    try:
        summary = measure(widened, scenario).summary
    except InputError:
        return
    assert summary["flanks"]["backlash_m"] is None


def test_a_flank_that_the_gear_would_lie_behind_explains_little():
    scenario, truth = happened(0.3, 0.0)
    found = cut(scenario, seen(scenario, truth, 0.001, seed=77))
    assert explain(found).time > 0.99
    raised = found.flanks._replace(active=found.flanks.active + np.eye(len(found.flanks.active))[0] * 40e-6)
    low = np.mean(found.contacts["flank"] == 0) * np.sum(found.contacts["duration_s"][found.contacts["flank"] == 0])
    none = {name: column[:0] for name, column in found.contacts.items()}
    behind = explain(found._replace(flanks=raised, contacts=none))  # as if what lies behind were impacts that last
    assert behind.time < 1.0 - 0.5 * low / (found.track.time[-1] - found.track.time[0])

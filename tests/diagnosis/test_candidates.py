"""Candidates follow from what an effect states of itself: its parameters, its rows and its unit."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from gears3d.diagnosis import causes as module
from gears3d.diagnosis.causes import FREE, MOST_DRAG, begin, candidates, moved
from gears3d.effects import Gate, Param, Refined, Rig, catalogue, torque_linear, torque_power

RIG = Rig(0.148, 0.13, 0.0695, 0.22, 250e-6, 0.3, 3.0, 9, 7, face_width=0.02)
# Kinds that are fitted without a regressor, since they change all of the motion or every impact by itself, or have no
# shapes to try.
WITHOUT = {"oil_film", "tooth_compliance", "carried_inertia", "mesh_friction", "restitution_scatter", "drag_stick_slip"}


def _kinds(rig=RIG):
    return {one.kind for one in candidates(rig, 5.0, 3, (2.0,), (1.0,))}


def test_every_effect_with_a_regressor_is_a_candidate():
    assert _kinds() == set(catalogue()) - WITHOUT
    assert _kinds(RIG.__class__(**{**RIG.__dict__, "drag_torque": 0.0})) == set(catalogue()) - WITHOUT - {"drag_drift"}


def test_shapes_are_all_gears_orders_teeth_and_flanks():
    counts = dict.fromkeys(catalogue(), 0)
    for one in candidates(RIG, 5.0, 3, (2.0,), (1.0, 4.0)):
        counts[one.kind] += 1
    assert counts["transmission_error"] == 2 * 2 * 3
    assert counts["pitch_error"] == 3 * (9 + 7)
    assert (counts["eccentricity"], counts["encoder_eccentricity"], counts["drag_position"]) == (2, 6, 3)
    assert (counts["encoder_skew"], counts["drive_motion"], counts["drag_coulomb"]) == (1, 3, 1)


def test_tried_times_are_durations_and_tried_speeds_are_mean_speeds():
    found = candidates(RIG, 5.0, 0)
    assert [one.shape["time_constant"] for one in found if one.kind == "drag_drift"] == [0.15, 0.5, 1.5, 5.0, 15.0]
    speeds = [one.shape["shaft_speed"] for one in found if one.kind == "drag_differential"]
    assert speeds == pytest.approx(np.array([-1.0, 0.5, 2.0]) * 3.0 * 0.148 / 0.13)


@pytest.mark.parametrize(
    ("kind", "gear", "channels"),
    [("drag_viscous", None, ("flight",)), ("mesh_drag", None, ("loss",)), ("pitch_error", "drive", ("contact",)),
     ("restitution_speed", None, ("impact",)), ("encoder_eccentricity", "drive", ("contact", "drive")),
     ("encoder_eccentricity", "loose", ("contact", "flight")), ("encoder_skew", "loose", ("contact",))],
)  # fmt: skip
def test_channels_follow_from_place_and_rows(kind, gear, channels):
    own = [one for one in candidates(RIG, 5.0, 2) if one.kind == kind and one.shape.get("gear") == gear]
    assert own
    assert {one.channels for one in own} == {channels}


def test_an_effect_of_known_rows_is_a_candidate_without_further_code(monkeypatch):
    @dataclass(frozen=True)
    class Stated:
        torque: float
        exponent: float
        kind: ClassVar = "stated"
        place: ClassVar = "torque"
        params: ClassVar = {
            "torque": Param("torque", 0.0, 1.0),
            "exponent": Param("ratio", 0.0, 3.0, linear=False, tried=(1.25, 1.75), refined=Refined(1.0, 2.0)),
        }

        def rows(self, rig):
            return [torque_power(self.torque, self.exponent), torque_linear(self.torque, gate=Gate.FLIGHT)]

        def unit_size(self, rig):
            return rig.drag_torque

    monkeypatch.setattr(module, "built_in", lambda: {"stated": Stated})
    found = candidates(RIG, 5.0, 2)
    assert [(one.kind, one.shape, one.size, one.unit, one.channels) for one in found] == [
        ("stated", {"exponent": value}, "torque", 0.22, ("flight",)) for value in (1.25, 1.75)
    ]


def test_shapes_that_are_refined_are_those_of_the_effects():
    assert FREE["drag_power"]["exponent"] == Refined(0.2, 4.0)
    assert FREE["mesh_drag"] == {}
    assert "transmission_error" not in FREE


def test_some_of_the_dry_drag_is_left():
    """Without drag a gear flies as its starts have it, and any law of contact that lets it float fits, too."""
    drag = next(one for one in candidates(RIG, 5.0, 3) if one.kind == "drag_coulomb")
    assert drag.unit == RIG.drag_torque
    half = begin(drag, np.array([-0.5]))
    assert half.possible
    (gone,) = moved([half], np.array([-0.6 * drag.unit]), 1.0)
    assert gone.numbers[0] == -MOST_DRAG * drag.unit
    assert not gone.possible

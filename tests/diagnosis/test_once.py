"""A torque whose shape is fitted is a cause once: what it leaves, another of its kind only patches."""

import numpy as np
import pytest

from gears3d.diagnosis import Candidate, begin
from gears3d.diagnosis.causes import ONCE, Scored, acceptable

SHAPES = {"drag_power": ("coefficient", "exponent", 2.0), "drag_drift": ("relative_change", "time_constant", 3.0),
          "drag_differential": ("coefficient", "shaft_speed", 10.0)}  # fmt: skip
MORE = {"drive": 0.0, "loose": 0.0, "": 0.0}


def torque(kind, times=1.0):
    """Return a candidate whose shape's own number is some times its usual one."""
    size, free, value = SHAPES.get(kind, ("torque", None, 0.0))
    return Candidate(kind, {free: times * value} if free else {}, size, 1.0, False, ("flight",))


@pytest.mark.parametrize("kind", ONCE)
def test_no_torque_with_a_shape_is_taken_twice(kind):
    causes = [begin(torque(kind), np.array([0.3]))]
    left = [Scored(torque(each, 2.0), 1000.0, np.array([0.2]), np.array([1e-3])) for each in (*ONCE, "drag_coulomb")]
    assert {one.candidate.kind for one in acceptable(left, MORE, causes)} == {*ONCE, "drag_coulomb"} - {kind}
    assert {one.candidate.kind for one in acceptable(left, MORE)} == {*ONCE, "drag_coulomb"}

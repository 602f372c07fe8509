"""Causes in records of a simulator that shares no equation with the models, over the operating space."""

import numpy as np
import pytest

from gears3d.diagnosis import diagnose
from gears3d.verification.challenge.space import draw
from tests.diagnosis.other_simulator import KINDS, cause_of, write

RIGS = 64


def case(index, seed, kind=None):
    """A rig of the space, and what it hides: nothing in one of seven, else one cause."""
    rig, random = draw(RIGS, seed)[index], np.random.default_rng([seed, index, 777])
    if kind is None:
        kind = "" if random.uniform() < 1.0 / 7.0 else str(random.choice(KINDS))
    return rig, [cause_of(rig, kind, random)] if kind else []


PLACES = (
    ("drag_coulomb", "drag_viscous"), ("restitution_offset", "restitution_scatter"), ("backlash_offset",),
    ("eccentricity",), ("transmission_error",), ("encoder_eccentricity", "encoder_skew"),
)  # fmt: skip


def several(index, seed, count):
    """A rig of the space with causes from different places."""
    rig, random = draw(RIGS, seed)[index], np.random.default_rng([seed, index, 888, count])
    places = sorted(random.choice(len(PLACES), count, replace=False))
    return rig, [cause_of(rig, str(random.choice(PLACES[k])), random) for k in places]


def found(rig, hidden, folder):
    """The diagnosis, and the sets of names that do not contain what is hidden."""
    told = diagnose(write(rig, hidden, folder), rig.scenario())
    kinds = {one.kind for one in hidden}
    sets = [{one.kind, *(str(other["kind"]) for other in one.alternatives)} for one in told.causes]
    return told, [own for own in sets if not own & kinds]


FOUND = [
    (25, "restitution_offset"),
    (60, "drag_coulomb"),
    (60, "drag_viscous"),
    (60, "backlash_offset"),
    (21, "restitution_offset"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("index", "kind"), FOUND)
def test_a_cause_is_found_with_its_size(index, kind, tmp_path):
    rig, hidden = case(index, 2, kind)
    told, wrong = found(rig, hidden, tmp_path)
    assert ([one.kind for one in told.causes], wrong) == ([kind], [])
    size = next(iter(told.causes[0].parameters.values()))
    assert abs(size.value - hidden[0].size) < size.high - size.low
    assert size.high - size.low < 0.05 * abs(size.value)


@pytest.mark.slow
@pytest.mark.parametrize("index", range(24))
def test_no_cause_is_invented_over_the_operating_space(index, tmp_path):
    rig, hidden = case(index, 5)
    told, wrong = found(rig, hidden, tmp_path)
    assert wrong == [], (rig, hidden, told)


@pytest.mark.slow
@pytest.mark.parametrize("index", range(9))
def test_no_cause_is_invented_among_three(index, tmp_path):
    rig, hidden = several(index, 7, 3)
    told, wrong = found(rig, hidden, tmp_path)
    assert wrong == [], (rig, hidden, told)

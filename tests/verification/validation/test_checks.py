"""Every check that `gears3d validate` prints holds, and the table can say that one does not."""

import json
import math

import numpy as np
import pytest

from gears3d.errors import UsageError
from gears3d.verification.validation import CHAPTERS, Check, chapters


def test_a_check_holds_only_within_its_bound():
    assert Check("x", 1.0, 1.0).holds
    assert not Check("x", 1.1, 1.0).holds
    assert Check("x", 2.0, 1.0, at_least=True).holds
    assert not Check("x", 0.9, 1.0, at_least=True).holds
    assert not Check("x", math.nan, 1.0).holds
    assert not Check("x", math.nan, 1.0, at_least=True).holds
    assert json.dumps(Check("x", np.float64(1.0), 1.0).holds) == "true"


def test_an_unknown_chapter_is_refused_with_a_hint():
    with pytest.raises(UsageError, match="did you mean 'solids'"):
        next(iter(chapters(only="solid")))


ELSEWHERE = ("agreement", "convergence", "effects", "ste", "threshold")
"""Chapters whose cases tests/engine, tests/gears, tests/effects and tests/bench have by default, and more."""


@pytest.mark.parametrize(
    ("chapter", "quick"),
    [pytest.param(name, True, marks=pytest.mark.slow if name in ELSEWHERE else ()) for name in CHAPTERS]
    + [pytest.param(name, False, marks=pytest.mark.slow) for name in ("eccentric", "effects", "helical", "native")],
)
def test_every_check_of_a_chapter_holds(chapter, quick):
    ((_, checks),) = chapters(quick=quick, only=chapter)
    measured = list(checks())
    assert measured
    assert [f"{c.name}: {c.value:.4g}, bound {c.bound:.4g}" for c in measured if not c.holds] == []

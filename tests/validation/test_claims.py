"""Every claim that `gears3d validate` prints holds, and the table can say that one does not."""

import math

import pytest

from gears3d.errors import UsageError
from gears3d.validation import Claim, chapters
from gears3d.validation.agreement import MEAN_SPEEDS, RESTITUTIONS, against_twin, claims_of
from gears3d.validation.claim import CHAPTERS


def test_a_claim_holds_only_within_its_bound():
    assert Claim("x", 1.0, 1.0).holds
    assert not Claim("x", 1.1, 1.0).holds
    assert Claim("x", 2.0, 1.0, at_least=True).holds
    assert not Claim("x", 0.9, 1.0, at_least=True).holds
    assert not Claim("x", math.nan, 1.0).holds
    assert not Claim("x", math.nan, 1.0, at_least=True).holds


def test_an_unknown_chapter_is_refused_with_a_hint():
    with pytest.raises(UsageError, match="did you mean 'solids'"):
        next(iter(chapters(only="solid")))


@pytest.mark.parametrize("chapter", [name for name in CHAPTERS if name != "agreement"])
def test_every_claim_of_a_chapter_holds(chapter):
    ((_, claims),) = chapters(only=chapter)
    measured = list(claims())
    assert measured
    assert [f"{c.name}: {c.value:.4g}, bound {c.bound:.4g}" for c in measured if not c.holds] == []


@pytest.mark.parametrize("mean", MEAN_SPEEDS)
@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_located_engine_agrees_with_the_twin(restitution, mean):
    measured = list(claims_of(against_twin(restitution, mean), ""))
    assert [f"{c.name}: {c.value:.4g}, bound {c.bound:.4g}" for c in measured if not c.holds] == []

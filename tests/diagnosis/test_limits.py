"""About the limit of detection: silent or hedged below it, right above it, and the null twin of each seed silent.

Each place hides one kind; records are few and short, so that a test takes seconds. One more seed is drawn anew in each
run and told in what fails, so that it can be had again.
"""

import os
from functools import cache

import pytest

from tests.diagnosis.blind import FINE, Case, play

LIMIT = 0.01
"""Share of the unit size from which on a cause is accepted: what is smaller may be the cutting's own."""
SHORT = (("records", 3), ("duration", 6.0), ("noise", FINE))
PLACES = {
    "geometry": "eccentricity",
    "torque": "drag_coulomb",
    "impact": "restitution_offset",
    "sensor": "encoder_eccentricity",
    "motion": "drive_motion",
}
"""The kind that stands for each place."""
TWO = ("backlash_offset", "drag_viscous")
SEED = 31
FRESH = int.from_bytes(os.urandom(3), "big")


@cache
def told(hidden: tuple[str, ...], size: float = 0.0, seed: int = SEED) -> dict:
    """Return what a diagnosis made of a challenge."""
    options = (*SHORT, ("size", size)) if size else SHORT
    return play(Case("kinds", seed, hidden, options))


@pytest.mark.parametrize("kind", PLACES.values(), ids=PLACES)
def test_half_the_limit_is_no_confident_claim_of_another_cause(kind):
    row = told((kind,), 0.5 * LIMIT)
    assert not row["wrong_names"], row


@pytest.mark.parametrize("kind", PLACES.values(), ids=PLACES)
def test_at_twice_the_limit_the_cause_is_named_with_its_size(kind):
    row = told((kind,), 2.0 * LIMIT)
    assert row["kinds_first"], row
    assert not row["wrong_names"], row
    sizes = [one["error"] for one in row["parameters"] if one["name"] != "phase" and one["error"] is not None]
    assert sizes, row
    assert max(map(abs, sizes)) < 0.1, row


@pytest.mark.slow
@pytest.mark.parametrize("kind", PLACES.values(), ids=PLACES)
def test_at_the_limit_the_cause_is_named_or_nothing_is(kind):
    row = told((kind,), LIMIT)
    assert row["kinds_first"] or not row["causes"], row


def test_the_null_twin_is_silent():
    row = told(())
    assert not row["causes"], row
    assert row["verdict"] == "nothing_to_add", row


def test_two_at_once_are_both_named_at_twice_the_limit():
    row = told(TWO, 2.0 * LIMIT)
    assert {one["kind"] for one in row["causes"]} == set(TWO), row


def test_what_no_catalogue_has_is_no_confident_cause():
    row = told(("bearing_defect",), 0.3)
    assert row["verdict"] in ("unexplained", "partly_explained"), row
    assert row["coordinate_right"], row


def test_one_path_that_is_no_flight_bends_no_fit():
    """One of 105 paths of a record touches a flank unseen and stands 193 standard deviations off its own parabola."""
    row = told(("drag_viscous",), 0.2, 14051226)
    assert row["kinds_first"], row
    assert row["verdict"] == "explained", row


@pytest.mark.parametrize("kind", [None, "drag_viscous"], ids=["nothing", "drag_viscous"])
def test_a_fresh_seed(kind):
    row = told((kind,), 0.2, FRESH) if kind else told((), seed=FRESH)
    if kind:
        assert row["set_right"], f"seed {FRESH}: {row}"
    else:
        assert not row["causes"], f"seed {FRESH}: {row}"

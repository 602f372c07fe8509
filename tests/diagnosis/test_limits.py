"""About the limit of detection: silent or hedged below it, right above it, and the null twin of each seed silent.

Each place hides one kind; records are few and short, so that a test takes seconds. Among the slow tests, one more seed
is drawn anew in each run and told in what fails, so that it can be had again.
"""

import os
from functools import cache

import pytest

from tests.diagnosis.blind import FINE, Case, play

pytestmark = pytest.mark.usefixtures("low_orders")
LIMIT = 0.01
"""Share of the unit size from which on a cause is accepted: what is smaller may be the cutting's own."""
SHORT = (("records", 2), ("duration", 2.0), ("noise", FINE))
THREE, LONG = ((("records", 3), ("duration", duration), ("noise", FINE)) for duration in (2.0, 6.0))
"""Two speeds do not tell two causes of these sizes apart."""
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
def told(hidden: tuple[str, ...], size: float = 0.0, seed: int = SEED, records=SHORT) -> dict:
    """Return what a diagnosis made of a challenge."""
    return play(Case("kinds", seed, hidden, (*records, ("size", size)) if size else records))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "records"),
    [pytest.param(kind, THREE if place == "torque" else LONG, id=place) for place, kind in PLACES.items()],
)
def test_half_the_limit_is_no_confident_claim_of_another_cause(kind, records):
    row = told((kind,), 0.5 * LIMIT, records=records)
    assert not row["wrong_names"], row


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, id=place, marks=pytest.mark.slow if place in ("sensor", "torque") else ())
        for place, kind in PLACES.items()
    ],
)
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
    row = told((kind,), LIMIT, records=LONG)
    assert row["kinds_first"] or not row["causes"], row


def test_the_null_twin_is_silent():
    row = told(())
    assert not row["causes"], row
    assert row["verdict"] == "nothing_to_add", row


@pytest.mark.slow
def test_two_at_once_are_both_named_at_twice_the_limit():
    row = told(TWO, 2.0 * LIMIT, records=THREE)
    assert {one["kind"] for one in row["causes"]} == set(TWO), row


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "records"),
    [("cogging_speed", SHORT), ("bearing_defect", LONG)],
)
def test_what_no_catalogue_has_is_no_confident_cause(kind, records):
    row = told((kind,), 0.3, records=records)
    assert row["verdict"] in ("unexplained", "partly_explained"), row
    assert row["coordinate_right"], row


@pytest.mark.slow
def test_one_path_that_is_no_flight_bends_no_fit():
    """One of 105 paths of a record touches a flank unseen and stands 193 standard deviations off its own parabola."""
    row = told(("drag_viscous",), 0.2, 14051226, LONG)
    assert row["kinds_first"], row
    assert row["verdict"] == "explained", row


@pytest.mark.slow
@pytest.mark.parametrize("kind", [None, "drag_viscous"], ids=["nothing", "drag_viscous"])
def test_a_fresh_seed(kind):
    row = told((kind,) if kind else (), 0.2 if kind else 0.0, FRESH, LONG)
    if kind:
        assert row["set_right"], f"seed {FRESH}: {row}"
    else:
        assert not row["causes"], f"seed {FRESH}: {row}"

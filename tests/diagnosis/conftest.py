"""What quick tests of whole diagnoses share."""

import pytest

from tests.diagnosis import asked


@pytest.fixture
def low_orders(request, monkeypatch):
    """Look for orders 1 and 2 alone, of all kinds but single teeth; slow tests look for all that there is."""
    if request.node.get_closest_marker("slow") is None:
        asked.only(monkeypatch, lambda one: one.shape.get("order", 1) <= 2 and one.kind != "pitch_error")

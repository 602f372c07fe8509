"""A few kills of every test run; ``tools/fuzz kills`` has no end."""

from itertools import islice

import pytest

from tests.fuzz import kills


@pytest.mark.slow
@pytest.mark.parametrize("verbs", [("run",), ("sweep",), tuple(kills.VERBS)])
def test_what_is_finished_is_whole_and_the_same_command_goes_on(verbs):
    if not hasattr(kills.os, "fork"):
        pytest.skip("needs the signals of POSIX")
    tries = 2 if len(verbs) == 1 else 24
    *_, tally = islice(kills.run(seed=20261123, verbs=verbs), tries)
    assert tally.tried == tries
    assert not tally.faults, str(tally)

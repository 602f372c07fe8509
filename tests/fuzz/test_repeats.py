"""The same command gives the same bits."""

from itertools import islice

import pytest

from tests.fuzz import repeats


@pytest.mark.slow
def test_runs_and_sweeps_are_the_same_bits_however_they_are_made():
    *_, tally = islice(repeats.run(seed=5), 10)
    assert tally.tried == 10
    assert not tally.faults, str(tally)

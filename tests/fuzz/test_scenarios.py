"""A short part of the mutated scenarios; ``tools/fuzz scenarios`` goes on."""

from tests.fuzz.scenarios import run

COUNT, SEED = 250, 20_260


def test_mutated_scenarios_load_or_are_refused_and_keep_their_meaning():
    for tally in run(SEED):
        if tally.tried >= COUNT or tally.faults:
            break
    assert not tally.faults, str(tally)
    assert tally.counts["accepted"] > 0.1 * tally.tried
    assert tally.counts["refused"] > 0.1 * tally.tried

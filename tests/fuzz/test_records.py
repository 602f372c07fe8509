"""A short part of the mutated records; ``tools/fuzz records`` goes on."""

from tests.fuzz.records import run

COUNT, SEED = 250, 20_260


def test_mutated_records_are_read_or_refused_and_keep_their_meaning():
    for tally in run(SEED):
        if tally.tried >= COUNT or tally.faults:
            break
    assert not tally.faults, str(tally)
    assert tally.counts["same"] > 0.05 * tally.tried
    assert tally.counts["refused"] > 0.1 * tally.tried

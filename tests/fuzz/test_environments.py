"""Some verbs in some odd environments; ``tools/fuzz environments`` tries all of them."""

from itertools import islice

import pytest

from tests.fuzz import environments

SOME = ["no home", "no kernel cache", "C locale, ASCII, no colour", "all streams closed", "full errors", "full disk",
        "a name that is no text"]  # fmt: skip


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return environments.Bench(tmp_path_factory.mktemp("bench"))


@pytest.mark.slow
@pytest.mark.parametrize("name", SOME)
def test_a_run_in_an_odd_environment_is_whole_or_refused(bench, name):
    odd = environments.ODD[name]
    if not environments.can_unshare(odd.needs):
        pytest.skip("needs a name space of its own")
    assert bench.attempt("run", odd) == ""


def test_a_full_disk_under_a_dataset_is_an_error_and_no_crash(bench):
    assert bench.attempt("sweep", environments.ODD["files of 20 kB"]) == ""


@pytest.mark.slow
def test_every_verb_in_every_environment():
    *_, tally = islice(environments.run(seed=5), len(environments.VERBS) * len(environments.ODD) + 1)
    assert not tally.faults, str(tally)

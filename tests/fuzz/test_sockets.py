"""No command can be reached from another machine."""

from itertools import islice

import pytest

from tests.fuzz import sockets


@pytest.mark.slow
def test_every_socket_is_on_loopback():
    *_, tally = islice(sockets.run(seed=1), len(sockets.SERVERS))
    assert tally.tried == len(sockets.SERVERS)
    assert not tally.faults, str(tally)


@pytest.mark.slow
def test_the_page_of_a_replay_is_on_loopback():
    *_, tally = islice(sockets.run(seed=1, names=("replay --web",)), 1)
    assert not tally.faults, str(tally)


@pytest.mark.slow
def test_a_socket_that_is_open_to_others_is_found(monkeypatch):
    monkeypatch.setitem(sockets.SERVERS, "open", ("-m", "http.server", "--bind", "0.0.0.0", "0"))
    monkeypatch.setattr(sockets, "LOOK_S", 3.0)
    *_, tally = islice(sockets.run(seed=1, names=("open",)), 1)
    assert "open to others" in str(tally)

"""Options and helpers that all tests share."""

import signal

import pytest
from hypothesis import settings

from gears3d.errors import MissingExtraError
from gears3d.extras import missing

settings.register_profile("no deadline", deadline=None)  # an example's wall time is that of a loaded machine
settings.load_profile("no deadline")
collect_ignore_glob = ["plugins/example_*"]  # packages of others: importing them registers their effects


def pytest_configure(config):
    """Let Ctrl-C interrupt: shells start background processes with it ignored, which child processes inherit."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="run the tests marked slow too")


def pytest_collection_modifyitems(config, items):
    if config.getoption("--slow"):
        return
    skip = pytest.mark.skip(reason="slow: run with --slow")
    for item in items:
        if "slow" in item.keywords:
            item.add_marker(skip)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item):
    """Skip what needs an extra that is not installed here; where it is, its absence is a failure."""
    try:
        return (yield)
    except MissingExtraError as error:
        if missing(error.extra):
            pytest.skip(str(error))
        raise

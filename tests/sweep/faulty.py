"""Blocks that misbehave at one point, each in its own way; a file beside the plan's says how often they did."""

import os
import signal
import time
from pathlib import Path

from gears3d.sweep import compute

POINT = 5


def _again(plan):
    mark = Path(plan.path).parent / "misbehaved"
    before = mark.read_text() if mark.exists() else ""
    mark.write_text(before + ".")
    return bool(before)


def killed_once(plan, begin, end, watch=None, skip=None):
    if begin <= POINT < end and not _again(plan):
        watch.start(POINT, POINT - begin)
        os.kill(os.getpid(), signal.SIGKILL)
    return compute(plan, begin, end, watch, skip)


def killed_always(plan, begin, end, watch=None, skip=None):
    if begin <= POINT < end and POINT not in skip:
        watch.start(POINT, POINT - begin)
        os.kill(os.getpid(), signal.SIGKILL)
    return compute(plan, begin, end, watch, skip)


def hangs(plan, begin, end, watch=None, skip=None):
    if begin <= POINT < end and POINT not in skip:
        watch.start(POINT, POINT - begin)
        time.sleep(1000.0)
    return compute(plan, begin, end, watch, skip)


def fails(plan, begin, end, watch=None, skip=None):
    raise ValueError("a mistake of ours")

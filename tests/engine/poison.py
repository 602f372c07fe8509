"""A torque that turns into no number after some time."""

import math
import sys

from gears3d.effects.rows import torque_relax
from gears3d.engine import run


def poison(monkeypatch, after):
    """Let the torque on the loose gear be lost in every run; until then not a bit changes.

    Args:
        monkeypatch: pytest's own.
        after: time until which it is honest, amid a flight: contact would be cut there [s].
    """
    honest = run.torque_table
    lost = torque_relax(0.0, -after / math.log(sys.float_info.max))  # 0 times a number, then 0 times infinity
    monkeypatch.setattr(run, "torque_table", lambda rows: honest([*rows, lost]))

"""Slow turns forth and back: the rig test in contact with the active flanks, then with the reverse ones."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import floor, inf, pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.errors import Fault, InputError
from gears3d.lumped import layout
from gears3d.lumped.model import model
from gears3d.lumped.rigid import SIGNALS, flanks_of
from gears3d.lumped.run import Outcome, run
from gears3d.lumped.tables import Table
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.scenario import Scenario

LEAD = 0.05  # additional turns of the drive, in which the gears change flanks
TURNING = 0.01  # time in which the drive changes its direction, in turns
LOST = 0.01  # largest part of the turns that may pass without contact


def slow_turns(
    scenario: Scenario,
    speed: float,
    turns: float,
    rate: float,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Drive slowly forth on the active flanks and back on the reverse ones, with drag as the load of the loose gear.

    The scenario's mean speed, harmonics and record are not used. The sign of ``speed`` [rad/s] is that of the first
    half; ``turns`` of the drive count each way; ``rate`` [Hz] is that of the samples; ``progress`` gets the simulated
    time [s]. The drive begins and ends at 0. A speed or turns not above 0, or a long loss of contact, is an InputError.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2.

    >>> from gears3d.scenario import load
    >>> made = slow_turns(load("scenarios/base/rigaud-2020.toml"), 0.1, 1.0, 100.0)
    >>> made.signals["displacement_m"][[100, -100]].round(6).tolist()
    [0.0, 0.00025]
    """
    if not (speed > 0.0 and turns > 0.0):
        raise InputError(Fault("--speed" if speed <= 0.0 else "--turns", "is not above 0", "give a positive number"))
    rows = [row for row in scenario.rows() if row.code != Code.MOTION_HARMONIC]
    way, turning = 2.0 * pi * (turns + LEAD), 2.0 * pi * TURNING / speed
    flanks = flanks_of(scenario, rows, (0.0, way + speed * turning))
    split = floor((way / speed - turning) * rate) / rate
    halves, contacts = [], []
    for begin, end in ((0.0, split), (split, 2.0 * way / speed + turning)):
        path = there_and_back(speed, way, turning, begin)
        outcome = _rolled(scenario, rows, flanks, path, end - begin, rate, progress and _later(progress, begin))
        halves.append(outcome.samples + np.eye(1, len(SIGNALS))[0] * begin)
        contacts.append(outcome.contacts + np.array([0.0, begin, begin]))
        if outcome.interrupted:
            break
    else:
        _refuse_parted(np.concatenate(contacts), way / speed, turning, 2.0 * pi * turns / speed)
    samples = np.concatenate([halves[0][: round(split * rate)], *halves[1:]])
    signals: dict[str, np.ndarray] = dict(zip(SIGNALS, samples.T.copy(), strict=True))
    return Recording(signals, meta={"model": "slow_turns", "interrupted": outcome.interrupted})


def _rolled(
    scenario: Scenario,
    rows: Sequence[Row],
    flanks: tuple[Table, Table] | None,
    path: Table,
    duration: float,
    rate: float,
    progress: Callable[[float], None] | None,
) -> Outcome:
    """Run from contact with the active flank; the change of direction is early, where times are well resolved."""
    rig = replace(scenario.rig(), mean_speed=float(abs(path.pieces[:, 2]).max()))
    packed = model(rig, [], rows, scenario.impact.stick_velocity, scenario.run.seed, flanks, path)
    return run(packed, duration, 1.0 / rate, "active", progress, chunk=duration / 50.0)


def _later(progress: Callable[[float], None], begin: float) -> Callable[[float], None]:
    return lambda done: progress(begin + done)


def there_and_back(speed: float, way: float, turning: float, begin: float = 0.0) -> Table:
    """Return the drive's angle [rad] over time: at constant ``speed`` [rad/s], a smooth change of direction, and back.

    The change comes at the angle ``way`` [rad] and takes ``turning`` [s]; the path starts at the time ``begin`` [s].

    >>> path = there_and_back(2.0, 10.0, 1.0)
    >>> path([0.0, 5.0, 6.0, 11.0]).tolist()
    [0.0, 10.0, 10.0, 0.0]
    """
    forth = way / speed - begin
    pieces = [
        [forth, way, speed, 0.0, 0.0, 0.0],
        [forth, way, speed, 0.0, -2.0 * speed / turning**2, speed / turning**3],
        [forth + turning, way, -speed, 0.0, 0.0, 0.0],
    ]
    return Table(layout.TIME_TABLE, np.array([-inf, forth, forth + turning, inf]), np.array(pieces))


def _refuse_parted(contacts: np.ndarray, forth: float, turning: float, whole: float) -> None:
    """Refuse a loose gear without a torque that keeps it on its flank."""
    for flank, begin, name in ((0, 0.0, "active"), (1, 2.0 * forth + turning - whole, "reverse")):
        own = contacts[contacts[:, 0] == flank, 1:]
        touching = np.clip(np.minimum(own[:, 1], begin + whole) - np.maximum(own[:, 0], begin), 0.0, None).sum()
        if touching < (1.0 - LOST) * whole:
            what = f"leaves the loose gear off its {name} flank for {1.0 - touching / whole:.0%} of the turns"
            raise InputError(Fault("drag", what, "give drag, or less --speed: only drag holds the gear on the flank"))

"""Tests of a rig by the twin: coast-down of one gear or both, and slow turns forth and back in contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import floor, inf, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.effects import Code, Gate, Rig, Row
from gears3d.effects.rows import torque_linear
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

LONGEST = 3600.0  # after this time a gear that still turns is taken not to stop [s]
AFTER = 0.02  # length of the record after the gear has stopped, as a part of the coast-down
LEAD = 0.05  # additional turns of the drive, in which the gears change flanks
TURNING = 0.01  # time in which the drive changes its direction, in turns
LOST = 0.01  # largest part of the turns that may pass without contact


class DriveDrag(NamedTuple):
    """Drag on the drive's own shaft when it is not driven; no scenario has it, as its motion is imposed there.

    Args:
        torque: dry [N·m].
        coefficient: viscous [N·m·s/rad].
    """

    torque: float = 0.0
    coefficient: float = 0.0


def rundown(
    scenario: Scenario,
    speed: float | None = None,
    duration: float | None = None,
    progress: Callable[[float], None] | None = None,
    *,
    turning: str = "loose",
    drive_drag: DriveDrag | None = None,
) -> Recording:
    """Simulate the coast-down of the loose gear, the drive, or both in mesh under their drag, effects included.

    ``speed`` [rad/s] at the start is that of the gear whose angle counts, the loose one of both; by default the one
    that the drive's mean speed gives. ``duration`` [s] is by default until rest. ``progress`` gets the simulated
    time [s]; ``turning`` is ``"loose"``, ``"drive"`` or ``"both"``; ``drive_drag`` acts on the drive's own shaft. Out
    of mesh the gates of flight apply and flanks are not used; in mesh the gates of contact apply, on perfect flanks
    that stay in contact. A gear that is not involved is at rest in the recording, which has the sample rate of the
    sensors. No speed, no inertia of the drive, friction in the mesh or no resisting torque is an InputError.

    Source: Kadmiri et al. 2012, eqs (4)-(7); Ottewill et al. 2010, section 4.1 and eqs (14)-(16).

    >>> from gears3d.scenario import load
    >>> record = rundown(load("scenarios/rigaud-2020/fig5-20rpm.toml"), speed=3.0)
    >>> round(float(record.time[np.flatnonzero(record.signals["omega_loose_rad_s"] == 0.0)[0]]), 3)  # J·ω/T
    0.948
    """
    rig, torques = _coasting(scenario, turning, drive_drag or DriveDrag())
    ratio = rig.base_radius_drive / rig.base_radius_loose
    if speed is None:
        speed = scenario.motion.mean * (1.0 if turning == "drive" else ratio)
    if speed == 0.0:
        raise InputError(Fault("motion.mean", "is 0: nothing runs down", "give the speed that the gear starts with"))
    no_mate = 4.0 * rig.base_radius_loose * abs(speed) * LONGEST  # a backlash wider than any possible displacement
    packed = model(replace(rig, backlash=no_mate, mean_speed=speed / ratio), [], torques)
    spacing = 1.0 / scenario.sensors.sample_rate
    end = duration or _standstill(packed, rig.drag_torque and rig.inertia * abs(speed) / rig.drag_torque)
    outcome = run(packed, end, spacing, "free", progress)
    time, _, theta, _, omega, _, _ = outcome.samples.T.copy()
    theta, still = theta - theta[0], np.zeros_like(time)
    loose, drive = {"loose": (1.0, 0.0), "drive": (0.0, 1.0), "both": (1.0, 1.0 / ratio)}[turning]
    signals = {
        "time_s": time,
        "theta_drive_rad": drive * theta if drive else still,
        "theta_loose_rad": loose * theta if loose else still,
        "omega_drive_rad_s": drive * omega if drive else still,
        "omega_loose_rad_s": loose * omega if loose else still,
    }
    return Recording(signals, meta={"model": "rundown", "interrupted": outcome.interrupted})


def _coasting(scenario: Scenario, turning: str, own: DriveDrag) -> tuple[Rig, list[Row]]:
    """Return the inertia that coasts down and its torques, at the speed of the gear whose angle counts."""
    rig = scenario.rig()
    torques = [row for row in scenario.rows() if row.code // 100 == 1]
    if turning == "loose":
        return rig, [row for row in torques if row.code != Code.TORQUE_FRICTION]
    inertia = scenario.gears.drive.inertia
    if inertia is None:
        remedy = "give the inertia of the drive and of all that turns with it when it coasts"
        raise InputError(Fault("gears.drive.inertia", "is missing", remedy))
    if turning == "drive":
        return replace(rig, inertia=inertia, drag_torque=own.torque), [torque_linear(own.coefficient)]
    if any(row.code == Code.TORQUE_FRICTION for row in torques):
        remedy = "take the effect mesh_friction out, or use mesh_drag"
        raise InputError(Fault("effect", "friction in the mesh is not in run-downs of both gears", remedy))
    n = rig.base_radius_loose / rig.base_radius_drive
    closed = [row._replace(gate=Gate.ALWAYS) for row in torques if row.gate in (Gate.ALWAYS, Gate.CONTACT)]
    both = replace(rig, inertia=rig.inertia + n**2 * inertia, drag_torque=rig.drag_torque + n * own.torque)
    return both, [*closed, torque_linear(n**2 * own.coefficient)]


def _standstill(packed, guess: float) -> float:
    """Return when the gear has come to rest, and a short time later [s]."""
    end = max(guess, 0.1)
    while end <= LONGEST:
        samples = run(packed, end, end / 1000.0, "free").samples
        resting = np.flatnonzero(samples[:, 4] == 0.0)
        if resting.size:
            return float(samples[resting[0], 0]) * (1.0 + AFTER)
        end *= 2.0
    remedy = "give drag.torque"
    raise InputError(Fault("drag", f"does not stop the loose gear within {LONGEST:.0f} s", remedy))


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

"""Static transmission error: the drive turns slowly, the loose gear rests on one flank, then on the other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, gcd, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects.rows import Code
from gears3d.engine import simulate
from gears3d.engine.motion import there_and_back
from gears3d.errors import Fault, InputError
from gears3d.laws import strongest_orders
from gears3d.results import Result
from gears3d.scenario.models import Motion, Start
from gears3d.simulation.models import refuse_unseen
from gears3d.simulation.recorder import PER_TURN, SLOW
from gears3d.simulation.sensors import encode, observe

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

LEAD = 0.05  # Turns driven beyond those asked for at either end, in which the gears change flanks
TURNING = 0.02  # Turns in whose time the drive changes its direction
LOST = 0.01  # Part of the turns asked for that may go by without contact
FEWEST, MOST = 2, 60  # Turns unless given: at least and at most, in whole hunting cycles where there are that many
STEP = 0.2  # Longest step of the engine at 1 rpm [s]; tooth pitches and waves of the flanks make it shorter
POINTS = 3600  # Points per revolution of the curves
ORDERS = 12  # Strongest orders that are reported of each curve


def refuse_oil(scenario: Scenario, asks: str) -> None:
    """Refuse oil between the flanks, for a test that has to touch them.

    >>> from gears3d.scenario import load
    >>> refuse_oil(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "contact of the flanks")
    """
    file = "" if scenario.path is None else str(scenario.path)
    for index, effect in enumerate(scenario.effects):
        if any(row.code == Code.GAP_FILM for row in effect.rows(scenario.rig())):
            text = f"{effect.kind!r} keeps the flanks apart; this test asks for {asks}"
            raise InputError(Fault(f"effect[{index}]", text, "leave the oil out for this test", file))


@dataclass(frozen=True, eq=False)
class StaticError(Result):
    """What slow turns give.

    Args:
        theta: angle of the drive from its zero, whole turns [rad], (n,).
        phi: displacement on the active flanks [m], (n,).
        psi: displacement on the reverse flanks [m], (n,).
        record: what encoders would have recorded of the whole test.
        speed: of the drive [rad/s].
        turns: of the drive, each way.
        meta: of the engine's run.
    """

    theta: np.ndarray
    phi: np.ndarray
    psi: np.ndarray
    record: Recording
    speed: float
    turns: float
    meta: dict[str, Any]

    @property
    def backlash(self) -> np.ndarray:
        """Distance of the reverse from the active flank over the drive's angle [m], (n,)."""
        return self.psi - self.phi

    def curves(self) -> dict[str, np.ndarray]:
        """Return the three curves by name, each [m], (n,)."""
        return {"phi": self.phi, "psi": self.psi, "backlash": self.backlash}

    def to_dict(self) -> dict[str, Any]:
        """Return speed, turns, and of each curve mean, range, rms about the mean [m] and its strongest orders."""
        told = {name: _told(curve, self.turns) for name, curve in self.curves().items()}
        return {"test": "ste", "speed_rad_s": self.speed, "turns": self.turns, **told}


def static_error(
    scenario: Scenario,
    speed: float = SLOW,
    turns: float | None = None,
    seed: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> StaticError:
    """Drive slowly forth on the active flanks and back on the reverse ones in the 3D engine.

    Args:
        scenario: pair, inertia, drag, effects and sensors; mean speed, harmonics and record of the drive play no part.
        speed: of the drive [rad/s], above 0.
        turns: of the drive, each way; whole hunting cycles unless given, at least 2 turns and at most 60.
        seed: of the encoders' noise; that of the scenario unless given.
        progress: called now and then with the simulated time done [s].

    Returns:
        Both flanks over the drive's angle, as the gears stood, and the record of the encoders.

    Raises:
        InputError: speed or turns are not above 0, drag does not hold the loose gear on its flanks, oil keeps it off
            them, or what the engine cannot do.
        EngineError: the gears jam.
        KeyboardInterrupt: it was interrupted; half a revolution has no result.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2.

    >>> from gears3d.scenario import load
    >>> small = {"gears.drive.teeth": 20, "gears.loose.teeth": 20}
    >>> found = static_error(load("scenarios/base/rigaud-2020.toml", small), turns=1.0)
    >>> round(float(found.backlash.min()), 9), round(float(found.backlash.max()), 9)
    (0.00025, 0.00025)
    """
    turns = cycles(scenario) if turns is None else turns
    if not (speed > 0.0 and turns > 0.0):
        raise InputError(Fault("--speed" if speed <= 0.0 else "--turns", "is not above 0", "give a positive number"))
    refuse_unseen(scenario, "bullet")
    refuse_oil(scenario, "flanks that touch all the way")
    way, turning, rate = 2.0 * pi * (turns + LEAD), 2.0 * pi * TURNING / speed, PER_TURN * speed / (2.0 * pi)
    rate = min(scenario.sensors.sample_rate, rate)
    run = replace(scenario.run, duration=2.0 * way / speed + turning, output_rate=rate, settle=0.0)
    asked = replace(scenario, motion=Motion(speed), start=Start("active"), run=run)
    path, step = there_and_back(speed, way, turning), STEP * SLOW / speed
    made = simulate(asked, path=path, step=step, progress=progress)
    if made.meta["interrupted"]:
        raise KeyboardInterrupt
    forth = way / speed
    _refuse_parted(made.meta["contacts"], forth, turning, 2.0 * pi * turns / speed)
    sensors = replace(scenario.sensors, sample_rate=rate)
    seen = observe(made, scenario.effects, scenario.rig())
    record = encode(seen, sensors, scenario.run.seed if seed is None else seed)
    theta = np.linspace(0.0, 2.0 * pi * turns, ceil(POINTS * turns), endpoint=False)
    phi = _over(theta, made, made.time <= forth)
    psi = _over(theta, made, made.time >= forth + turning)
    return StaticError(theta, phi, psi, record, speed, turns, made.meta)


def _over(theta: np.ndarray, made: Recording, part: np.ndarray) -> np.ndarray:
    """Return the displacement over the drive's angle [m]; between samples a cubic, as the speeds are known too."""
    from scipy.interpolate import CubicHermiteSpline

    names = ("theta_drive_rad", "displacement_m", "velocity_m_s", "omega_drive_rad_s")
    angle, place, rate, speed = (made.signals[name][part] for name in names)
    order = np.argsort(angle)
    return CubicHermiteSpline(angle[order], place[order], (rate / speed)[order])(theta)


def cycles(scenario: Scenario) -> int:
    """Return the turns of the drive unless they are given: whole hunting cycles, after which teeth meet again.

    >>> from gears3d.scenario import load
    >>> [cycles(load(f"scenarios/base/{name}.toml")) for name in ("rigaud-2020", "kadmiri-2012")]
    [2, 37]
    """
    drive, loose = scenario.gears.drive.teeth, scenario.gears.loose.teeth
    cycle = loose // gcd(drive, loose)
    return min(cycle * ceil(FEWEST / cycle), MOST)


def _refuse_parted(contacts: list[tuple[int, float, float]], forth: float, turning: float, whole: float) -> None:
    """Refuse a loose gear that nothing holds on its flank."""
    for flank, begin, name in ((0, 0.0, "active"), (1, 2.0 * forth + turning - whole, "reverse")):
        own = np.array([(a, b) for side, a, b in contacts if side == flank]).reshape(-1, 2)
        touching = np.clip(np.minimum(own[:, 1], begin + whole) - np.maximum(own[:, 0], begin), 0.0, None).sum()
        if touching < (1.0 - LOST) * whole:
            what = f"leaves the loose gear off its {name} flank for {1.0 - touching / whole:.0%} of the turns"
            raise InputError(Fault("drag", what, "give drag, or less --speed: only drag holds the gear on the flank"))


def _told(curve: np.ndarray, turns: float) -> dict[str, Any]:
    """Return mean, range and rms of a curve [m], and its strongest orders: those of whole turns only."""
    found: dict[str, Any] = {
        "mean_m": float(curve.mean()),
        "smallest_m": float(curve.min()),
        "largest_m": float(curve.max()),
        "rms_m": float(curve.std()),
    }
    orders = [
        {"order_drive": float(order / turns), "amplitude_m": float(amplitude), "phase_rad": float(phase)}
        for order, amplitude, phase in zip(*strongest_orders(curve, ORDERS), strict=True)
        if amplitude > 1e-9
    ]
    return {**found, "orders": orders if float(turns).is_integer() else None}

"""The perfectly plastic closed form: one harmonic, constant drag, impacts without rebound.

Contact is lost at the phases of eq. (17), flights end at the roots of eqs (18), (19), and every impact is followed by
contact until the next loss. Nothing is integrated and no step is chosen; the rigid model, which is independent of this,
must give the same. Source: Rigaud & Perret-Liaudet 2020, eqs (11)-(19).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, floor, inf, nan, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.laws.orbit import ACTIVE, REVERSE, Landing, SineDrive, drift, landing
from gears3d.lumped.rigid import SIGNALS, tooth
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.scenario import Scenario

REMEDY = "run it with --model rigid"
NAMES = ("active", "reverse")


@dataclass(frozen=True)
class Setting:
    """Parameters of the closed form.

    Args:
        rig: constants of the base model, the drag with all constant torques.
        swing: the drive along the line of action.
        phase: of the drive's speed at t = 0 [rad].
    """

    rig: Rig
    swing: SineDrive
    phase: float

    def drive(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return angle [rad] and speed [rad/s] of the drive, (n,) each; Rigaud & Perret-Liaudet 2020, eq. (1)."""
        amplitude, phase = self.swing.speed / self.rig.base_radius_drive, self.swing.omega * time + self.phase
        angle = self.rig.mean_speed * time - amplitude / self.swing.omega * (np.cos(phase) - cos(self.phase))
        return angle, self.rig.mean_speed + amplitude * np.sin(phase)


@dataclass(frozen=True)
class Piece:
    """Contact or flight.

    Args:
        begin: [s].
        end: [s].
        flank: in contact, or left by the flight.
        place: relative displacement at its beginning [m].
        hit: how the flight ended; ``None`` for contact, and for a flight that outlasts the run.
        flight: whether it is one.
    """

    begin: float
    end: float
    flank: int
    place: float
    hit: Landing | None = None
    flight: bool = False


def simulate(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Recording:
    """Give the closed form of a scenario as a recording, with the columns of the rigid model and its ``meta``.

    The scenario has at most one harmonic, constant drag and restitution 0; effects of sensors do not act here.
    ``progress`` is called once with the duration [s]. An assumption that fails is an InputError that names the key.

    Source: Rigaud & Perret-Liaudet 2020, eqs (11)-(19).

    >>> from gears3d.scenario import load
    >>> changes = {"impact.restitution": 0, "run.duration": "0.4 s", "run.settle": "0 s"}
    >>> recording = simulate(load("scenarios/rigaud-2020/fig5-20rpm.toml", changes))
    >>> (1e3 * recording.impacts["velocity_m_s"]).round(1).tolist()
    [30.9, -31.2]
    """
    setting = assumed(scenario)
    duration = scenario.run.duration
    pieces = follow(setting, scenario.start.state, duration)
    _check_drag(setting, pieces)
    spacing = 1.0 / scenario.run.output_rate
    time = spacing * np.arange(floor(duration / spacing * (1 + 1e-12)) + 1)
    hits = [piece for piece in pieces if piece.hit is not None]
    contacts = [piece for piece in pieces if not piece.flight]
    counters = dict.fromkeys(("bounces", "grazing", "zeno"), 0)
    meta = {
        "model": "plastic",
        "lyapunov_1_s": -inf if contacts else nan,
        "counters": {**counters, "contacts": len(hits), "steps": len(pieces), "impacts": len(hits)},
        "impacts": len(hits),
        "contacts": [[piece.flank, piece.begin, piece.end] for piece in contacts],
        "reached_s": duration,
        "interrupted": False,
        "base_radius_drive_m": setting.rig.base_radius_drive,
        "base_radius_loose_m": setting.rig.base_radius_loose,
    }
    if progress is not None:
        progress(duration)
    return Recording(_signals(setting, pieces, time), _impacts(setting, hits), meta)


def assumed(scenario: Scenario) -> Setting:
    """Return the parameters of the closed form; an InputError carries every violated assumption."""
    from dataclasses import replace

    from gears3d.effects import Code
    from gears3d.effects.support import refused

    rig, faults = scenario.rig(), []
    if scenario.motion.record is not None:
        faults.append(Fault("motion.record", "is a measured motion; the plastic model has one harmonic", REMEDY))
    if rig.restitution != 0.0:
        message = f"is {rig.restitution:g}; the plastic model has no rebounds"
        faults.append(Fault("impact.restitution", message, f"give 0 (--set impact.restitution=0), or {REMEDY}"))
    faults += refused(scenario.effects, rig, "plastic")
    drag = rig.drag_torque + sum(row.p[0] for row in scenario.rows() if row.code == Code.TORQUE_CONSTANT)
    moving = [(i, h) for i, h in enumerate(scenario.motion.harmonics) if h.amplitude != 0.0]
    second = "is a second harmonic; the plastic model has one"
    faults += [Fault(f"motion.harmonics[{i}]", second, REMEDY) for i, _ in moving[1:]]
    if drag < 0.0:
        faults.append(Fault("drag.torque", f"with its effects is {drag:g} N m: it drives the loose gear", REMEDY))
    if faults:
        raise InputError(faults)
    pull = drag * rig.base_radius_loose / rig.inertia
    amplitude, omega, phase = 0.0, 2 * pi / scenario.period, 0.0
    if moving:
        harmonic = moving[0][1]
        amplitude, omega = abs(harmonic.amplitude), 2 * pi * harmonic.frequency
        phase = harmonic.phase + (pi if harmonic.amplitude < 0.0 else 0.0)
    return Setting(replace(rig, drag_torque=drag), SineDrive(rig.base_radius_drive * amplitude, omega, pull), phase)


def follow(setting: Setting, start: str, duration: float) -> list[Piece]:
    """Return contacts and flights one after the other, from 0 to ``duration`` [s].

    ``start`` is ``"active"``, ``"reverse"`` or ``"free"``. An impact that is not followed by contact is an InputError:
    the closed form ends there.
    """
    swing, backlash = setting.swing, setting.rig.backlash
    pieces: list[Piece] = []
    known: dict[int, Landing | None] = {}
    time, phase = 0.0, setting.phase
    flank = REVERSE if start == "reverse" else ACTIVE
    riding = start != "free" and swing.presses(flank, phase)
    place = 0.5 * backlash if start == "free" else backlash * flank
    while time < duration:
        if riding:
            ahead = (swing.loss[flank] - phase) % (2 * pi) if swing.excitation > 1.0 else inf
            end = time + ahead / swing.omega
            pieces.append(Piece(time, min(end, duration), flank, place))
            time, phase, riding = end, swing.loss[flank], False
            continue
        settled = bool(pieces)
        hit = known.get(flank) if settled and flank in known else None
        if hit is None:
            hit = landing(swing, phase, place, backlash - place, longest=duration - time)
        if settled and hit is not None:
            known[flank] = hit
        if hit is None or time + hit.time > duration:
            pieces.append(Piece(time, duration, flank, place, None, True))
            break
        pieces.append(Piece(time, time + hit.time, flank, place, hit, True))
        time, phase, flank = time + hit.time, (phase + swing.omega * hit.time) % (2 * pi), hit.flank
        place = backlash * flank
        _check_stays(swing, flank, phase, time)
        riding = True
    return pieces


def _check_stays(swing: SineDrive, flank: int, phase: float, time: float) -> None:
    """Raise an InputError when contact does not last after an impact."""
    if swing.presses(flank, phase):
        return
    raise InputError(
        Fault(
            "motion.harmonics[0]",
            f"contact does not last after the impact on the {NAMES[flank]} flank at {time:.6g} s: the phase is "
            f"{phase:.4f} rad and the flank pushes only while cos ωt {'<' if flank else '>'} "
            f"{-1 / swing.excitation:.4f}; the plastic orbit ends there",
            REMEDY,
        )
    )


def _check_drag(setting: Setting, pieces: list[Piece]) -> None:
    """Raise an InputError when the loose gear comes to a stop, where dry drag changes sign."""
    rig, swing = setting.rig, setting.swing
    if swing.pull == 0.0:
        return
    slowest = inf
    for piece in pieces:
        first, last = (setting.phase + swing.omega * t for t in (piece.begin, piece.end))
        if not piece.flight:
            lowest = -1.0 if floor((last - 1.5 * pi) / (2 * pi)) > floor((first - 1.5 * pi) / (2 * pi)) else 1.0
            speed = swing.speed * min(lowest, sin(first), sin(last))
        else:
            speed = swing.speed * sin(first) - swing.pull * (piece.end - piece.begin)
        slowest = min(slowest, rig.base_radius_drive * rig.mean_speed + speed)
    if slowest <= 0.0:
        message = "is so low that the loose gear stops, where dry drag turns round: the closed form ends there"
        raise InputError(Fault("motion.mean", message, f"give a higher mean speed, or {REMEDY}"))


def _signals(setting: Setting, pieces: list[Piece], time: np.ndarray) -> dict[str, np.ndarray]:
    rig, swing = setting.rig, setting.swing
    begin = np.array([piece.begin for piece in pieces])
    index = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, None)
    flight = np.array([piece.flight for piece in pieces])[index]
    since = time - begin[index]
    fallen, speed = drift(swing, setting.phase + swing.omega * begin[index], since)
    place = np.array([piece.place for piece in pieces])[index]
    displacement, velocity = place + np.where(flight, fallen, 0.0), np.where(flight, speed, 0.0)
    drive, omega = setting.drive(time)
    loose = (displacement + rig.base_radius_drive * drive) / rig.base_radius_loose
    omega_loose = (velocity + rig.base_radius_drive * omega) / rig.base_radius_loose
    return dict(zip(SIGNALS, (time, drive, loose, omega, omega_loose, displacement, velocity), strict=True))


def _impacts(setting: Setting, pieces: list[Piece]) -> dict[str, np.ndarray]:
    rig, swing = setting.rig, setting.swing
    hits = [piece.hit for piece in pieces if piece.hit is not None]
    time = np.array([piece.end for piece in pieces])
    flank = np.array([hit.flank for hit in hits], dtype=np.int8)
    velocity = np.array([hit.velocity for hit in hits])
    drive, _ = setting.drive(time)
    loose = (rig.backlash * flank + rig.base_radius_drive * drive) / rig.base_radius_loose
    heights = [
        piece.place + hit.highest if piece.flank == ACTIVE else rig.backlash - piece.place - hit.lowest
        for piece, hit in zip(pieces, hits, strict=True)
    ]
    return {
        "time_s": time,
        "flank": flank,
        "velocity_m_s": velocity,
        "rebound_m_s": np.zeros(len(hits)),
        "impulse_N_s": -velocity * rig.inertia / rig.base_radius_loose**2,
        "phase_rad": np.mod(swing.omega * time + setting.phase, 2 * pi),
        "tooth_drive": tooth(drive, rig.teeth_drive),
        "tooth_loose": tooth(loose, rig.teeth_loose),
        "flight_height_m": np.array(heights),
    }

"""Located contact: the Python part around the compiled loop: queries of Bullet, records in blocks, and errors."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gears3d.effects.rows import Code, Flank
from gears3d.engine.budget import COMPARE_AFTER, Watch
from gears3d.engine.closing import ContactSystem
from gears3d.engine.faults import jammed, jammed_at_start, not_a_number, not_closed, standing, sunk
from gears3d.engine.films import film_push
from gears3d.engine.forced import FIRST_STEP, TOLERANCE, workspace
from gears3d.engine.impact import ImpactLaw
from gears3d.engine.lines import line_gap, turn_of
from gears3d.engine.log import Impact, Log
from gears3d.engine.loop import advance_forced, advance_rigid
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.moving import (
    DONE,
    FULL,
    HIT,
    JAMS,
    NO_NUMBER,
    NOBODY,
    OPEN,
    QUERY,
    SINKS,
    STANDS,
    STATE,
    Blocks,
    Rules,
)
from gears3d.engine.sustained_contact import on_flank, softly, supporting
from gears3d.engine.world import World
from gears3d.errors import EngineError

Progress = Callable[[float], None]

STEPS = 128  # steps after which the compiled loop returns, for progress and Ctrl-C
EVENTS = 256  # impacts, or contacts, of a block
HALVINGS = 100  # Of the depth of resting teeth: more than a float resolves


@dataclass
class Settings:
    """The settings of a located run in addition to the system.

    Args:
        duration: of the run [s].
        longest_step: s.
        stretched_step: the longest that may be taken to the end of a window of near teeth [s].
        law: restitution.
        stick_velocity: rebounds slower than this become permanent contact [m/s].
        springs: compliant flanks (n, 2), empty for impulses.
        start: ``"active"``, ``"reverse"`` or ``"free"``.
        stroke: circular frequency [rad/s] and phase [rad] of the first harmonic.
        deepest: largest overlap of compliant flanks [m].
        tolerance: of steps under forces of the gap.
    """

    duration: float
    longest_step: float
    stretched_step: float
    law: ImpactLaw
    stick_velocity: float
    springs: np.ndarray
    start: str
    stroke: tuple[float, float]
    deepest: float = math.inf
    tolerance: float = TOLERANCE


class Located:
    """A run and its state.

    Args:
        world: Bullet, with its own response switched off.
        system: surfaces, motion, torques, inertia, film.
        settings: of the run.
        watch: queries Bullet for the near teeth and compares its gaps with the refined ones.
        log: samples and impacts.
        blind: whether the loose gear has no contact with flanks.
        events: impacts, or contacts, of a block.
    """

    def __init__(
        self,
        world: World,
        system: ContactSystem,
        settings: Settings,
        watch: Watch,
        log: Log,
        blind: bool = False,
        events: int = EVENTS,
    ) -> None:
        self.world, self.system, self.settings, self.watch, self.log = world, system, settings, watch, log
        self.contacts: list[tuple[int, float, float]] = []
        law = settings.law
        self._rules = Rules(
            settings.duration,
            settings.longest_step,
            settings.stretched_step,
            0.0 if blind else watch.nearby.width,
            COMPARE_AFTER,
            settings.stick_velocity,
            law.restitution,
            law.table,
            settings.springs,
            settings.deepest,
            settings.tolerance,
        )
        self._work = workspace(system.torques)
        forced = (
            settings.springs.size or system.film.minimum > 0.0 or (system.torques[:, 0] == Code.TORQUE_CARRIED).any()
        )
        self._advance = advance_forced if forced else advance_rigid
        self._state = np.zeros(1, STATE)
        self.state: Any = self._state[0]
        self.state["asked"], self.state["flank"], self.state["pushing"] = math.inf, NOBODY, True
        self.state["step"] = FIRST_STEP
        self._hits, self._ends = np.zeros(events, HIT), np.zeros((events, 3))
        self._draws = law.draws(0, events)

    @property
    def time(self) -> float:
        """Return how far the run has got [s]."""
        return float(self.state["time"])

    @property
    def steps(self) -> int:
        """Return how many steps have been done."""
        return int(self.state["steps"])

    @property
    def located(self) -> float:
        """Return the largest gap at an impact [m]."""
        return float(self.state["located"])

    def run(self, progress: Progress | None = None) -> bool:
        """Run to the end; return whether it was reached (False: interrupted from the keyboard).

        Jammed gears, a state that is not a number, a gap outside the hull budget or no progress in time is an
        EngineError.
        """
        try:
            self._begin()
            while self.go_on():
                if progress is not None:
                    progress(self.time)
        except KeyboardInterrupt:
            return False
        finally:
            self._drain()
            self._close()
        self.log.finish(float(self.state["theta"]), float(self.state["omega"]), self.time)
        return True

    def go_on(self) -> bool:
        """Run the compiled loop, then serve its request; return whether the run continues, or raise an EngineError."""
        log, nearby = self.log, self.watch.nearby
        self.state["samples"] = log.written
        blocks = Blocks(log.times, log.rows, self._hits, self._ends, self._draws)
        why = self._advance(
            self.system, self._rules, (nearby.table, nearby.rows), self._state, blocks, self._work, (STEPS, log.goes_on)
        )
        log.written = int(self.state["samples"])
        if why == QUERY:
            self._query()
        elif why == FULL:
            self._drain()
            log.turn_over()
        elif why in _FAULTS:
            raise _FAULTS[why](self)
        return why != DONE

    def _query(self) -> None:
        """Pose the gears in Bullet, and query the near teeth."""
        angle, speed, _ = drive_at(self.system.motion, self.time)
        theta, omega = float(self.state["theta"]), float(self.state["omega"])
        self.world.place((angle, theta), (speed, omega))
        self.watch.look(self.world, self.system, self.time, theta)
        self.state["asked"] = angle

    def _drain(self) -> None:
        """Take impacts and contacts out of their blocks."""
        state = self.state
        impacts, ends = int(state["impacts"]), int(state["contacts"])
        state["impacts"] = state["contacts"] = 0
        for hit in self._hits[:impacts]:
            self.log.impacts.append(self._impact(hit))
        for side, began, ended in self._ends[:ends].tolist():
            self.contacts.append((int(side), began, ended))
        self._draws, state["draws"] = self.settings.law.draws(int(state["draws"]), len(self._draws)), 0

    def _impact(self, hit: Any) -> Impact:
        """Return an impact as it is recorded."""
        side, when, impulse = int(hit["flank"]), float(hit["time"]), float(hit["impulse"])
        sign = 1.0 if side == 0 else -1.0
        drive, loose = int(hit["drive"]), int(hit["loose"])
        frequency, phase = self.settings.stroke
        height = axial = math.nan
        shape = self.system.surfaces
        if not shape.planar:
            angle = drive_at(self.system.motion, float(hit["met"]))[0]
            at = (angle, float(hit["theta"]), drive, loose, side)
            _, _, lever, height, _ = line_gap(shape.along, *at)
            # a flank's normal leans to the axis as its section turns with the height, times its lever
            axial = impulse * lever * turn_of(shape.along, 1, side, loose)
        return Impact(
            time_s=when,
            flank=side,
            velocity_m_s=sign * float(hit["rate"]),
            rebound_m_s=sign * float(hit["rebound"]) + 0.0,
            impulse_N_s=sign * impulse,
            phase_rad=(frequency * when + phase) % (2.0 * math.pi),
            tooth_drive=drive,
            tooth_loose=loose,
            flight_height_m=float(hit["height"]),
            height_m=height,
            axial_impulse_N_s=axial,
        )

    def _close(self) -> None:
        """Log contacts and passages that are under way at the end."""
        state = self.state
        if state["stays"]:
            flank = int(state["place"]) - 1 if state["flank"] == NOBODY else int(state["flank"])
            self.contacts.append((flank, float(state["began"]), self.time))

    def _begin(self) -> None:
        """Put the gears where the scenario starts and check that they are not jammed."""
        state, shape = self.state, self.system.surfaces
        self._query()
        angle, speed, _ = drive_at(self.system.motion, 0.0)
        teeth = self.watch.nearby.teeth(angle)
        gaps = [side_gap(shape, teeth, side, angle, float(state["theta"])) for side in (0, 1)]
        if gaps[0][0] + gaps[1][0] <= 0.0:
            raise jammed_at_start(-gaps[0][0] - gaps[1][0])
        state["omega"] = -gaps[0][1] / gaps[0][2] * speed
        if self.settings.start == "free":
            middle = 0.5 * (gaps[0][0] + gaps[1][0])
            state["theta"] += (middle - gaps[0][0]) / gaps[0][2]
            state["height"] = middle
        else:
            self._begin_on(teeth, Flank.REVERSE if self.settings.start == "reverse" else Flank.ACTIVE)
        state["body"] = state["theta"], state["omega"]

    def _begin_on(self, teeth: np.ndarray, side: Flank) -> None:
        """Begin in contact with a flank if contact holds, else with no relative speed, or float on its oil film."""
        state, system, springs = self.state, self.system, self.settings.springs
        theta, omega = on_flank(system, teeth, int(side), 0.0, float(state["theta"]))
        state["omega"], state["left"] = omega, int(side)
        soft = softly(system, 0.0, self.settings.stick_velocity)
        force = supporting(system, teeth, int(side), 0.0, theta, soft)[1]
        angle = drive_at(system.motion, 0.0)[0]
        lever = side_gap(system.surfaces, teeth, int(side), angle, theta)[2]
        oiled = system.film.minimum > 0.0
        state["stays"] = oiled or force >= 0.0
        if oiled or (springs.size and force >= 0.0):
            state["flank"] = int(side)
        if force >= 0.0:
            state["place"] = 1 + int(side)
        if oiled and (springs.size or force < 0.0):
            gap = self._rests_at(teeth, int(side), force, (theta, omega))
            theta += gap / lever
            if gap >= system.film.felt:
                state["flank"], state["stays"] = NOBODY, False
        elif springs.size and force >= 0.0:
            theta -= force / springs[0, 0] / lever
        state["theta"] = theta

    def _rests_at(self, teeth: np.ndarray, side: int, force: float, loose: tuple[float, float]) -> float:
        """Return the gap [m] at which the films, and compliant flanks, carry the load of a flank.

        ``teeth`` (n, 3) may touch, ``side`` is 0 active, 1 reverse; ``force`` [N] is that of a rigid flank under oil,
        negative where it would have to pull; ``loose`` is angle [rad] and speed [rad/s] of the loose gear on the flank.
        """
        film, springs = self.system.film, self.settings.springs
        angle, speed, _ = drive_at(self.system.motion, 0.0)
        whole, speeds = side_gap(self.system.surfaces, teeth, 1 - side, angle, loose[0])[0], (speed, loose[1])

        def carried(gap: float) -> float:
            ours = film_push(film, gap, 0.0, False, speeds) - film_push(film, whole - gap, 0.0, False, speeds)
            return ours - springs[0, 0] * gap if gap < 0.0 else ours

        load = force + carried(0.0)
        if load <= 0.0:
            return film.felt
        low, high = (0.0, 0.5 * whole) if force < 0.0 else (-2.0 * force / springs[0, 0], 0.0)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if carried(middle) > load else (low, middle)
        return low


def _sunk(run: Located) -> EngineError:
    remedy = "give stiffer teeth" if run.settings.springs.size else "take shorter steps"
    return sunk(float(run.state["fault"]), run.time, remedy)


# Why the compiled loop cannot continue, and the error of each.
_FAULTS: dict[int, Callable[[Located], EngineError]] = {
    JAMS: lambda run: jammed(run.time),
    SINKS: _sunk,
    OPEN: lambda run: not_closed(float(run.state["fault"]), run.time),
    NO_NUMBER: lambda run: not_a_number(run.time),
    STANDS: lambda run: standing(run.time),
}

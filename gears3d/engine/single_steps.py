"""Single steps of the engine from given states: a flight, an impact, a rest on a flank, with the world built once."""

from __future__ import annotations

import math
from contextlib import ExitStack
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects.rows import Code
from gears3d.engine.budget import Watch
from gears3d.engine.bullet import require_bullet
from gears3d.engine.closing import ContactSystem
from gears3d.engine.forced import springs_of
from gears3d.engine.lines import slices_of
from gears3d.engine.located import Located, Settings
from gears3d.engine.log import Impact, Log
from gears3d.engine.loop import ROOM
from gears3d.engine.mesh import meshed
from gears3d.engine.motion import drive_at, motion_table, standing_at
from gears3d.engine.run import STRETCH, TURN_PER_STEP, bodies, longest_step, prepared
from gears3d.engine.sustained_contact import on_flank
from gears3d.engine.torques import FREE, acceleration, friction, gated
from gears3d.engine.world import lent_world
from gears3d.errors import EngineError, Fault, InputError

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

NEAR = 1e-9  # gap at which the approach of an impact begins [m]
APART = 1e-6  # part of the gap by which a gear that is launched from a flank is away from it at the start
LATE = 4.0  # longest drop, in times that it takes at half its speed on arrival
AFTER = 5.0  # longest impact, in times of its approach, or in radians of the oscillation on compliant flanks


class Bench:
    """The engine's world of a scenario, in which single steps start from any state of the loose gear.

    Args:
        scenario: the scenario to be simulated; its duration and start are not used.
        drive: angle of the drive gear at time 0 [rad]; its motion is the scenario's.

    Raises:
        InputError: what the engine cannot do.

    >>> from gears3d.scenario import load
    >>> with Bench(load("scenarios/rigaud-2020/fig5-20rpm.toml")) as bench:
    ...     hit = bench.strike(0.1, 1, 0.02)
    >>> round(hit.rebound_m_s / hit.velocity_m_s, 9)
    -0.3
    """

    def __init__(self, scenario: Scenario, drive: float = 0.0) -> None:
        require_bullet()
        rows, gears = scenario.rows(), None
        if any(row.code == Code.GAP_FILM for row in rows):
            text = "asks for oil between the flanks: what a film does to a flight depends on the flights before it"
            raise InputError(Fault("effect", text, "run the scenario as a whole, or leave the oil out"))
        if any(row.code == Code.TORQUE_CARRIED for row in rows):
            text = "has a carried body, whose motion depends on the flights before"
            raise InputError(Fault("effect", text, "run the scenario as a whole, or leave carried_inertia out"))
        gears, torques, law = prepared(scenario, gears, rows)
        shape, rig = meshed(gears), scenario.rig()
        arm = friction(rows) * gears.loose.base_radius
        motion = standing_at(motion_table(scenario, rows), drive)
        self._system = ContactSystem(shape, motion, torques, gated(torques), rig.inertia, arm)
        longest = longest_step(motion, rows, gears)
        stretched = longest_step(motion, rows, gears, turn=STRETCH * TURN_PER_STEP)
        self._watch = Watch(gears, shape, slices_of(gears))
        self._settings = Settings(
            0.0, longest, stretched, law, scenario.impact.stick_velocity, springs_of(rows), "free", (0.0, 0.0)
        )
        self._stack = ExitStack()
        self._world = self._stack.enter_context(lent_world(bodies(scenario, gears), respond=False))
        self._radii = gears.drive.base_radius, gears.loose.base_radius

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def drive(self, time: float) -> tuple[float, float]:
        """Return the drive's angle [rad] and speed [rad/s] at a time [s]."""
        return drive_at(self._system.motion, time)[:2]

    def fly(self, theta: float, omega: float, times: np.ndarray) -> np.ndarray:
        """Return the loose gear's path in free flight, without contact with flanks [rad], (n,).

        Args:
            theta: its angle at the first of the times [rad].
            omega: its speed there [rad/s].
            times: rising [s], (n,).
        """
        run = self._run(times, float(times[-1]), True)
        run.begin(float(times[0]), theta, omega)
        return run.path()

    def coast(self, omega: float, times: np.ndarray) -> np.ndarray:
        """Return angle [rad] and speed [rad/s] of the loose gear in coast-down out of mesh from angle 0, (n, 2).

        Args:
            omega: its speed at the first of the times [rad/s].
            times: rising [s], (n,).
        """
        run = self._run(times, float(times[-1]), True)
        run.begin(float(times[0]), 0.0, omega)
        run.path()
        return run.log.states()

    def drop(self, time: float, side: int, speed: float) -> Impact:
        """Return the first impact of a loose gear that is released, or launched, to reach a flank at a speed.

        It starts from the other flank, with the relative speed that drag requires; where drag alone would make it too
        fast it is released nearer.

        Args:
            time: of the start [s].
            side: flank that it reaches, 0 active, 1 reverse.
            speed: on arrival, nearly [m/s].

        Raises:
            EngineError: it does not arrive.
        """
        here, omega = self._on_flank(side, time)
        there, _ = self._on_flank(1 - side, time)
        radius, sense = self._radii[1], 1.0 if side else -1.0
        system = self._system
        way_of = float(np.sign(omega)) or sense  # the sign of motion that dry drag acts against
        pull = sense * radius * acceleration(system.torques, system.inertia, FREE, time, there, omega, way_of)
        way = abs(there - here) * radius
        launch = speed * speed - 2.0 * pull * way
        if launch < 0.0:  # drag alone makes it faster: release it nearer
            way, launch = speed * speed / (2.0 * pull), 0.0
        launch = math.sqrt(launch)
        start = min(way, abs(there - here) * radius * (1.0 - APART))
        run = self._run(np.zeros(0), time + LATE * (2.0 * start / speed))
        run.begin(time, here - sense * start / radius, omega + sense * launch / radius)
        return run.first()

    def strike(self, time: float, side: int, speed: float) -> Impact:
        """Return the impact of a loose gear on a flank.

        Args:
            time: of the impact, about [s].
            side: 0 active, 1 reverse.
            speed: of approach [m/s].

        Raises:
            EngineError: the gears are jammed.
        """
        theta, omega = self._on_flank(side, time)
        toward = speed / self._radii[1] * (-1.0 if side == 0 else 1.0)
        before = NEAR / speed
        lasts = AFTER * before
        if (springs := self._settings.springs).size:
            lasts += AFTER * math.sqrt(self._system.inertia / self._radii[1] ** 2 / springs[:, 0].sum())
        run = self._run(np.zeros(0), time + lasts)
        run.begin(time - before, theta - (omega + toward) * before, omega + toward)
        return run.first()

    def rest(self, side: int, times: np.ndarray) -> np.ndarray:
        """Return the loose gear's angles in contact with a flank [rad], (n,).

        Args:
            side: 0 active, 1 reverse.
            times: [s], (n,).
        """
        return np.array([self._on_flank(side, float(time))[0] for time in times])

    def _on_flank(self, side: int, time: float) -> tuple[float, float]:
        """Return angle and speed of the loose gear in contact with a flank."""
        angle, speed, _ = drive_at(self._system.motion, time)
        guess = angle * self._radii[0] / self._radii[1]
        for _ in range(2):  # the second query is at the flank itself
            self._world.place((angle, guess), (speed, 0.0))
            self._watch.look(self._world, self._system, time, guess)
            guess, omega = on_flank(self._system, self._watch.nearby.teeth(angle), side, time, guess)
        return guess, omega

    def _run(self, times: np.ndarray, until: float, blind: bool = False) -> _Run:
        settings = Settings(**{**vars(self._settings), "duration": until})
        return _Run(self._world, self._system, settings, self._watch, Log(0.0, 1.0, times), blind=blind, events=ROOM)


class _Run(Located):
    """A flight that starts at a given state; its blocks hold one impact."""

    def begin(self, time: float, theta: float, omega: float) -> None:
        """Put the loose gear where it starts."""
        self.state["time"], self.state["theta"], self.state["omega"] = time, theta, omega

    def path(self) -> np.ndarray:
        """Run to the end and return the angles at the samples."""
        while self.go_on():
            pass
        self.log.finish(float(self.state["theta"]), float(self.state["omega"]), self.time)
        return self.log.loose()

    def first(self) -> Impact:
        """Run to the first impact."""
        while not self.log.impacts:
            if not self.go_on():
                self._drain()
                break
        if not self.log.impacts:
            raise EngineError(f"no impact came about at t = {self.time:.6g} s: the flank goes away as fast")
        return self.log.impacts[0]

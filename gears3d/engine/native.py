"""Native contact: Bullet's own response in fixed steps, with the settings that make its impacts exact at rest.

With turning gears, facets and quantised hulls tilt the contact normal and restitution scatters; this mode exists to
show that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from gears3d.effects.rows import Flank
from gears3d.engine.budget import Watch
from gears3d.engine.closing import Arc, ContactSystem
from gears3d.engine.faults import SUNK_NATIVE, see_numbers, sunk
from gears3d.engine.impact import ImpactLaw
from gears3d.engine.log import Impact, Log
from gears3d.engine.mesh import side_gap, touching_teeth
from gears3d.engine.motion import drive_at
from gears3d.engine.torques import FREE, acceleration
from gears3d.engine.world import World

STEP = 1e-5  # default step [s]
# Largest number of contact steps of one impact, and smallest number of free steps before it; all else is resting
# contact.
LONGEST_IMPACT = 3
REPORT_EVERY = 2000
LOOK_EVERY = 100  # steps between two checks of the overlap of the teeth


@dataclass
class _Hit:
    """An impact under way: flank, approach [m/s], when it began [s], impulse so far [N s], steps."""

    side: int
    approach: float
    began: float
    impulse: float = 0.0
    steps: int = 0


@dataclass
class Native:
    """The state of a run under Bullet's own contact response.

    Args:
        world: Bullet, with its response switched on.
        system: surfaces, motion, torques, inertia.
        base_radii: of drive and loose gear [m].
        law: restitution.
        watch: queries Bullet for the near teeth at an impact.
        log: samples and impacts.
        settings: duration [s], step [s], slowest approach that is logged [m/s].
        stroke: circular frequency [rad/s] and phase [rad] of the first harmonic.
    """

    world: World
    system: ContactSystem
    base_radii: tuple[float, float]
    law: ImpactLaw
    watch: Watch
    log: Log
    settings: tuple[float, float, float]
    stroke: tuple[float, float]
    time: float = 0.0
    theta: float = 0.0
    omega: float = 0.0
    steps: int = 0
    located: float = 0.0
    contacts: list[tuple[int, float, float]] = field(default_factory=list)
    _hit: _Hit | None = field(default=None, repr=False)
    _free: int = 0
    _low: float = 0.0
    _high: float = 0.0
    _height: float = 0.0

    def run(self, progress: Callable[[float], None] | None = None) -> bool:
        """Run to the end; return whether it was reached (False: interrupted from the keyboard).

        A state that is not a number is an EngineError.
        """
        duration, step, _ = self.settings
        try:
            self._begin()
            for number in range(round(duration / step)):
                self._advance(number * step, step)
                if number % LOOK_EVERY == 0:
                    self._see_depth()
                if progress is not None and number % REPORT_EVERY == 0:
                    progress(self.time)
        except KeyboardInterrupt:
            return False
        self.log.finish(self.theta, self.omega, self.time)
        return True

    def _begin(self) -> None:
        self.world.restitution(self.law.coefficient(Flank.ACTIVE, 0.0))
        self.omega = self.base_radii[0] / self.base_radii[1] * drive_at(self.system.motion, 0.0)[1]
        self.world.place((0.0, self.theta), (0.0, self.omega))

    def _advance(self, time: float, step: float) -> None:
        """Do one step and test whether Bullet's contact changed the loose gear's speed."""
        system = self.system
        angle, _, _ = drive_at(system.motion, time)
        speed = (drive_at(system.motion, time + step)[0] - angle) / step
        sign = math.copysign(1.0, self.omega) if self.omega != 0.0 else 0.0
        accel = acceleration(system.torques, system.inertia, FREE, time, self.theta, self.omega, sign)
        before = self.omega + accel * step
        if self.law.changes:
            approach = self.base_radii[1] * before - self.base_radii[0] * speed
            self.world.restitution(self.law.coefficient(Flank(int(approach > 0.0)), abs(approach)))
        self.world.place_drive(angle, speed)
        theta, omega = self.world.step(step, system.inertia * accel)
        see_numbers(theta, omega, time)
        self.log.flight(Arc(time, self.theta, omega, 0.0, 0.0), time + step)
        self.theta, self.omega, self.time = theta, omega, time + step
        self.steps += 1
        self._watch_impact(before, speed)

    def _see_depth(self) -> None:
        """Stop where the teeth overlap in Bullet."""
        self.watch.look(self.world, self.system, self.time, self.theta)
        angle = drive_at(self.system.motion, self.time)[0]
        teeth = self.watch.nearby.teeth(angle)
        gap = min(side_gap(self.system.surfaces, teeth, side, angle, self.theta)[0] for side in (0, 1))
        if gap < -SUNK_NATIVE:
            raise sunk(-gap, self.time, "take a shorter step, or --contact located")

    def _watch_impact(self, before: float, speed: float) -> None:
        """Open, lengthen or close the impact under way; ``before`` and ``speed`` are those of the gears [rad/s]."""
        of_drive, of_loose = self.base_radii
        angle = drive_at(self.system.motion, self.time)[0]
        place = of_loose * self.theta - of_drive * angle
        change = self.omega - before
        if abs(change) * of_loose > 1e-9:
            side = 0 if change > 0.0 else 1
            if self._hit is None and self._free < LONGEST_IMPACT:
                self._hit = _Hit(side, 0.0, self.time)
            elif self._hit is None:
                self._height = self._high - self._low
                self._hit = _Hit(side, of_loose * before - of_drive * speed, self.time)
            self._hit.impulse += self.system.inertia * change / of_loose
            self._hit.steps += 1
            self._free = 0
        elif self._hit is not None:
            towards = self._hit.approach if self._hit.side else -self._hit.approach
            if self._hit.steps <= LONGEST_IMPACT and towards >= self.settings[2]:
                self._note(self._hit, of_loose * self.omega - of_drive * speed)
            self._hit = None
            self._low = self._high = place
        self._free += 1
        self._low, self._high = min(self._low, place), max(self._high, place)

    def _note(self, hit: _Hit, rebound: float) -> None:
        self.watch.look(self.world, self.system, self.time, self.theta)
        angle, speed, _ = drive_at(self.system.motion, self.time)
        angles, speeds = (angle, self.theta), (speed, self.omega)
        drive, loose = touching_teeth(self.system.surfaces, self.watch.nearby.teeth(angle), hit.side, angles, speeds)
        frequency, phase = self.stroke
        self.log.impacts.append(
            Impact(
                time_s=hit.began,
                flank=hit.side,
                velocity_m_s=hit.approach,
                rebound_m_s=rebound,
                impulse_N_s=hit.impulse,
                phase_rad=(frequency * hit.began + phase) % (2.0 * math.pi),
                tooth_drive=drive,
                tooth_loose=loose,
                flight_height_m=self._height,
            )
        )

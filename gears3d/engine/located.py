"""Located contact: Bullet moves the gears and says which teeth are near; impacts happen where the true flanks meet.

Each step is cut so that the refined gap closes at its end. There the impact law acts as an impulse at the contact
point along the flank's normal, through the generalised inertia that the contact Jacobian gives; rebounds below the
stick velocity become permanent contact, held on the measured gap until the flank would have to pull.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from gears3d.effects.rows import Flank
from gears3d.engine.budget import Watch
from gears3d.engine.closing import (
    CLOSES_ACTIVE,
    NOTHING,
    STOPS,
    TOUCH,
    Arc,
    Plant,
    path_angle,
    plan_flight,
)
from gears3d.engine.faults import SUNK, jammed, jammed_at_start, see_numbers, sunk
from gears3d.engine.forced import AT_REST, CLEARS, FLIPS, HALTS, Forces, plan_forced
from gears3d.engine.holding import HELD, MEETS, on_flank, plan_contact, softly, supporting
from gears3d.engine.impact import ImpactLaw, normal_impulse
from gears3d.engine.lines import line_gap, turn_of
from gears3d.engine.log import Impact, Log, Meeting
from gears3d.engine.mesh import side_gap, touching_teeth
from gears3d.engine.motion import drive_at
from gears3d.engine.nearby import until_edge
from gears3d.engine.pressing import lasting, pressed_step
from gears3d.engine.torques import FREE, until_kink
from gears3d.engine.world import World
from gears3d.errors import EngineError

Progress = Callable[[float], None]

NEAR = 1e-10
"""How exactly a gap must be closed when its impact happens [m]."""
STANDSTILL = 2000
"""Events in a row without any time passing before the run is given up."""
REPORT_EVERY = 64
"""Steps between two calls of the progress function."""


@dataclass
class Settings:
    """What a located run needs beside the plant.

    Args:
        duration: of the run [s].
        longest_step: s.
        stretched_step: the longest that may be taken to the end of a window of near teeth [s].
        law: restitution.
        stick_velocity: rebounds slower than this become permanent contact [m/s].
        springs: compliant flanks (n, 2), empty for impulses.
        start: ``"active"``, ``"reverse"`` or ``"free"``.
        stroke: circular frequency [rad/s] and phase [rad] of the first harmonic.
        deepest: how deep yielding flanks may lie in each other [m].
        share: of the steps that springs and films ask for, taken.
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
    share: float = 1.0


@dataclass
class Flight:
    """What is remembered of the flight or compliant contact under way.

    Args:
        left: flank that it left.
        height: largest distance from it so far [m].
        entry: rate of the gap when a compliant contact began [m/s].
        began: when that, or permanent contact, began [s].
        impulse: of its force so far [N s].
        stays: whether the contact is permanent.
        pushing: whether the flanks push on each other in a compliant contact.
    """

    left: int = 0
    height: float = 0.0
    entry: float = 0.0
    began: float = 0.0
    impulse: float = 0.0
    stays: bool = False
    pushing: bool = True


@dataclass
class Located:
    """The state of a run and the rules by which it goes on.

    Args:
        world: Bullet, with its own response switched off.
        plant: surfaces, motion, torques, inertia.
        settings: of the run.
        watch: asks Bullet for the near teeth and holds its gaps against the refined ones.
        log: samples and impacts.
    """

    world: World
    plant: Plant
    settings: Settings
    watch: Watch
    log: Log
    time: float = 0.0
    theta: float = 0.0
    omega: float = 0.0
    place: int = FREE
    steps: int = 0
    located: float = 0.0
    strayed: float = 0.0
    contacts: list[tuple[int, float, float]] = field(default_factory=list)
    flight: Flight = field(default_factory=Flight)
    teeth: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))

    def run(self, progress: Progress | None = None) -> bool:
        """Run to the end; return whether it got there (False: interrupted from the keyboard).

        Raises:
            EngineError: jammed, not a number, outside the hull budget, or no time passes any more.
        """
        standing = 0
        try:
            self._begin()
            while self.time < self.settings.duration:
                before = self.time
                self._advance()
                standing = 0 if self.time > before else standing + 1
                if standing > STANDSTILL:
                    raise EngineError(f"no progress at t = {self.time:.9g} s: raise impact.stick_velocity")
                if progress is not None and self.steps % REPORT_EVERY == 0:
                    progress(self.time)
        except KeyboardInterrupt:
            return False
        finally:
            self._close()
        self.log.finish(self.theta, self.omega, self.time)
        return True

    def _close(self) -> None:
        """Write down what is still under way at the end."""
        if self.place != FREE:
            self._leave(self.place - 1)

    def _leave(self, side: int) -> None:
        """Leave a flank; what was permanent contact is written down."""
        if self.flight.stays:
            self.contacts.append((side, self.flight.began, self.time))
        self.place = FREE
        self.flight = Flight(left=side)

    def _begin(self) -> None:
        """Put the gears where the scenario starts and see that they are not jammed."""
        self.watch.look(self.world, self.plant, 0.0, self.theta)
        self.teeth = self.watch.nearby.teeth(drive_at(self.plant.motion, 0.0)[0])
        angle, speed, _ = drive_at(self.plant.motion, 0.0)
        gaps = [side_gap(self.plant.surfaces, self.teeth, side, angle, self.theta) for side in (0, 1)]
        if gaps[0][0] + gaps[1][0] <= 0.0:
            raise jammed_at_start(-gaps[0][0] - gaps[1][0])
        self.omega = -gaps[0][1] / gaps[0][2] * speed
        if self.settings.start == "free":
            middle = 0.5 * (gaps[0][0] + gaps[1][0])
            self.theta += (middle - gaps[0][0]) / gaps[0][2]
            self.flight.height = middle
        else:
            self._begin_on(1 if self.settings.start == "reverse" else 0)
        self._pose()

    def _begin_on(self, side: int) -> None:
        """Begin on a flank: at rest on it if it holds, else leaving it with no relative speed."""
        self.theta, self.omega = on_flank(self.plant, self.teeth, side, 0.0, self.theta)
        self.flight.left = side
        springs = self.settings.springs
        force = self._reaction(side)
        if force >= 0.0:
            self.place = 1 + side
            self.flight.stays = True
            if springs.size:
                self.theta -= force / springs[:, 0].sum() / self._contact(side)[2]

    def _advance(self) -> None:
        """Do one step: see which teeth are near, plan, let Bullet move the gears, act on what the step ends with."""
        plant, settings = self.plant, self.settings
        angle = drive_at(plant.motion, self.time)[0]
        if self.watch.due(angle):
            self.watch.look(self.world, plant, self.time, self.theta)
        self.teeth = self.watch.nearby.teeth(angle)
        steps = settings.longest_step, settings.stretched_step
        edge = until_edge(plant.motion, self.time, self.watch.nearby.width, steps)
        kink = until_kink(plant.torques, plant.inertia, self.place, self.time, self.theta, self.omega)
        self._go(min(edge, settings.duration - self.time, kink))

    def _go(self, longest: float) -> None:
        """Do one step as the place asks for it."""
        if self.place == FREE:
            self._fly(longest)
        elif self.settings.springs.size:
            self._press(longest)
        else:
            self._hold(longest)

    def _fly(self, longest: float) -> None:
        duration, arc, event, top = plan_flight(self.plant, self.teeth, self._here(), longest, self.flight.left)
        self.flight.height = max(self.flight.height, top)
        self._move(arc, duration)
        if event == STOPS:
            self.omega = 0.0
            self._pose()
        elif event != NOTHING:
            self._strike(event - CLOSES_ACTIVE)

    def _here(self) -> Arc:
        return Arc(self.time, self.theta, self.omega, 0.0, 0.0)

    def _move(self, arc: Arc, duration: float) -> None:
        """Let Bullet integrate a step of flight and take the loose gear's state from it."""
        if duration <= 0.0:
            return
        until = arc.time + duration
        mean = arc.accel + 0.5 * arc.jerk * duration
        theta, omega = self.world.step(duration, self.plant.inertia * mean)
        see_numbers(theta, omega, self.time)
        self.log.flight(arc, until)
        # Bullet moves on with the speed at the end of the step, which is too far by this much
        too_far = (0.5 * arc.accel + arc.jerk * duration / 3.0) * duration * duration
        self.theta, self.omega = theta - too_far, omega
        radius = self.plant.surfaces.edged.flanks.gears[1, 0]
        self.strayed = max(self.strayed, radius * abs(self.theta - path_angle(arc, duration)))
        self.time = until if until > arc.time else np.nextafter(arc.time, math.inf)
        self.steps += 1
        self._pose()

    def _pose(self) -> None:
        angle, speed, _ = drive_at(self.plant.motion, self.time)
        self.world.place((angle, self.theta), (speed, self.omega))

    def _contact(self, side: int) -> tuple[float, float, float]:
        """Return gap [m], gap rate [m/s] and the loose gear's lever [m] of one side."""
        angle, speed, _ = drive_at(self.plant.motion, self.time)
        gap, by_drive, by_loose, _ = side_gap(self.plant.surfaces, self.teeth, side, angle, self.theta)
        return gap, by_drive * speed + by_loose * self.omega, by_loose

    def _strike(self, side: int) -> None:
        """A gap has closed: act with the impact law, or begin a compliant contact."""
        rate, lever = self._met(side)
        if self.settings.springs.size:
            self.flight.entry, self.flight.began, self.flight.impulse = rate, self.time, 0.0
            self.place = 1 + side
            return
        rebound, after, impulse = self._blow(side, rate, lever)
        self._note(side, self.time, (rate, rebound), impulse)
        self.omega = after
        self.flight = Flight(left=side)
        if self.place != FREE:
            self.flight.began, self.flight.stays = self.time, True
            self.theta, self.omega = on_flank(self.plant, self.teeth, side, self.time, self.theta)
        self._pose()

    def _met(self, side: int) -> tuple[float, float]:
        """Return the rate of a gap that has just closed [m/s] and the loose gear's lever [m]; see that it has."""
        gap, rate, lever = self._contact(side)
        self.located = max(self.located, abs(gap))
        if abs(gap) > NEAR:
            raise EngineError(f"the gap is {gap * 1e9:.3g} nm at the impact at t = {self.time:.9g} s")
        if self._contact(1 - side)[0] < -NEAR:
            raise jammed(self.time)
        return rate, lever

    def _blow(self, side: int, rate: float, lever: float) -> tuple[float, float, float]:
        """Return rebound [m/s], speed of the loose gear after it [rad/s] and impulse [N s] by the law of impacts.

        What is too slow to leave a flank that holds stays on it: the place is then that flank.
        """
        coefficient = self.settings.law.coefficient(Flank(side), abs(rate))
        rebound = coefficient * abs(rate)
        if rebound < self.settings.stick_velocity and self._reaction(side) >= 0.0:
            rebound = 0.0
            self.place = 1 + side
        after = self.omega + (rebound - rate) / lever
        return rebound, after, normal_impulse(self.plant.inertia, lever, self.plant.friction, (self.omega, after))

    def _reaction(self, side: int) -> float:
        """Return the force that holds the loose gear on a flank [N], negative where the flank would have to pull."""
        soft = softly(self.plant, self.time, self.settings.stick_velocity)
        return supporting(self.plant, self.teeth, side, self.time, self.theta, soft)[1]

    def _meeting(self, side: int) -> Meeting:
        """Return which teeth meet on a side now, and where."""
        angle, speed, _ = drive_at(self.plant.motion, self.time)
        angles, speeds = (angle, self.theta), (speed, self.omega)
        shape = self.plant.surfaces
        drive, loose = touching_teeth(shape, self.teeth, side, angles, speeds)
        if shape.planar:
            return Meeting(drive, loose)
        _, _, lever, height, _ = line_gap(shape.edged, shape.along, *angles, drive, loose, side)
        # a flank's normal leans to the axis as its section turns with the height, times its lever
        return Meeting(drive, loose, height, lever * turn_of(shape.along, 1, side, loose))

    def _note(
        self, side: int, when: float, rates: tuple[float, float], impulse: float, met: Meeting | None = None
    ) -> None:
        sign = 1.0 if side == 0 else -1.0
        frequency, phase = self.settings.stroke
        met = self._meeting(side) if met is None else met
        self.log.impacts.append(
            Impact(
                time_s=when,
                flank=side,
                velocity_m_s=sign * rates[0],
                rebound_m_s=sign * rates[1] + 0.0,
                impulse_N_s=sign * impulse,
                phase_rad=(frequency * when + phase) % (2.0 * math.pi),
                tooth_drive=met.drive,
                tooth_loose=met.loose,
                flight_height_m=self.flight.height,
                height_m=met.height,
                axial_impulse_N_s=impulse * met.leans,
            )
        )

    def _hold(self, longest: float) -> None:
        """Permanent contact: follow the flank; leave it when it would have to pull."""
        side = self.place - 1
        soft = softly(self.plant, self.time, self.settings.stick_velocity)
        duration, event, row = plan_contact(self.plant, self.teeth, side, self._here(), longest, soft)
        if duration > 0.0:
            self._follow(side, self.teeth[row : row + 1], duration)
        if event != HELD:
            self._leave(side)
        if event == MEETS:
            self._strike(side)

    def _follow(self, side: int, held: np.ndarray, duration: float) -> None:
        """Let Bullet go along with the flank, and put the loose gear on the held teeth."""
        until = self.time + duration
        theta, omega = on_flank(self.plant, held, side, until, self.theta + self.omega * duration)
        see_numbers(theta, omega, self.time)
        ends = np.array([(self.time, self.theta, self.omega), (until, theta, omega)])
        self.log.contact(self.plant, held, side, ends)
        self.world.step(duration, self.plant.inertia * (omega - self.omega) / duration)
        self.time, self.theta, self.omega = until, theta, omega
        self.steps += 1
        self._pose()
        if self._contact(1 - side)[0] < -TOUCH:
            raise jammed(self.time)
        self._see_depth(side, SUNK)

    def _see_depth(self, side: int, deepest: float) -> float:
        """Stop where the teeth of a side lie too deep in each other; return its gap [m]."""
        gap = self._contact(side)[0]
        if gap < -deepest:
            raise sunk(-gap, self.time, "give stiffer teeth" if self.settings.springs.size else "take shorter steps")
        return gap

    def _press(self, longest: float) -> None:
        """Compliant contact: one short step under the gap's own force; a passage that lasts is permanent contact."""
        side = self.place - 1
        springs, flight = self.settings.springs, self.flight
        mass = self.plant.inertia / self._contact(side)[2] ** 2
        longest = min(longest, self.settings.share * pressed_step(springs, mass))
        forces = Forces(AT_REST, (False, False), side, flight.pushing, side)
        duration, arc, impulse, end = plan_forced(self.plant, self.teeth, springs, forces, self._here(), (longest, 1.0))
        flight.impulse += impulse
        self._move(arc, duration)
        # only one flank has a force of its own here
        if self._see_depth(side, self.settings.deepest) < -TOUCH and self._contact(1 - side)[0] < -TOUCH:
            raise jammed(self.time)
        if not flight.stays and self.time - flight.began > lasting(springs, mass):
            flight.stays = True
            self._note(side, flight.began, (flight.entry, 0.0), -mass * flight.entry)
        if end == HALTS:
            self.omega = 0.0
            self._pose()
        elif end == FLIPS + side:
            flight.pushing = not flight.pushing
        elif end == CLEARS + side:
            if not flight.stays:
                self._note(side, flight.began, (flight.entry, self._contact(side)[1]), flight.impulse)
            self._leave(side)

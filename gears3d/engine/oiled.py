"""Located contact under oil: films push all the time, and passages through them stand for impacts.

A film turns most approaches back before the flanks touch. An impact is here a passage: the gap falls below the height
from which on the film is felt, and rises above it again; speed and rebound are those at that height, the impulse is
that of film and flank together. A gear that turns towards the flank a second time within a passage is in contact over
oil. With ever thinner oil all that goes over into impacts of the bare flanks.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gears3d.engine.closing import TOUCH, highest
from gears3d.engine.faults import jammed
from gears3d.engine.films import film_push
from gears3d.engine.forced import (
    AT_REST,
    CLEARS,
    ENTERS,
    FLIPS,
    HALTS,
    LEAVES,
    NOBODY,
    TOUCHES,
    TURNS,
    Forces,
    plan_forced,
)
from gears3d.engine.holding import on_flank
from gears3d.engine.located import NEAR, Flight, Located
from gears3d.engine.log import Meeting
from gears3d.engine.mesh import side_gap
from gears3d.engine.motion import drive_at
from gears3d.engine.pressing import pressed_step
from gears3d.engine.torques import FREE

HALVINGS = 100


@dataclass
class Passage:
    """What is remembered of a passage through the film of a flank.

    Args:
        flank: whose film it is, or NOBODY.
        began: when [s].
        entry: rate of the gap then [m/s].
        height: of the flight before [m].
        met: teeth that met then.
        impulse: of film and flank so far [N s].
        turned: whether the gap has opened since.
        stays: whether it has become contact over oil.
    """

    flank: int = NOBODY
    began: float = 0.0
    entry: float = 0.0
    height: float = 0.0
    met: Meeting | None = None
    impulse: float = 0.0
    turned: bool = False
    stays: bool = False


@dataclass
class Oiled(Located):
    """A run with oil between the flanks; everything as :class:`gears3d.engine.located.Located` has it.

    Args:
        passage: under way, or the last one.
        squeezed: whether the film of the active and of the reverse flank is being squeezed.
    """

    passage: Passage = field(default_factory=Passage)
    squeezed: list[bool] = field(default_factory=lambda: [False, False])

    def _begin_on(self, side: int) -> None:
        """Begin on the flank if its film does not bear the gear, else on the film, or where that ends."""
        self.theta, self.omega = on_flank(self.plant, self.teeth, side, 0.0, self.theta)
        self.flight.left = side
        self.passage = Passage(side, stays=True)
        force = self._reaction(side)
        if force >= 0.0:
            self.place = 1 + side
            if self.settings.springs.size:
                self.theta -= force / self.settings.springs[:, 0].sum() / self._contact(side)[2]
            return
        gap = self._floats_at(side, force)
        self.theta += gap / self._contact(side)[2]
        if gap >= self.plant.film.felt:
            self.passage = Passage()

    def _floats_at(self, side: int, force: float) -> float:
        """Return the gap at which the wedges bear what a flank that would have to pull leaves of its film [m].

        Args:
            side: 0 active, 1 reverse.
            force: of that flank [N].
        """
        film = self.plant.film
        angle, speed, _ = drive_at(self.plant.motion, 0.0)
        ends = [side_gap(self.plant.surfaces, self.teeth, flank, angle, self.theta) for flank in (0, 1)]
        whole, speeds = ends[1 - side][0], (speed, self.omega)

        def net(gap: float) -> float:
            ours = film_push(film, gap, 0.0, False, speeds)
            return ours - film_push(film, whole - gap, 0.0, False, speeds)

        load = force + net(0.0)
        if load <= 0.0:
            return film.felt
        low, high = 0.0, 0.5 * whole
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if net(middle) > load else (low, middle)
        return low

    def _go(self, longest: float) -> None:
        if self.place != FREE and not self.settings.springs.size:
            self._hold(longest)
        else:
            self._swim(longest)

    def _swim(self, longest: float) -> None:
        """One step under the films, and what it ends with."""
        springs, touching = self.settings.springs, self.place - 1 if self.place != FREE else NOBODY
        if touching != NOBODY:
            step = pressed_step(springs, self.plant.inertia / self._contact(touching)[2] ** 2)
            longest = min(longest, self.settings.share * step)
        forces = Forces(
            AT_REST, (self.squeezed[0], self.squeezed[1]), touching, self.flight.pushing, self.passage.flank
        )
        steps = longest, self.settings.share
        duration, arc, impulse, end = plan_forced(self.plant, self.teeth, springs, forces, self._here(), steps)
        top = highest(self.plant, self.teeth, self.flight.left, arc, duration)
        self.flight.height = max(self.flight.height, top)
        self.passage.impulse += impulse
        self._move(arc, duration)
        deep = touching != NOBODY and self._see_depth(touching, self.settings.deepest) < -TOUCH
        if deep and self._contact(1 - touching)[0] < -NEAR:
            raise jammed(self.time)
        self._happen(end - end % 2, end % 2) if end > HALTS else self._halt(end)

    def _halt(self, end: int) -> None:
        if end == HALTS:
            self.omega = 0.0
            self._pose()

    def _happen(self, event: int, side: int) -> None:
        """Change what an event at one of the flanks changes."""
        if event == TURNS:
            self._turn(side)
        elif event == TOUCHES:
            self._strike(side)
        elif event == FLIPS:
            self.flight.pushing = not self.flight.pushing
        elif event == CLEARS:
            self.place, self.flight.pushing = FREE, True
        elif event == ENTERS:
            rate = self._contact(side)[1]
            self.passage = Passage(side, self.time, rate, self.flight.height, self._meeting(side))
        elif event == LEAVES:
            self._pass()

    def _turn(self, side: int) -> None:
        """Begin or end the squeeze of a film; a second approach within a passage is contact over oil."""
        self.squeezed[side] = not self.squeezed[side]
        if self.passage.flank != side:
            return
        if not self.squeezed[side]:
            self.passage.turned = True
        elif self.passage.turned:
            self._capture()

    def _capture(self) -> None:
        """Write a passage down that has become contact; its rebound is 0."""
        passage = self.passage
        if not passage.stays:
            passage.stays = True
            mass = self.plant.inertia / self._contact(passage.flank)[2] ** 2
            self._write(0.0, -mass * passage.entry)

    def _write(self, rebound: float, impulse: float) -> None:
        passage = self.passage
        self.flight.height, flown = passage.height, self.flight.height
        self._note(passage.flank, passage.began, (passage.entry, rebound), impulse, passage.met)
        self.flight.height = flown

    def _pass(self) -> None:
        """End a passage, as an impact or as contact over oil."""
        passage = self.passage
        if passage.stays:
            self.contacts.append((passage.flank, passage.began, self.time))
        else:
            self._write(self._contact(passage.flank)[1], passage.impulse)
        self.flight = Flight(left=passage.flank)
        self.passage = Passage()

    def _strike(self, side: int) -> None:
        """The flanks themselves meet, amid a passage: their law of impacts acts, or they yield."""
        rate, lever = self._met(side)
        self.passage.turned = True
        if self.settings.springs.size:
            self.place, self.flight.pushing = 1 + side, True
            return
        _, self.omega, impulse = self._blow(side, rate, lever)
        self.passage.impulse += impulse
        self.squeezed[side] = False
        if self.place != FREE:
            self.theta, self.omega = on_flank(self.plant, self.teeth, side, self.time, self.theta)
            self._capture()
        self._pose()

    def _leave(self, side: int) -> None:
        """Leave the flank itself, still within its film."""
        self.place, self.squeezed[side] = FREE, False

    def _close(self) -> None:
        if self.passage.flank != NOBODY and self.passage.stays:
            self.contacts.append((self.passage.flank, self.passage.began, self.time))

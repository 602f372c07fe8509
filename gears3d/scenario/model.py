"""The scenario as everybody indoors sees it: frozen, SI, no units."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.scenario.gear_spec import Gears as Gears
from gears3d.scenario.gear_spec import GearSpec as GearSpec
from gears3d.scenario.gear_spec import Mount as Mount

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.gears.pair import Pair
    from gears3d.scenario.lubricated import Lubricated
    from gears3d.scenario.overrides import Overrides


@dataclass(frozen=True)
class Harmonic:
    """One sine of the drive's speed: amplitude·sin(2π·frequency·t + phase).

    Args:
        amplitude: rad/s.
        frequency: Hz.
        phase: rad.
        order: cycles per mean revolution of the drive when the frequency was given so.
    """

    amplitude: float
    frequency: float
    phase: float = 0.0
    order: float | None = None


@dataclass(frozen=True)
class Motion:
    """The imposed motion of the drive gear.

    Args:
        mean: rad/s.
        harmonics: added to the mean.
        record: file with a measured motion, which takes the place of mean and harmonics.
        bandwidth: up to where the record is smoothed, Hz.
    """

    mean: float
    harmonics: tuple[Harmonic, ...] = ()
    record: Path | None = None
    bandwidth: float | None = None


@dataclass(frozen=True)
class Drag:
    """Base drag: Coulomb ``torque`` on the loose gear, N·m."""

    torque: float


@dataclass(frozen=True)
class Impact:
    """Base impact law: Newton's ``restitution``, and the rebound ``stick_velocity`` below which contact lasts, m/s."""

    restitution: float
    stick_velocity: float


@dataclass(frozen=True)
class Start:
    """Where the loose gear is at t = 0: on the ``"active"`` or ``"reverse"`` flank, or ``"free"`` amid the gap."""

    state: str


@dataclass(frozen=True)
class Run:
    """What is simulated and kept.

    Args:
        duration: s.
        settle: left out of regime and comparison, s.
        output_rate: Hz.
        seed: of all random numbers.
    """

    duration: float
    settle: float
    output_rate: float
    seed: int


@dataclass(frozen=True)
class Sensor:
    """One encoder.

    Args:
        counts_per_revolution: edges; ``None``: exact.
        noise: standard deviation of the reading, rad.
    """

    counts_per_revolution: int | None = None
    noise: float = 0.0


@dataclass(frozen=True)
class Sensors:
    """Both encoders and their ``sample_rate``, Hz; ``stated``: whether it was given, and is no default."""

    sample_rate: float
    drive: Sensor
    loose: Sensor
    stated: bool = True


@dataclass(frozen=True, repr=False)
class Scenario:
    """Everything that is simulated, SI.

    Args:
        title: one line for people.
        source: where the numbers are from.
        gears: both gears.
        mount: their distance or backlash.
        motion: of the drive.
        drag: on the loose gear.
        impact: base impact law.
        start: state at t = 0.
        run: duration and output.
        sensors: encoders.
        lubricated: how teeth close and rub in the lubricated model; others do not read it.
        effects: what extends the base model, in order.
        expect: what must come out: ``regime`` and ``impacts_per_period``, those that were asked for.
        uncertainty: key path -> standard uncertainty in the key's SI unit.
        document: the resolved scenario as TOML text.
        path: its file; ``None`` when it came as text.
    """

    title: str
    source: str
    gears: Gears
    mount: Mount
    motion: Motion
    drag: Drag
    impact: Impact
    start: Start
    run: Run
    sensors: Sensors
    lubricated: Lubricated
    effects: tuple[Any, ...] = ()
    expect: dict[str, Any] = field(default_factory=dict, hash=False)
    uncertainty: dict[str, float] = field(default_factory=dict, hash=False)
    document: str = field(default="", repr=False)
    path: Path | None = None

    def __repr__(self) -> str:
        from gears3d.units import show

        teeth = f"{self.gears.drive.teeth}:{self.gears.loose.teeth} teeth"
        motion = self.motion
        turning = "recorded motion" if motion.record else show(motion.mean, "speed")
        sines = [f"{show(h.amplitude, 'speed')} at {show(h.frequency, 'frequency')}" for h in motion.harmonics]
        effects = [effect.kind for effect in self.effects]
        run = show(self.run.duration, "time")
        return f"Scenario({', '.join([repr(self.title), teeth, ' + '.join([turning, *sines]), run, *effects])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook
        from gears3d.units import show

        gear, other, motion = self.gears.drive, self.gears.loose, self.motion
        turning = "as recorded" if motion.record else show(motion.mean, "speed")
        sines = [f"{show(h.amplitude, 'speed')} at {show(h.frequency, 'frequency')}" for h in motion.harmonics]
        helix = f", helix {show(gear.helix_angle, 'angle')}" if gear.helix_angle else ""
        rows = [
            ("source", self.source),
            ("gears", f"{gear.teeth}:{other.teeth} teeth, module {show(gear.module, 'length')}{helix}"),
            ("backlash", show(self.pair().backlash, "length")),
            ("drive", " + ".join([turning, *sines])),
            ("drag", show(self.drag.torque, "torque")),
            ("restitution", show(self.impact.restitution, "ratio")),
            ("effects", ", ".join(effect.kind for effect in self.effects)),
            ("duration", show(self.run.duration, "time")),
        ]
        return notebook.table(self.title or "Scenario", rows)

    @property
    def period(self) -> float:
        """Period of the first harmonic, else of one drive revolution [s]; the duration when nothing turns."""
        return period(self.motion) or self.run.duration

    def pair(self) -> Pair:
        """Return the meshing pair as it is mounted, with the deviations of its profiles; without those of effects."""
        return self._pair

    @cached_property
    def _pair(self) -> Pair:
        from gears3d.scenario.meshing import mesh

        return mesh(self.gears, self.mount)

    def rig(self) -> Rig:
        """Return the base model's constants."""
        from gears3d.effects import Rig

        pair = self.pair()
        assert self.gears.loose.inertia is not None
        return Rig(
            base_radius_drive=pair.drive.base_radius,
            base_radius_loose=pair.loose.base_radius,
            inertia=self.gears.loose.inertia,
            drag_torque=self.drag.torque,
            backlash=pair.backlash,
            restitution=self.impact.restitution,
            mean_speed=self.motion.mean,
            teeth_drive=self.gears.drive.teeth,
            teeth_loose=self.gears.loose.teeth,
            working_pressure_angle=pair.working_pressure_angle,
            base_helix_angle=abs(pair.drive.base_helix_angle),
            face_width=min(self.gears.drive.face_width, self.gears.loose.face_width),
            contact_ratio=pair.contact_ratio,
        )

    def rows(self) -> tuple[Row, ...]:
        """Return the normal forms of all effects; base drag and restitution are not among them."""
        rig = self.rig()
        return tuple(row for effect in self.effects for row in effect.rows(rig))

    def with_(self, overrides: Overrides) -> Scenario:
        """Return the scenario with some values changed.

        Args:
            overrides: ``{"motion.mean": "90 rpm"}``, pairs, or ``"KEY=VALUE"`` texts.

        Raises:
            InputError: the result is bad; carries every fault.
        """
        from gears3d.scenario.build import build
        from gears3d.scenario.document import read_text
        from gears3d.scenario.overrides import apply

        document = read_text(self.document, self.path)
        apply(document, overrides)
        return build(document)


def period(motion: Motion) -> float | None:
    """Return the period of the first harmonic, else of one drive revolution [s]; ``None`` when nothing turns.

    Args:
        motion: of the drive.
    """
    if motion.harmonics:
        return 1 / motion.harmonics[0].frequency
    return 2 * pi / abs(motion.mean) if motion.mean else None

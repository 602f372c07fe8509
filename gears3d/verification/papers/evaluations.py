"""Candidate causes of the open questions, and the published figure of each question with a cause at some size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from math import inf, nan, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects import catalogue
from gears3d.verification.papers.measures.excitation import excitation
from gears3d.verification.papers.measures.tooth_errors import disconnections, shift

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.verification.papers.bench import Bench


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A candidate cause: an effect, a harmonic of the drive's speed, or the inertia of the rig, by its size.

    A parameter of ``effect`` is a literal, or a list whose product it is: numbers, ``"size"``, ``"phase"``, a quantity
    of the rig, or ``"1/..."`` of one of these.
    """

    name: str
    unit: str
    bound: float
    because: str
    effect: Mapping[str, Any] = field(default_factory=dict)
    harmonic: int = 0
    inertia: bool = False
    phases: int = 1
    steps: int = 12
    note: str = ""

    def effects(self, rig: Rig, size: float, phase: float) -> list[Any]:
        """Return the effect of a size and a phase [rad] on a rig; none without a size."""
        if not self.effect or not size:
            return []
        values = {key: _value(given, rig, size, phase) for key, given in self.effect.items() if key != "kind"}
        if ratio := values.pop("damping_ratio", 0.0):
            values["damping"] = 2 * ratio * sqrt(values["stiffness"] * rig.inertia) / rig.base_radius_loose
        return [catalogue()[self.effect["kind"]](**values)]

    def rig(self, rig: Rig, size: float) -> Rig:
        """Return the rig, with larger inertia where that is the cause."""
        return replace(rig, inertia=rig.inertia * (1 + size)) if self.inertia else rig

    def drive(self, first: Sequence[float], size: float, phase: float) -> list[tuple[float, float, float]]:
        """Return the drive's first harmonic, and that of the cause: amplitude [rad/s], frequency [Hz], phase [rad]."""
        speed, frequency, start = first
        own = [(size * speed, self.harmonic * frequency, pi / 2 + phase)] if self.harmonic and size else []
        return [(speed, frequency, start), *own]


def _value(given: Any, rig: Rig, size: float, phase: float) -> Any:
    if not isinstance(given, list):
        return given
    product, known = 1.0, {"size": size, "phase": phase}
    for factor in given:
        if isinstance(factor, str):
            name = factor.removeprefix("1/")
            value = known[name] if name in known else float(getattr(rig, name))
            product *= value if name == factor else 1.0 / value
        else:
            product *= factor
    return product


class Evaluation:
    """Values with a cause at a size and a phase, the scalar that is solved for, and whether all statements hold."""

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return the values that stand in the table."""
        raise NotImplementedError

    def scalar(self, found: np.ndarray) -> float:
        """Return what is compared with the target."""
        raise NotImplementedError

    def holds(self, found: np.ndarray) -> bool:
        """Return whether the values meet everything that the paper states."""
        raise NotImplementedError

    def text(self, found: np.ndarray) -> str:
        """Return the values as text."""
        raise NotImplementedError

    def also(self, bench: Bench, cause: Cause, size: float, phase: float) -> tuple[bool, str]:
        """Return whether a further statement of the paper holds at the size found, and its values as text."""
        raise NotImplementedError


class LossOfContact(Evaluation):
    """Kadmiri et al. 2012, table 1: Λ at the loss of contact for four mean speeds."""

    SPEEDS, PRINTED = (250, 500, 750, 1000), (0.35, 0.34, 0.37, 0.34)
    SCATTER = 0.06  # a speed may be this far from its printed Λ: twice the scatter of the four
    UNNOTICED = 5e-8  # lower flights are no loss [m]

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return Λ for the four speeds, with the claimed drag, inertia and first harmonic."""
        return np.array([self._lost(bench, speed, cause, size, phase) for speed in self.SPEEDS])

    def _lost(self, bench: Bench, speed: int, cause: Cause, size: float, phase: float) -> float:
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        case = bench.case(f"kadmiri-2012/table1-{speed}rpm")
        first = case.scenario.motion.harmonics[0]
        effects, rig = cause.effects(case.rig, size, phase), cause.rig(case.rig, size)
        hidden = sum(e.amplitude * e.order * rig.mean_speed / first.amplitude for e in effects if e.place == "sensor")
        rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
        unit = excitation(case)
        periods = 40.0 if any(hasattr(effect, "order") for effect in effects) else 5.0
        low, high = 0.02 / unit, 3.0 / unit
        for _ in range(11):
            middle = 0.5 * (low + high)
            drive = cause.drive((middle * first.amplitude, first.frequency, first.phase), size, phase)
            impacts = run(model(rig, drive, rows), periods / first.frequency).impacts
            low, high = (low, middle) if (impacts[:, 6] > self.UNNOTICED).any() else (middle, high)
        return (0.5 * (low + high) - hidden) * unit

    def scalar(self, found: np.ndarray) -> float:
        """Return the mean."""
        return float(found.mean())

    def holds(self, found: np.ndarray) -> bool:
        """Return whether every speed is near its own."""
        return bool(np.abs(found - self.PRINTED).max() < self.SCATTER)

    def text(self, found: np.ndarray) -> str:
        """Return the four."""
        return ", ".join(f"{each:.2f}" if each < inf else "–" for each in found)


class ImpactSpeeds(Evaluation):
    """Rigaud & Perret-Liaudet 2020, fig. 5: impact speeds on both flanks, and the threshold of fig. 4."""

    CASE = "rigaud-2020/fig5-20rpm"
    ACTIVE, REVERSE = 22.3, 19.9  # printed mean impact speeds [mm/s]
    THRESHOLD, SCATTER = 1.09, 0.19  # printed Λ* and its standard deviation
    PERIODS, SETTLED = 22, 2
    DRIFT = 30.1 * pi / 30  # mean speed [rad/s]: off 30 rpm, so that the mesh drifts past the excitation as on a rig
    BACKLASHES = np.geomspace(80e-6, 2e-3, 8)  # tried [m]; 2 mm is the rig's largest
    UNNOTICED = 1e-6  # lower flights are no rattle [m]

    def speeds(self, bench: Bench, cause: Cause, size: float, phase: float, backlash: float) -> tuple[float, float]:
        """Return the mean speeds of the impacts after crossings on active and reverse flank, both positive [mm/s]."""
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        elastic = cause.name.startswith("restitution")
        rig = replace(
            bench.case(self.CASE).rig,
            backlash=backlash,
            restitution=0.3 if elastic else 0.0,
            mean_speed=self.DRIFT,
        )
        effects = cause.effects(rig, size, phase)
        rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
        drive = cause.drive((20 * pi / 30, 3.0, 0.0), size, phase)
        impacts = run(model(rig, drive, rows), self.PERIODS / 3.0).impacts
        crossed = np.flatnonzero(np.diff(impacts[:, 1])) + 1
        settled = impacts[crossed[impacts[crossed, 0] > self.SETTLED / 3.0]]
        # A late reading shows an earlier speed of the loose gear: in flight it differs by the drag over the delay.
        late = sum(e.delay for e in effects if e.kind == "encoder_skew") * rig.drag_torque / rig.inertia
        late *= rig.base_radius_loose
        both = (-settled[settled[:, 1] == 0.0, 2] - late, settled[settled[:, 1] == 1.0, 2] + late)
        active, reverse = (1e3 * float(each.mean()) if len(each) else nan for each in both)
        return active, reverse

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return both speeds [mm/s] at the backlash that gives the active flank its own, and that backlash [µm]."""
        from scipy.optimize import brentq

        def error(backlash: float) -> float:
            return self.speeds(bench, cause, size, phase, backlash)[0] - self.ACTIVE

        before = error(self.BACKLASHES[0])
        for low, high in pairwise(self.BACKLASHES):
            after = error(high)
            if before <= 0.0 <= after:
                backlash = float(brentq(error, low, high, xtol=2e-7))  # type: ignore[arg-type]
                return np.array([*self.speeds(bench, cause, size, phase, backlash), 1e6 * backlash])
            before = after
        return np.full(3, nan)

    def scalar(self, found: np.ndarray) -> float:
        """Return the speed on the reverse flank."""
        return float(found[1])

    def holds(self, found: np.ndarray) -> bool:
        """Return whether both speeds are the printed ones."""
        return bool(abs(found[0] - self.ACTIVE) < 0.1 and abs(found[1] - self.REVERSE) < 0.1)

    def text(self, found: np.ndarray) -> str:
        """Return both speeds and the backlash."""
        return f"{found[0]:.1f}, −{found[1]:.1f}; {found[2]:.0f} µm" if found[0] > 0 else "none gives 22.3"

    def also(self, bench: Bench, cause: Cause, size: float, phase: float) -> tuple[bool, str]:
        """Return whether the threshold at 3 Hz is still the printed one at 30 and 90 rpm, and the two."""
        from gears3d.lumped.model import model
        from gears3d.lumped.run import run

        found = []
        for mean in (self.DRIFT, 3 * self.DRIFT):
            rig = replace(bench.case(self.CASE).rig, restitution=0.0, mean_speed=mean)
            effects = cause.effects(replace(rig, mean_speed=self.DRIFT), size, phase)
            rows = [row for effect in effects if effect.place != "sensor" for row in effect.rows(rig)]
            unit = rig.inertia * 2 * pi * 3.0 / rig.drag_torque
            low, high = 0.01, 3.0
            for _ in range(9):
                middle = 0.5 * (low + high)
                drive = cause.drive((middle / unit, 3.0, 0.0), size, phase)
                impacts = run(model(rig, drive, rows), self.PERIODS / 3.0).impacts
                low, high = (low, middle) if (impacts[:, 6] > self.UNNOTICED).any() else (middle, high)
            found.append(0.5 * (low + high))
        good = bool(np.abs(np.array(found) - self.THRESHOLD).max() < 2 * self.SCATTER)
        return good, ", ".join(f"{each:.2f}" if each > 0.02 else "0" for each in found)


class ContourShift(Evaluation):
    """Ottewill et al. 2010, fig. 9: shift of the contours of case iv, and how similar they are when shifted back."""

    CASE = "ottewill-2010/case-iv"
    AMPLITUDES, PHASES = (0.40, 0.44), tuple(2 * pi * i / 16 for i in range(16))  # of the compared contours [rad]
    ALIKE = 0.5  # correlation with the model's contour from which on the general shape is the same

    def drawn(self, bench: Bench, cause: Cause | None = None, size: float = 0.0, phase: float = 0.0) -> np.ndarray:
        """Return the disconnections of case iv with a cause [rad], (2, 16)."""
        case = bench.case(self.CASE)
        more = cause.effects(case.rig, size, phase) if cause else []
        points = [(amplitude, turn) for amplitude in self.AMPLITUDES for turn in self.PHASES]
        return disconnections(case, points, more=more).reshape(len(self.AMPLITUDES), len(self.PHASES))

    def values(self, bench: Bench, cause: Cause, size: float, phase: float) -> np.ndarray:
        """Return the shift [rad] and the correlation when shifted back."""
        plain = bench.once("ottewill-2010 findings", lambda: self.drawn(bench))
        other = self.drawn(bench, cause, size, phase)
        if not (np.ptp(plain) > 0.0 and np.ptp(other) > 0.0):
            return np.zeros(2)
        moved = shift(plain, other)
        steps = round(moved / (2 * pi) * len(self.PHASES))
        each = [np.corrcoef(np.roll(plain, way * steps, axis=1).ravel(), other.ravel())[0, 1] for way in (1, -1)]
        return np.array([moved, max(each)])

    def scalar(self, found: np.ndarray) -> float:
        """Return the shift of a contour of the same shape."""
        return float(found[0]) if found[1] > self.ALIKE else 0.0

    def holds(self, found: np.ndarray) -> bool:
        """Return whether the shift is π within 0.5 and the shape is kept."""
        return bool(pi - found[0] <= 0.5 and found[1] > self.ALIKE)

    def text(self, found: np.ndarray) -> str:
        """Return both."""
        return f"{found[0]:.1f}; {found[1]:.2f}"


EVALUATIONS: dict[str, Evaluation] = {
    "loss_of_contact": LossOfContact(),
    "impact_speeds": ImpactSpeeds(),
    "contour_shift": ContourShift(),
}

"""Faults that nobody told: the engine finds them, the twin cannot.

One tooth is made thicker on the solid alone. What its impacts must then do follows in closed form from the equations of
flight (Rigaud & Perret-Liaudet 2020, eqs 15 and 18) with the backlash less the extra material.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gears3d.comparison import compare
from gears3d.gears import ToothDeviation
from gears3d.laws import crossing, loss_phases
from gears3d.recording import Recording
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5, swing
from gears3d.verification.validation.check import Check

EXTRA = 10e-6  # Material on each of the two flanks of the faulty tooth [m]: it is 20 µm thicker


@dataclass(frozen=True)
class ThickTooth:
    """One thick tooth, told to nobody."""

    sound: Recording  # the engine's recording with perfect gears
    faulty: Recording  # the engine's recording with the thick tooth
    twin: Recording  # the untold twin's
    tooth: int  # its number in order of meshing
    moved: tuple[float, float]  # closed-form change of the time of its first impact [s] and of its speed [m/s]

    @property
    def found(self) -> tuple[float, float]:
        """Measured change of the time [s] and the speed [m/s] of the first impact."""
        change = [self.faulty.impacts[name][0] - self.sound.impacts[name][0] for name in ("time_s", "velocity_m_s")]
        return float(change[0]), float(change[1])


def thick_tooth() -> ThickTooth:
    """Run figure 5 with a loose gear whose tooth at the first reverse impact is 20 µm thicker."""
    scenario = fig5()
    sound = simulate(scenario)
    tooth = int(sound.impacts["tooth_loose"][0])
    fault = [ToothDeviation("loose", flank, tooth, EXTRA) for flank in ("active", "reverse")]
    faulty = simulate(scenario, pair=scenario.pair().with_deviations(*fault))
    return ThickTooth(sound, faulty, simulate(scenario, "rigid"), tooth, closed_form(EXTRA))


def closed_form(extra: float) -> tuple[float, float]:
    """Return how the first reverse impact moves when the gap is narrower at its end.

    Args:
        extra: material on the reverse flank [m].

    Returns:
        Change of its time [s] and of its approach speed [m/s].
    """
    scenario = fig5()
    drive, backlash = swing(scenario), scenario.rig().backlash
    phase, _ = loss_phases(drive.excitation)
    sound, faulty = (crossing(drive.speed, drive.omega, drive.pull, phase, gap) for gap in (backlash, backlash - extra))
    return faulty[0] - sound[0], faulty[1] - sound[1]


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    case = thick_tooth()
    for name, found, expected, unit in zip(("time", "speed"), case.found, case.moved, ("s", "m/s"), strict=True):
        yield Check(
            f"thick tooth: {name} of its impact moves by {expected:.3e} {unit}, relative error",
            abs(found / expected - 1),
            1e-3,
        )
    untold = compare(case.sound, case.twin).to_dict()
    told = compare(case.faulty, case.twin).to_dict()
    yield Check("sound gears against the twin: 95 % of the speed errors", untold["velocity_error_p95"], 0.006)
    yield Check(
        "thick tooth against the untold twin: 95 % of the speed errors", told["velocity_error_p95"], 0.01, at_least=True
    )

"""Virtual tests of a rig in the engine recover what was imposed: threshold and transmission error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from gears3d.bench import StaticError, static_error, thresholds
from gears3d.gears import quasi_static
from gears3d.scenario import Scenario
from gears3d.scenario.models import flank_deviations
from gears3d.verification.validation.check import Check, fig5

TORQUES = (0.22, 0.46, 0.75)  # N m
MEANS = (30, 90)  # rpm
FREQUENCIES = (0.75, 1.7, 3.0)  # Hz
WAVE = {"kind": "transmission_error", "order": 20, "amplitude": "30 um"}


def check_threshold(quick: bool = False) -> Iterator[Check]:
    """Slow sweeps in the engine lose contact where the master curve says.

    The gap must open by more than 0.1 um; Rigaud & Perret-Liaudet 2020, figs 3 and 4 and eq. (6).
    """
    for torque in TORQUES[:1] if quick else TORQUES:
        for mean in MEANS[:1] if quick else MEANS:
            scenario = fig5(drag__torque=f"{torque} N m", motion__mean=f"{mean} rpm")
            found = thresholds(scenario, FREQUENCIES[-1:] if quick else FREQUENCIES, span=(0.93, 1.08), periods=42)
            for name in ("up", "down"):
                off = max(abs(getattr(one, name) - 1.0) for one in found.sweeps)
                yield Check(f"{torque} N m, {mean} rpm: excitation at which contact is lost, {name}: off 1", off, 0.02)
            if len(found.sweeps) > 1:
                yield Check(f"{torque} N m, {mean} rpm: slope off -1", abs(found.slope + 1.0), 0.01)
    if not quick:
        (one,) = thresholds(fig5(effect=[WAVE])).sweeps
        yield Check("wave of order 20, 30 um: excitation that riding on it asks for", one.predicted, 0.9)
        yield Check("wave of order 20, 30 um: contact is lost off that", abs(one.up - one.predicted), 0.03)


BOUND = 1e-7  # 0.1 um
# Few teeth on the bench of figure 5, so that a revolution takes seconds
SMALL = {
    "gears.module": "12 mm", "gears.face_width": "30 mm", "gears.drive.teeth": 20, "gears.loose.teeth": 20,
    "mount.backlash": "150 um", "drag.torque": "0.5 N m", "motion.mean": "200 rpm",
}  # fmt: skip
WAVES = (
    {"kind": "transmission_error", "order": 2, "amplitude": "30 um", "phase": "0.4 rad"},
    {"kind": "transmission_error", "order": 90, "amplitude": "1.5 um", "phase": "1 rad", "flank": "active"},
)
OFFSET, PHASE = 30e-6, 0.7  # Of eccentric teeth: m and rad


def turned(*effects: dict[str, Any]) -> tuple[Scenario, StaticError]:
    """Return a bench with effects, and the result of a revolution each way."""
    scenario = fig5().with_({**SMALL, "effect": list(effects)})
    return scenario, static_error(scenario, turns=1.0)


def rms(difference: np.ndarray) -> float:
    """Return the root mean square.

    Shapes: ``difference`` (n,).
    """
    return float(np.sqrt(np.mean(difference**2)))


def waves() -> Iterator[Check]:
    """Give the checks of waves, which are their own closed form."""
    scenario, found = turned(*WAVES)
    both = 30e-6 * np.cos(2 * found.theta + 0.4)
    active = both + 1.5e-6 * np.cos(90 * found.theta + 1.0)
    case = "waves of order 2 on both flanks and 90 on the active one"
    yield Check(f"{case}: phi off, rms", rms(found.phi - active), BOUND, "m")
    yield Check(f"{case}: psi off, rms", rms(found.psi - both - scenario.pair().backlash), BOUND, "m")


def perfect() -> Iterator[Check]:
    """Give the check of perfect gears."""
    scenario, found = turned()
    off = float(np.abs(found.backlash - scenario.pair().backlash).max())
    yield Check("perfect gears: backlash over a revolution off", off, BOUND, "m")


def pitch_errors() -> Iterator[Check]:
    """Give the checks of pitch deviations, against gears rolled on their surfaces."""
    sizes = np.random.default_rng(5).normal(0.0, 4.0, 12)
    where = [(gear, flank, tooth) for gear in ("drive", "loose") for flank in ("active", "reverse")
             for tooth in (2, 9, 17)]  # fmt: skip
    effects = [
        {"kind": "pitch_error", "gear": gear, "flank": flank, "tooth": tooth, "offset": f"{size:.3f} um"}
        for (gear, flank, tooth), size in zip(where, sizes, strict=True)
    ]
    scenario, found = turned(*effects)
    exact = quasi_static(scenario.pair().with_deviations(*flank_deviations(scenario.rows())), found.theta)
    yield Check("pitch errors of twelve flanks: phi off, rms", rms(found.phi - exact.phi_active), BOUND, "m")
    yield Check("pitch errors of twelve flanks: backlash off, rms", rms(found.backlash - exact.backlash), BOUND, "m")


def eccentric(gear: str) -> Iterator[Check]:
    """Give the checks of eccentric teeth, against the closed forms of first order in the offset."""
    scenario, found = turned({"kind": "eccentricity", "gear": gear, "offset": f"{OFFSET} m", "phase": f"{PHASE} rad"})
    pair = scenario.pair()
    sense = 1.0 if gear == "drive" else -1.0
    tilt = sense * pair.working_pressure_angle
    # the loose gear's own angle runs ahead by its displacement
    ahead = [0.0 if gear == "drive" else curve / pair.loose.base_radius for curve in (found.phi, found.psi)]
    active, reverse = (found.theta + PHASE + more for more in ahead)
    phi, psi = (sense * OFFSET * np.sin(angle + lean) for angle, lean in ((active, tilt), (reverse, -tilt)))
    opened = -2.0 * OFFSET * np.cos(0.5 * (active + reverse)) * np.sin(pair.working_pressure_angle)
    case = f"{gear} gear 30 um eccentric"
    yield Check(f"{case}: phi off, rms", rms(found.phi - phi), BOUND, "m")
    yield Check(f"{case}: psi off, rms", rms(found.psi - pair.backlash - psi), BOUND, "m")
    off = float(np.abs(found.backlash - pair.backlash - opened).max())
    yield Check(f"{case}: backlash over a revolution off, anywhere", off, BOUND, "m")


def check_ste(quick: bool = False) -> Iterator[Check]:
    """The virtual test of the transmission error recovers what was imposed: waves, pitch errors, eccentric teeth.

    Slow turns both ways in the engine, as Rigaud & Perret-Liaudet 2020, section 3, measure their gears.
    """
    yield from waves()
    yield from eccentric("drive")
    if not quick:
        yield from eccentric("loose")
        yield from perfect()
        yield from pitch_errors()

"""Backlash from contact with both flanks: its mean and its orders, with intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.contact import read_contacts
from gears3d.identify.eccentric import eccentric_axes
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.rolling import (
    COUNTED,
    Rolled,
    amplitude_and_phase,
    effect,
    goodness,
    roll,
    strongest,
    warnings,
)
from gears3d.identify.transmission import curves

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted


def identify_backlash(records: Sequence[Admitted]) -> Identified:
    """Identify the mean backlash and its variation, the distance of the reverse from the active flank.

    Args:
        records: slow turns both ways, or rattle that strikes both flanks, each with its rig.

    Returns:
        ``backlash`` [m], ``<gear>_<order>_amplitude`` [m] and ``..._phase`` [rad] of its orders.

    Raises:
        InputError: no rig, or one of the flanks was not seen in any of the records.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2.

    >>> from gears3d.measured.checks import Admitted
    >>> from gears3d.measured.readers import Channels
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> bench = load("scenarios/rigaud-2020/fig2.toml")
    >>> seen = record(bench, "ste", turns=2).signals
    >>> found = identify_backlash([Admitted(Channels(seen), bench, (), "")])
    >>> list(found.parameters), round(1e6 * found.parameters["backlash"].value, 1)
    (['backlash'], 250.0)
    """
    return backlash(roll(read_contacts(records)), records[0].file)


def backlash(rolled: Rolled, file: str = "") -> Identified:
    """Return the backlash between flanks that were rolled on.

    Args:
        rolled: both flanks.
        file: named in faults.

    Raises:
        InputError: one of the flanks was not seen.
    """
    from scipy.stats import t as student

    active, reverse = rolled.fits
    both = sorted(set(active.offsets) & set(reverse.offsets)) if active and reverse else []
    if active is None or reverse is None or not both:
        remedy = "turn the drive slowly forth and back in one record, or record rattle that strikes both flanks"
        raise InputError(Fault("theta_drive_rad", "shows one flank only: no backlash follows", remedy, file))
    widths = [reverse.offsets[file] - active.offsets[file] for file in both]
    mean = float(np.mean(widths))
    if mean <= 0.0:
        what = f"puts the reverse flank {-1e6 * mean:.4g} um below the active one"
        raise InputError(
            Fault(
                "theta_loose_rad",
                what,
                "check which gear drives, and its sense of rotation",
                file,
            )
        )
    freedom = min(active.freedom, reverse.freedom)
    error = float(np.hypot(active.offset_deviation, reverse.offset_deviation) / np.sqrt(len(both)))
    counting = float(np.sqrt(sum(one**2 for side in rolled.contacts.shifts for one in side))) / len(both)
    reach = float(np.hypot(student.ppf(0.975, freedom) * error, student.ppf(0.975, freedom) * counting))
    parameters = {"backlash": Parameter(mean, "m", mean - reach, mean + reach)}
    phasors = reverse.phasors - active.phasors
    covariance = active.covariance + reverse.covariance
    chance = np.array([_chance(z, covariance[2 * i : 2 * i + 2, 2 * i : 2 * i + 2]) for i, z in enumerate(phasors)])
    real = (chance < rolled.level) & (np.abs(phasors - reverse.counted + active.counted) >= COUNTED * np.abs(phasors))
    told = strongest(rolled, np.abs(phasors), real)
    snippet = ["[mount]", f'backlash = "{1e6 * mean:.6g} um"']
    for place in told:
        line, block = active.lines[place], covariance[2 * place : 2 * place + 2, 2 * place : 2 * place + 2]
        size, phase = amplitude_and_phase(complex(phasors[place]), block, rolled.half_count(line), freedom)
        parameters[f"{line.name}_amplitude"], parameters[f"{line.name}_phase"] = size, phase
        snippet += _variation(line, complex(phasors[place]))
    axes = eccentric_axes(rolled)
    more: dict[str, Any] = {"eccentricity": [axis.to_dict() for axis in axes]}
    more["counting_m"] = counting
    more["shift_per_skew_m_s"] = 2.0 * rolled.contacts.radii[0] * rolled.contacts.speed
    text = "\n".join(snippet) + "\n" + "".join(axis.comment() for axis in axes)
    return Identified("backlash", parameters, goodness(rolled) | more, text, curves(rolled), tuple(warnings(rolled)))


def _chance(phasor: complex, block: np.ndarray) -> float:
    part = np.array([phasor.real, phasor.imag])
    return float(np.exp(-0.5 * part @ np.linalg.solve(block, part)))


def _variation(line: Any, phasor: complex) -> list[str]:
    """Return effects that move the reverse flank alone; over the loose gear's angle it takes two."""
    if line.gear == 0:
        return effect("backlash_variation", line, phasor)
    both = effect("transmission_error", line, phasor)
    return [*both, *effect("transmission_error", line, -phasor, 'flank = "active"')]

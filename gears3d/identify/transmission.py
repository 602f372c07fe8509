"""Transmission error of both flanks, and the backlash between them, from contact."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.contact import read_contacts
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.rolling import (
    COUNTED,
    Rolled,
    amplitude_and_phase,
    counted,
    curve,
    eccentric_axes,
    effect,
    goodness,
    roll,
    strongest,
    warnings,
)
from gears3d.signals.orders import chances

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted

FLANKS = ("active", "reverse")
WIDE = 0.02  # half width of the interval over the backlash from which on other ways are named


def identify_transmission_error(records: Sequence[Admitted]) -> Identified:
    """Identify the transmission error of active and reverse flank over the orders of both gears.

    Orders are sought on the angles of both gears at once; the 21 strongest of the significant ones are reported.

    Args:
        records: slow turns, best both ways, or rattle, each with its rig; several share the zeros of their angles.

    Returns:
        Parameters ``<flank>_<gear>_<order>_amplitude`` [m] and ``..._phase`` [rad]: the flank is at
        amplitude·cos(order·θ + phase), θ as the record counts it.

    Raises:
        InputError: no rig, or no contact.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2; Ottewill et al. 2010, eq. (11).
    Theory: docs/theory/identification.md, equation (3).

    >>> from gears3d.measured.checks import Admitted
    >>> from gears3d.measured.readers import Channels
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> bench = load("scenarios/rigaud-2020/fig2.toml")
    >>> seen = record(bench, "transmission-error", turns=2).signals
    >>> found = identify_transmission_error([Admitted(Channels(seen), bench, (), "")])
    >>> [round(1e6 * found.parameters[f"active_drive_{order}_amplitude"].value, 1) for order in (1, 90)]
    [50.0, 5.0]
    """
    return transmission_error(roll(read_contacts(records)))


def transmission_error(rolled: Rolled) -> Identified:
    """Return the transmission error of flanks in rolling contact.

    Args:
        rolled: both flanks.
    """
    parameters: dict[str, Parameter] = {}
    orders: list[dict[str, Any]] = []
    left_out: list[dict[str, Any]] = []
    for name, fitted in zip(FLANKS, rolled.fits, strict=True):
        if fitted is None:
            continue
        counts = counted(fitted)
        for place in np.flatnonzero(counts & (fitted.chance < rolled.level)):
            line = fitted.lines[place]
            size = float(abs(fitted.phasors[place]))
            left_out.append({"flank": name, "gear": line.name.split("_")[0], "order": line.order, "amplitude_m": size})
        real = (fitted.chance < rolled.level) & ~counts
        for place in strongest(rolled, np.abs(fitted.phasors), real):
            line, phasor = fitted.lines[place], complex(fitted.phasors[place])
            block = fitted.covariance[2 * place : 2 * place + 2, 2 * place : 2 * place + 2]
            size, phase = amplitude_and_phase(phasor, block, rolled.half_count(line), fitted.freedom)
            parameters[f"{name}_{line.name}_amplitude"] = size
            parameters[f"{name}_{line.name}_phase"] = phase
            either = rolled.lines.alike.get(line)
            orders.append(
                {
                    "flank": name,
                    "gear": line.name.split("_")[0],
                    "order": line.order,
                    "or": either.name if either else None,
                    "chance": float(min(fitted.chance[place] * 2 * len(rolled.lines.all), 1.0)),
                }
            )
    axes = eccentric_axes(rolled)
    told: dict[str, Any] = goodness(rolled) | {
        "orders": orders,
        "counting": left_out,
        "eccentricity": [axis.to_dict() for axis in axes],
    }
    notes = warnings(rolled)
    if left_out:
        names = ", ".join(f"{one['flank']} {one['gear']}_{one['order']}" for one in left_out)
        why = "a count rate commensurate with the sampling rate makes such lines: change the sampling rate or the speed"
        notes.append(f"excluded: {names} ({1e9 * max(one['amplitude_m'] for one in left_out):.2g} nm at most): {why}")
    if not parameters:
        notes.append("no order exceeds the noise")
    if rolled.fits[1] is None and parameters:
        notes.append('the snippet moves both flanks equally (flank = "both"): an assumption')
    if _differs(rolled):
        notes.append("the reverse flank differs from the active one: add what `identify backlash` prints")
    snippet = _snippet(rolled) + "".join(axis.comment() for axis in axes)
    return Identified("transmission_error", parameters, told, snippet, curves(rolled), tuple(notes))


def _differs(rolled: Rolled) -> bool:
    first, second = rolled.fits
    if first is None or second is None or not len(first.phasors):
        return False
    apart = np.abs(first.phasors - second.phasors)
    return bool((apart**2 / (2.0 * (first.deviation**2 + second.deviation**2)) > -np.log(rolled.level)).any())


def _snippet(rolled: Rolled) -> str:
    """Return the orders as effects; θ = 0 is the zero of the record."""
    flank = 0 if rolled.fits[0] is not None else 1
    fitted = rolled.fits[flank]
    lines = ["# phases count from the zero of the record's angles"]
    if fitted is None:
        return lines[0] + "\n"
    real = (fitted.chance < rolled.level) & ~counted(fitted)
    for place in strongest(rolled, np.abs(fitted.phasors), real):
        lines += effect("transmission_error", fitted.lines[place], complex(fitted.phasors[place]))
    return "\n".join(lines) + "\n"


def curves(rolled: Rolled) -> dict[str, Any]:
    """Return what the picture shows: of each flank its curve and its orders with noise floor."""
    made: dict[str, Any] = {}
    ratio = rolled.contacts.teeth[0] / rolled.contacts.teeth[1]
    for flank, (name, fitted) in enumerate(zip(FLANKS, rolled.fits, strict=True)):
        if fitted is None:
            continue
        own = [line.order * (ratio if line.gear else 1.0) for line in fitted.lines]
        made[name] = {
            "curve": curve(rolled, flank),
            "frequency": rolled.lines.frequency,
            "seen": fitted.seen,
            "floor": fitted.floor,
            "found": np.array(own),
            "found_size": np.abs(fitted.phasors),
            "found_deviation": fitted.deviation,
            "loose": np.array([line.gear == 1 for line in fitted.lines], bool),
        }
    return made


def identify_backlash(records: Sequence[Admitted]) -> Identified:
    """Identify the mean backlash and its variation, the distance of the reverse from the active flank.

    Args:
        records: slow turns both ways, or rattle with impacts on both flanks, each with its rig.

    Returns:
        ``backlash`` [m], ``<gear>_<order>_amplitude`` [m] and ``..._phase`` [rad] of its orders.

    Raises:
        InputError: no rig, or one of the flanks was not seen in any of the records.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2.
    Theory: docs/theory/identification.md, equation (3).

    >>> from gears3d.measured.checks import Admitted
    >>> from gears3d.measured.readers import Channels
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> bench = load("scenarios/rigaud-2020/fig2.toml")
    >>> seen = record(bench, "transmission-error", turns=2).signals
    >>> found = identify_backlash([Admitted(Channels(seen), bench, (), "")])
    >>> list(found.parameters), round(1e6 * found.parameters["backlash"].value, 1)
    (['backlash'], 250.0)
    """
    return backlash(roll(read_contacts(records)), records[0].file)


def backlash(rolled: Rolled, file: str = "") -> Identified:
    """Return the backlash between both flanks."""
    mean, reach, freedom, counting = _width_of_rattle(rolled) if rolled.contacts.cuts else _width_of_turns(rolled)
    if not np.isfinite(mean):
        remedy = "turn the drive slowly forth and back in one record, or record rattle with impacts on both flanks"
        raise InputError(Fault("theta_drive_rad", "shows one flank only: no backlash follows", remedy, file))
    if mean <= 0.0:
        what = f"puts the reverse flank {-1e6 * mean:.4g} um below the active one"
        raise InputError(Fault("theta_loose_rad", what, "check which gear drives, and its sense of rotation", file))
    parameters = {"backlash": Parameter(mean, "m", mean - reach, mean + reach)}
    snippet = ["[mount]", f'backlash = "{1e6 * mean:.6g} um"']
    active, reverse = rolled.fits
    if active is not None and reverse is not None:
        phasors = reverse.phasors - active.phasors
        covariance = active.covariance + reverse.covariance
        chance = chances(phasors, covariance)
        counted = np.abs(phasors - reverse.counted + active.counted) < COUNTED * np.abs(phasors)
        for place in strongest(rolled, np.abs(phasors), (chance < rolled.level) & ~counted):
            line, phasor = active.lines[place], complex(phasors[place])
            block = covariance[2 * place : 2 * place + 2, 2 * place : 2 * place + 2]
            size, phase = amplitude_and_phase(phasor, block, rolled.half_count(line), freedom)
            parameters[f"{line.name}_amplitude"], parameters[f"{line.name}_phase"] = size, phase
            snippet += _variation(line, phasor)
    axes = eccentric_axes(rolled)
    more: dict[str, Any] = {"eccentricity": [axis.to_dict() for axis in axes]}
    more["counting_m"] = counting
    more["shift_per_skew_m_s"] = 2.0 * rolled.contacts.radii[0] * rolled.contacts.speed
    text = "\n".join(snippet) + "\n" + "".join(axis.comment() for axis in axes)
    told = warnings(rolled)
    if reach > WIDE * mean:
        told.append(
            f"the interval is ± {100.0 * reach / mean:.2g} % of the backlash: slow turns both ways are surer, "
            "or `gears3d diagnose`, which fits a deviation of the backlash from the whole path"
        )
    return Identified("backlash", parameters, goodness(rolled) | more, text, curves(rolled), tuple(told))


def _width_of_turns(rolled: Rolled) -> tuple[float, float, float, float]:
    """Return the mean distance of both flanks from slow turns, half its interval, its freedom, and counting errors."""
    from scipy.stats import t as student

    active, reverse = rolled.fits
    both = sorted(set(active.offsets) & set(reverse.offsets)) if active and reverse else []
    if active is None or reverse is None or not both:
        return np.nan, np.nan, 1.0, 0.0
    mean = float(np.mean([reverse.offsets[file] - active.offsets[file] for file in both]))
    freedom = min(active.freedom, reverse.freedom)
    error = float(np.hypot(active.offset_deviation, reverse.offset_deviation) / np.sqrt(len(both)))
    counting = float(np.sqrt(sum(one**2 for side in rolled.contacts.shifts for one in side))) / len(both)
    wide = float(student.ppf(0.975, freedom))
    return mean, float(np.hypot(wide * error, wide * counting)), freedom, counting


def _width_of_rattle(rolled: Rolled) -> tuple[float, float, float, float]:
    """Return the same from records that rattle: each has its own, and the interval includes their scatter."""
    from scipy.stats import t as student

    from gears3d.measured.segmentation.results import place_slack

    known = [
        (found[0], float(np.hypot(found[1], np.hypot(*place_slack(cut)))))
        for cut in rolled.contacts.cuts
        if (found := cut.flanks.backlash) is not None
    ]
    if not known:
        return np.nan, np.nan, 1.0, 0.0
    value, sigma = np.array(known).T
    weight = sigma**-2 / np.sum(sigma**-2)
    mean, error = float(weight @ value), float(np.sum(sigma**-2) ** -0.5)
    if len(value) == 1:
        return mean, 1.96 * error, np.inf, 0.0
    misfit = float(np.sum(((value - mean) / sigma) ** 2)) / (len(value) - 1)
    return mean, float(student.ppf(0.975, len(value) - 1)) * error * max(misfit, 1.0) ** 0.5, np.inf, 0.0


def _variation(line: Any, phasor: complex) -> list[str]:
    """Return effects that move the reverse flank alone; over the loose gear's angle it takes two."""
    if line.gear == 0:
        return effect("backlash_variation", line, phasor)
    both = effect("transmission_error", line, phasor)
    return [*both, *effect("transmission_error", line, -phasor, 'flank = "active"')]

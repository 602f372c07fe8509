"""Transmission error of both flanks from contact: orders of both gears with amplitude, phase and interval."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.identify.contact import read_contacts
from gears3d.identify.eccentric import eccentric_axes
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.rolling import (
    Rolled,
    amplitude_and_phase,
    counted,
    curve,
    effect,
    goodness,
    roll,
    strongest,
    warnings,
)

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted

FLANKS = ("active", "reverse")


def identify_transmission_error(records: Sequence[Admitted]) -> Identified:
    """Identify the transmission error of active and reverse flank over the orders of both gears.

    Orders are sought on the angles of both gears at once; the 21 strongest of those that noise does not make are told.

    Args:
        records: slow turns, best both ways, or rattle, each with its rig; several share the zeros of their angles.

    Returns:
        Parameters ``<flank>_<gear>_<order>_amplitude`` [m] and ``..._phase`` [rad]: the flank is at
        amplitude·cos(order·θ + phase), θ as the record counts it.

    Raises:
        InputError: no rig, or no contact.

    Source: Rigaud & Perret-Liaudet 2020, section 3, fig. 2; Ottewill et al. 2010, eq. (11).

    >>> from gears3d.measured.checks import Admitted
    >>> from gears3d.measured.readers import Channels
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> bench = load("scenarios/rigaud-2020/fig2.toml")
    >>> seen = record(bench, "ste", turns=2).signals
    >>> found = identify_transmission_error([Admitted(Channels(seen), bench, (), "")])
    >>> [round(1e6 * found.parameters[f"active_drive_{order}_amplitude"].value, 1) for order in (1, 90)]
    [50.0, 5.0]
    """
    return transmission_error(roll(read_contacts(records)))


def transmission_error(rolled: Rolled) -> Identified:
    """Return the transmission error of flanks that were rolled on.

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
    told = goodness(rolled) | {
        "orders": orders,
        "counting": left_out,
        "eccentricity": [axis.to_dict() for axis in axes],
    }
    notes = warnings(rolled)
    if left_out:
        names = ", ".join(f"{one['flank']} {one['gear']}_{one['order']}" for one in left_out)
        why = "counts read in step with the turning make such lines: read out of step, or let the drive wander"
        notes.append(f"left out: {names} ({1e9 * max(one['amplitude_m'] for one in left_out):.2g} nm at most): {why}")
    if not parameters:
        notes.append("no order stands out of the noise")
    if rolled.fits[1] is None and parameters:
        notes.append('the snippet moves both flanks alike (flank = "both"): an assumption')
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
    assert fitted is not None
    lines = ["# phases count from the zero of the record's angles"]
    real = (fitted.chance < rolled.level) & ~counted(fitted)
    for place in strongest(rolled, np.abs(fitted.phasors), real):
        lines += effect("transmission_error", fitted.lines[place], complex(fitted.phasors[place]))
    return "\n".join(lines) + "\n"


def curves(rolled: Rolled) -> dict[str, Any]:
    """Return what the picture shows: of each flank its curve and its orders with noise floor.

    Args:
        rolled: both flanks.
    """
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

"""Do the encoders wander once or twice a turn, and can that be told from the gears' own transmission error.

In contact a wave of the loose gear's encoder looks like a transmission error. In flight it does not: there the loose
gear slows down evenly, whatever its flanks are like, and only its encoder's wave bends the angle. A wave of the
drive's encoder shows in the drive's angle alone, while the loose gear turns evenly: with a transmission error it is the
other way round.
"""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.band import Band
from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.places import Places
from gears3d.measured.checks.view import MESH, View

SURE = 6.0
"""Standard deviations from which a wave is told."""
LEAST = 0.05
"""Part of the backlash from which it is told."""
NEAR = 0.3
"""How far two amplitudes that are the same may differ, as a part of them."""
FEWEST = 20
"""Flights that tell whether a wave is in them."""
AMID = 0.1
"""Part of the backlash by which a flight keeps off both flanks."""
LONG, FLIGHTS = 2, 3000
"""Blocks in such a flight, at least, and so many flights at most."""
MOST = 4000
"""Blocks among which a wave of the drive is sought."""
BESIDE = (-0.45, -0.35, -0.25, 0.25, 0.35, 0.45)
"""Orders beside an order, which tell what is usual there."""


def examine(view: View) -> list[Finding]:
    """Find waves of the displacement in step with a turn, and tell whose they are where that can be told.

    Args:
        view: the record; its ratio is right, its jumps and delays are corrected.
    """
    band, found = view.band, view.places
    if band is None or found is None:
        return []
    least = LEAST * (view.declared.backlash or 0.0)
    told = []
    for (name, order), wave in found.waves.items():
        if abs(wave) > max(least, SURE * found.sigma):
            told += _told(view, band, found, name, order)
    return told


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Take the waves of encoders out.

    Args:
        columns: each (n,).
        findings: of this check, of kind ``"encoder-wave"``.
    """
    mended = dict(columns)
    for finding in findings:
        angle = columns[finding.channel]
        mended[finding.channel] = angle - finding.size * np.cos(
            finding.parameters["order"] * angle + finding.parameters["phase_rad"]
        )
    return mended


def _told(view: View, band: Band, found: Places, name: str, order: int) -> list[Finding]:
    wave = found.waves[name, order]
    equal = (MESH[1], order) not in found.waves
    seen = f"transmission error of the active flank has {1e6 * abs(wave):.4g} um (± {1e6 * found.sigma:.2g}) "
    seen += f"at order {order} "
    seen += "of both gears" if equal else f"of {name}"
    radii = view.declared.radii or (1.0, 1.0)
    if name == MESH[0] and (own := _carried(view, band, order)) is not None and _same(own, -wave / radii[0]):
        seen += f"; {name} has this order with {abs(own):.3g} rad and the loose gear does not follow: "
        seen += "its encoder is eccentric"
        return [_encoder(name, order, own, seen)]
    flown = _flown(view, band, found, order) if name == MESH[1] or equal else None
    if flown is not None:
        own, sigma = flown
        meant = wave / radii[1]
        if equal:  # the same wave, told by the other gear's angle
            meant *= np.exp(1j * order * float(band.drive[0] - band.loose[0]))
        if abs(own) > SURE * sigma and (_same(own, meant) or abs(own - meant) < 3.0 * sigma):
            seen += (
                f"; free flights have this order, too ({abs(own):.3g} rad): the encoder of the loose gear is eccentric"
            )
            return [_encoder(MESH[1], order, own, seen)]
        if abs(own) < 3.0 * sigma and abs(meant) > SURE * sigma:
            return []
    remedy = "rotate an encoder on its shaft, or record flights; `measure` attributes this order to the flanks"
    return [Finding("wave", name, abs(wave), "m", f"{seen}: either an eccentric encoder or the gears", remedy)]


def _same(one: complex, other: complex) -> bool:
    return abs(one - other) < NEAR * abs(other)


def _encoder(name: str, order: int, wave: complex, seen: str) -> Finding:
    about = {"order": float(order), "phase_rad": float(np.angle(wave))}
    return Finding("encoder-wave", name, abs(wave), "rad", seen, "", False, True, parameters=about)


def _carried(view: View, band: Band, order: int) -> complex | None:
    """Return the wave of the drive's own angle at an order [rad], ``None`` where its motion hides or imitates one."""
    lasting = float(band.time[-1] - band.time[0])
    turns = abs(float(band.drive[-1] - band.drive[0])) / (2 * np.pi)
    if any(abs(times * band.frequency * lasting - order * turns) < 3.0 for times in (1, 2) if band.frequency):
        return None
    some = slice(None, None, max(len(band.time) // MOST, 1))
    time, drive = band.time[some], band.drive[some]
    row = (time - band.time[0]) / lasting
    base = [np.ones_like(row), row]
    for times in (1, 2, 3):
        if band.frequency:
            turn = 2 * np.pi * times * band.frequency * time
            base += [np.cos(turn), np.sin(turn), row * np.cos(turn), row * np.sin(turn)]
    even = 2 * np.pi * turns * row

    def amplitude(of: float, angle: np.ndarray) -> complex:
        table = np.column_stack([*base, np.cos(of * angle), np.sin(of * angle)])
        numbers = np.linalg.lstsq(table, drive, rcond=None)[0]
        return complex(numbers[-2], -numbers[-1])

    own = amplitude(order, drive)
    usual = float(np.median([abs(amplitude(order + beside, even)) for beside in BESIDE]))
    return own if abs(own) > SURE * usual else None


def _flown(view: View, band: Band, found: Places, order: int) -> tuple[complex, float] | None:
    """Return the wave of the loose gear's angle in its flights and its sigma [rad], ``None`` with too few flights."""
    angles: dict[str, np.ndarray] = {MESH[0]: band.drive, MESH[1]: band.loose}
    above = band.place - found.level
    for (name, times), wave in found.waves.items():
        above -= np.real(wave * np.exp(1j * times * angles[name]))
    spare = AMID * (view.declared.backlash or 0.0)
    flying = (above > spare) & (above < float(np.quantile(above, 0.999)) - spare)
    edge = np.diff(np.concatenate([[False], flying, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
    good = last - first >= LONG
    begins = np.searchsorted(view.time, band.time[first[good]])
    ends = np.searchsorted(view.time, band.time[last[good]])
    rows, bends = [], []
    for begin, end in list(zip(begins.tolist(), ends.tolist(), strict=True))[:FLIGHTS]:
        time, angle = view.time[begin:end], view.angles[MESH[1]][begin:end]
        lasts = float(time[-1] - time[0])
        table = np.polynomial.legendre.legvander(2.0 * (time - time[0]) / lasts - 1.0, 2)
        wave = order * angle
        fit = np.linalg.lstsq(table, np.column_stack([angle - angle[0], np.cos(wave), np.sin(wave)]), rcond=None)[0]
        weight = np.sqrt(len(time))
        rows.append(np.array([lasts**2, lasts * fit[1, 0], fit[2, 1], fit[2, 2]]) * weight)
        bends.append(fit[2, 0] * weight)
    if len(rows) < FEWEST:
        return None
    table, bend = np.array(rows), np.array(bends)
    keep = np.ones(len(bend), bool)
    for _ in range(4):
        numbers = np.linalg.lstsq(table[keep], bend[keep], rcond=None)[0]
        off = bend - table @ numbers
        rough = 1.4826 * float(np.median(np.abs(off)))
        keep = np.abs(off) <= 4.0 * rough
    inverse = np.linalg.pinv(table[keep].T @ table[keep])
    sigma = rough * float(np.sqrt(np.diag(inverse)[2:].max()))
    return complex(numbers[2], -numbers[3]), sigma

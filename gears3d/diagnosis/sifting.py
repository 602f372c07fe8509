"""What does not belong to a channel: points that cutting the record put on a wrong flank or at a wrong moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gears3d.diagnosis.channels import Flights
from gears3d.diagnosis.deviation import REACH, pitches_from
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import bend, parts_of, residuals, without
from gears3d.diagnosis.scatter import FEWEST

Array = np.ndarray
STRAY = 6.0
"""Usual distances from the others of its flank beyond which a loss of contact is left out."""
UNLIKE = 0.5
"""Part of the drag's deceleration by which a flight may always differ from the others of its record."""
USUAL = 0.9
"""Part of the flights of a record that tell how far from a parabola a flight is."""
MOST = 0.2
"""Part of a channel of a record that may be left out: more are no mistakes of cutting."""


def without_strays(one: Evidence) -> Evidence:
    """Return a record without the losses of contact that stand apart from all others of their flank, and such flights.

    A gear that rolls off the edge of a tooth moves on a parabola, too, but not on that of a flight.

    Args:
        one: the record.
    """
    told = residuals(one)
    one = _without_rolling(one, told["flight"])
    losses, rest = one.channels.losses, told["loss"]
    good = np.ones(len(rest), bool)
    for flank in (0, 1):
        own = losses.flank == flank
        if np.any(own):
            middle = np.median(rest[own])
            usual = max(1.4826 * float(np.median(np.abs(rest[own] - middle))), 1.0)
            good[own] = np.abs(rest[own] - middle) < STRAY * usual
    kept = type(losses)(*(column[good] for column in losses))
    left_out = {**one.channels.left_out, "loss": one.channels.left_out.get("loss", 0) + int(np.sum(~good))}
    return replace(one, channels=one.channels._replace(losses=kept, left_out=left_out))


def _without_rolling(one: Evidence, rest: Array) -> Evidence:
    """Return a record without the few flights unlike all others: in deceleration, or no parabola where those are."""
    flights = one.channels.flights
    if len(flights.time) < FEWEST:
        return one
    shape = bend(one)
    square, rest = np.sum(shape**2, axis=1), rest.reshape(shape.shape)
    slow, sigma = np.sum(shape * rest, axis=1) / square, square**-0.5
    off = np.abs(slow - np.median(slow))
    usual = 1.4826 * float(np.median(off)) + UNLIKE / STRAY * one.rig.drag_torque / one.rig.inertia
    bent = np.sqrt(np.mean(without(rest, (shape,)) ** 2, axis=1))
    good = (off < STRAY * np.hypot(usual, sigma)) & (bent < STRAY * max(float(np.quantile(bent, USUAL)), 1.0))
    if np.all(good) or np.mean(~good) > MOST:
        return one
    kept = Flights(*(column[good] for column in flights))
    left_out = {**one.channels.left_out, "flight": one.channels.left_out.get("flight", 0) + int(np.sum(~good))}
    seen = one.channels._replace(flights=kept, left_out=left_out)
    return replace(one, channels=seen, fine=tuple(column[good] for column in one.fine), at=one.at[good])


def badly_cut(one: Evidence) -> bool:
    """Whether more of a record's contact was left out than mistakes of cutting explain.

    Args:
        one: the record.
    """
    out = one.channels.left_out.get("contact", 0)
    return out > MOST * (out + len(one.channels.contacts.time))


def emptied(one: Evidence) -> Evidence:
    """Return a record of which only the drive's motion is left.

    Args:
        one: the record.
    """
    seen, names = one.channels, {"flights": "flight", "contacts": "contact", "impacts": "impact", "losses": "loss"}
    sizes = {channel: len(getattr(seen, name).time) for name, channel in names.items()}
    left_out = {channel: seen.left_out.get(channel, 0) + size for channel, size in sizes.items()}
    gone: dict[str, Any] = {}
    for name in (*names, "blows", "partings", "corners"):
        points = getattr(seen, name)
        gone[name] = type(points)(*(column[:0] for column in points))
    kept = seen._replace(**gone, left_out=left_out)
    return replace(one, channels=kept, fine=tuple(column[:0] for column in one.fine), at=one.at[:0])


def off_teeth(one: Evidence, teeth: Sequence[Any]) -> Evidence:
    """Return a record without the impacts where single teeth are in mesh, on either flank.

    Such a tooth throws the gear at the other flank, and back, within less than readings tell from one blow.

    Args:
        one: the record.
        teeth: pitch errors.
    """
    kept: dict[str, Any] = {}
    for name in ("impacts", "blows"):
        seen = getattr(one.channels, name)
        turned = [pitches_from(one.pair, each.gear, each.tooth, getattr(seen, each.gear)) for each in teeth]
        far = np.all(np.abs(turned) > REACH, axis=0)
        kept[name] = type(seen)(*(column[far] for column in seen))
    out = len(one.channels.impacts.time) - len(kept["impacts"].time)
    left_out = {**one.channels.left_out, "impact": one.channels.left_out.get("impact", 0) + out}
    return replace(one, channels=one.channels._replace(**kept, left_out=left_out))


def without_rolling(records: Sequence[Evidence], rest: Array) -> list[Evidence] | None:
    """Return records without the few flights that a cause leaves unlike all others; ``None`` where there are none.

    Where the readings of all flights are bent alike, those that were cut wrongly show only once that is explained.

    Args:
        records: all.
        rest: residuals that the cause leaves, stacked as :mod:`gears3d.diagnosis.prediction` does, (n,).
    """
    found = [_without_rolling(*each) for each in zip(records, parts_of(records, rest)["flight"], strict=True)]
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None


def without_outliers(records: Sequence[Evidence], rest: Array, most: float) -> list[Evidence] | None:
    """Return records without points of contact and impacts that a cause leaves far off; ``None`` where there are none.

    Args:
        records: all.
        rest: residuals that the cause leaves, stacked as :mod:`gears3d.diagnosis.prediction` does, (n,).
        most: standard deviations that a point may be off.
    """
    parts, found = parts_of(records, rest), []
    for k, one in enumerate(records):
        seen = one.channels
        kept, left_out = {}, dict(seen.left_out)
        for name, own in (("contact", seen.contacts), ("impact", seen.impacts)):
            off = parts[name][k]
            if name == "contact" and len(off):  # its zero is anywhere, and was drawn towards what is far off
                off = off - np.median(off)
            far = np.abs(off) > most
            if not np.any(far) or np.mean(far) > MOST:
                continue
            kept[name + "s"] = type(own)(*(column[~far] for column in own))
            left_out[name] = left_out.get(name, 0) + int(np.sum(far))
        found.append(replace(one, channels=seen._replace(**kept, left_out=left_out)) if kept else one)
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None

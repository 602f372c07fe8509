"""Exclusion of points that segmentation assigned to a wrong flank or moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gears3d.diagnosis.channels import Flights
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import REACH, deceleration_response, parts_of, pitches_from, project_out, residuals
from gears3d.diagnosis.restitution_scatter import FEWEST

Array = np.ndarray
# Distance from the others of its flank, in median distances, beyond which a contact loss is excluded.
STRAY = 6.0
# Difference from the other flights of a record, relative to the drag's deceleration, that is always accepted.
UNLIKE = 0.5
# Fraction of a record's flights that defines the usual deviation from a parabola.
USUAL = 0.9
# Maximum fraction of excluded points of a channel of a record: errors of segmentation are fewer.
MOST = 0.2


def without_strays(one: Evidence) -> Evidence:
    """Return a record without contact losses, and flights, far from all others of their flank.

    A gear that rolls off the edge of a tooth moves on a parabola, too, but not on that of a flight.
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
    """Return a record without the few flights that differ from all others in deceleration or shape."""
    flights = one.channels.flights
    if len(flights.time) < FEWEST:
        return one
    shape = deceleration_response(one)
    square, rest = np.sum(shape**2, axis=1), rest.reshape(shape.shape)
    slow, sigma = np.sum(shape * rest, axis=1) / square, square**-0.5
    off = np.abs(slow - np.median(slow))
    usual = 1.4826 * float(np.median(off)) + UNLIKE / STRAY * one.rig.drag_torque / one.rig.inertia
    bent = np.sqrt(np.mean(project_out(rest, (shape,)) ** 2, axis=1))
    good = (off < STRAY * np.hypot(usual, sigma)) & (bent < STRAY * max(float(np.quantile(bent, USUAL)), 1.0))
    if np.all(good) or np.mean(~good) > MOST:
        return one
    kept = Flights(*(column[good] for column in flights))
    left_out = {**one.channels.left_out, "flight": one.channels.left_out.get("flight", 0) + int(np.sum(~good))}
    seen = one.channels._replace(flights=kept, left_out=left_out)
    return replace(one, channels=seen, fine=tuple(column[good] for column in one.fine), at=one.at[good])


def badly_cut(one: Evidence) -> bool:
    """Whether more of a record's contact was excluded than errors of segmentation explain."""
    out = one.channels.left_out.get("contact", 0)
    return out > MOST * (out + len(one.channels.contacts.time))


def emptied(one: Evidence) -> Evidence:
    """Return a record with only the drive's motion."""
    seen, names = one.channels, {"flights": "flight", "contacts": "contact", "impacts": "impact", "losses": "loss"}
    sizes = {channel: len(getattr(seen, name).time) for name, channel in names.items()}
    left_out = {channel: seen.left_out.get(channel, 0) + size for channel, size in sizes.items()}
    gone: dict[str, Any] = {}
    for name in (*names, "censored_impacts", "contact_ends", "velocity_jumps"):
        points = getattr(seen, name)
        gone[name] = type(points)(*(column[:0] for column in points))
    kept = seen._replace(**gone, left_out=left_out)
    return replace(one, channels=kept, fine=tuple(column[:0] for column in one.fine), at=one.at[:0])


def off_teeth(one: Evidence, teeth: Sequence[Any]) -> Evidence:
    """Return a record without the impacts where single teeth are in mesh, on either flank.

    Such a tooth makes the gear rebound between both flanks so fast that readings show one impact.
    """
    kept: dict[str, Any] = {}
    for name in ("impacts", "censored_impacts"):
        seen = getattr(one.channels, name)
        turned = [pitches_from(one.pair, each.gear, each.tooth, getattr(seen, each.gear)) for each in teeth]
        far = np.all(np.abs(turned) > REACH, axis=0)
        kept[name] = type(seen)(*(column[far] for column in seen))
    out = len(one.channels.impacts.time) - len(kept["impacts"].time)
    left_out = {**one.channels.left_out, "impact": one.channels.left_out.get("impact", 0) + out}
    return replace(one, channels=one.channels._replace(**kept, left_out=left_out))


def without_rolling(records: Sequence[Evidence], rest: Array) -> list[Evidence] | None:
    """Return records without the few flights that a cause leaves far from all others; ``None`` without any.

    If the readings of all flights are distorted equally, wrongly segmented ones show only once that is explained.

    rest: stacked as :mod:`gears3d.diagnosis.prediction` does, (n,).
    """
    found = [_without_rolling(*each) for each in zip(records, parts_of(records, rest)["flight"], strict=True)]
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None


def without_outliers(records: Sequence[Evidence], rest: Array, most: float) -> list[Evidence] | None:
    """Return records without contact points and impacts of large residuals; ``None`` without any.

    rest: stacked as :mod:`gears3d.diagnosis.prediction` does, (n,); most: largest residual, in standard deviations.
    """
    parts, found = parts_of(records, rest), []
    for k, one in enumerate(records):
        seen = one.channels
        kept, left_out = {}, dict(seen.left_out)
        for name, own in (("contact", seen.contacts), ("impact", seen.impacts)):
            off = parts[name][k]
            if name == "contact" and len(off):  # its datum is arbitrary, and was biased by the outliers
                off = off - np.median(off)
            far = np.abs(off) > most
            if not np.any(far) or np.mean(far) > MOST:
                continue
            kept[name + "s"] = type(own)(*(column[~far] for column in own))
            left_out[name] = left_out.get(name, 0) + int(np.sum(far))
        found.append(replace(one, channels=seen._replace(**kept, left_out=left_out)) if kept else one)
    return found if any(a is not b for a, b in zip(found, records, strict=True)) else None

"""Flanks of a rattling pair from the contacts that segmentation finds: orders that these can show, and the backlash."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.identify.contact import Contact as Places
from gears3d.identify.orders import Fit, Line, Lines
from gears3d.measured.segmentation.orders import (
    POOR,
    STRAY,
    Contact,
    columns_of,
    fluctuation_order,
    in_step,
    resolved,
    strongest,
)
from gears3d.measured.segmentation.results import place_slack, within
from gears3d.signals.orders import (
    GEARS,
    colour_of,
    each_alone,
    phasors_of,
    trimmed,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from gears3d.measured.segmentation import Segments

FEWEST = 200  # blocks in contact with a flank, below which no order of it is sought
ROWS = 20_000  # blocks that are fitted at most
DISTINCT = 0.2  # part of an order that the other terms must leave: a variance inflation factor of 5


def rattle_flanks(
    cuts: Sequence[Segments], teeth: tuple[int, int]
) -> tuple[tuple[Places | None, Places | None], Lines, tuple[Fit | None, Fit | None], tuple[str, ...]]:
    """Return places in contact by flank (``None`` without), orders looked at, fits, and what is excluded and why."""
    ratio = teeth[0] / teeth[1]
    touched = [_contact(cuts, flank) for flank in (0, 1)]
    seen = [one for one in touched if one is not None]
    steps = [step for cut in cuts if (step := fluctuation_order(cut.path.time, cut.path.drive)) is not None]
    notes = []
    taken: list[tuple[str, int]] = []
    highest = (0, 0)
    if seen:
        tops = [resolved(cut.path.drive, cut.path.loose) for cut in cuts]
        highest = (min(top[0] for top in tops), min(top[1] for top in tops))
        barred = in_step(highest, steps, ratio)
        if barred:
            notes.append(
                f"{len(barred)} of {sum(highest)} orders are in step with the drive's fluctuation "
                f"(order {steps[0][0]:.4g}) and excluded: rattle itself repeats at them in each period; "
                "slow turns show all orders"
            )
        while True:
            taken = strongest(seen, highest, known=tuple(barred))[0]
            hidden = [name for name in taken if not all(_distinct(one, taken, name) for one in seen)]
            if not hidden:
                break
            barred += hidden
            names = ", ".join(f"{gear}_{order}" for gear, order in hidden)
            notes.append(f"excluded: {names}: the angles in contact do not distinguish them from other terms")
    lines = tuple(Line(GEARS.index(gear), order) for gear, order in taken)
    every = [Line(gear, order) for gear in (0, 1) for order in range(1, highest[gear] + 1)]
    frequency = np.array([line.order * (ratio if line.gear else 1.0) for line in every])
    looked = Lines(tuple(every), frequency, {})
    fits = tuple(
        None if one is None else _fit(one, looked, taken, lines, cuts, flank) for flank, one in enumerate(touched)
    )
    places = tuple(None if one is None else _places(one, cuts) for one in touched)
    return (places[0], places[1]), looked, (fits[0], fits[1]), tuple(notes)


def _places(one: Contact, cuts: Sequence[Segments]) -> Places:
    """Return blocks in contact as the places that slow turns have in bins."""
    drive, loose = one.angles
    turns = sum(float(np.ptp(cut.path.drive)) for cut in cuts) / (2.0 * np.pi)
    count, file = np.ones(len(drive)), np.argmax(one.base[:, ::2] != 0.0, axis=1)
    turn = np.floor(drive / (2.0 * np.pi)).astype(int) + 1_000_000 * file
    return Places(drive, loose, one.place, count, file, turn, 0.0 * drive, 2.0 * np.pi * turns / len(drive), 1.0)


def _contact(cuts: Sequence[Segments], flank: int) -> Contact | None:
    """Return the blocks in contact with a flank of all records, with an offset and a slow drift of each record."""
    rows, share = [], max(ROWS // len(cuts), 1)
    for cut in cuts:
        near = within(cut.path.time, cut.contacts, cut.path.width, flank)
        line = cut.flanks.places(cut.path.time[near], cut.path.drive[near], cut.path.loose[near])[flank]
        rows.append(near[np.abs(cut.path.place[near] - line) < 5.0 * cut.flanks.rough])
    if sum(len(near) for near in rows) < FEWEST:
        return None
    base, drive, loose, place = [], [], [], []
    for number, (cut, near) in enumerate(zip(cuts, rows, strict=True)):
        some = near[:: max(len(near) // share, 1)]
        own = np.zeros((len(some), 2 * len(cuts)))
        own[:, 2 * number] = 1.0
        own[:, 2 * number + 1] = (cut.path.time[some] - cut.path.time[0]) / np.ptp(cut.path.time) - 0.5
        base.append(own)
        drive.append(cut.path.drive[some])
        loose.append(cut.path.loose[some])
        place.append(cut.path.place[some])
    columns = np.vstack(base)
    columns = columns[:, np.any(columns != 0.0, axis=0)]
    noise = max(max(cut.path.noise, cut.path.slack / np.sqrt(3.0)) for cut in cuts)
    angles = np.stack([np.concatenate(drive), np.concatenate(loose)])
    return Contact(columns, angles, np.concatenate(place), noise)


def _distinct(one: Contact, taken: list[tuple[str, int]], name: tuple[str, int]) -> bool:
    """Return whether the angles in contact distinguish an order from all other terms."""
    others = columns_of(one, [other for other in taken if other != name])
    own = columns_of(one, [name])[:, one.base.shape[1] :]
    frame = np.linalg.qr(others)[0]
    left = own - frame @ (frame.T @ own)
    return bool(np.linalg.eigvalsh(left.T @ left)[0] > DISTINCT * np.linalg.eigvalsh(own.T @ own)[0])


def _fit(
    one: Contact,
    looked: Lines,
    taken: list[tuple[str, int]],
    lines: tuple[Line, ...],
    cuts: Sequence[Segments],
    flank: int,
) -> Fit:
    """Return the least-squares fit of a flank's orders, with a covariance for coloured residuals."""
    made = trimmed(columns_of(one, taken), one.place, STRAY, one.noise)
    numbers, rest, kept = made.numbers, made.rest, made.kept
    freedom = max(int(kept.sum()) - len(numbers), 1)
    colour = colour_of(rest[kept])
    variance = float(rest[kept] @ rest[kept]) / freedom * colour
    first = one.base.shape[1]
    covariance, phasors = variance * made.inverse[first:, first:], phasors_of(numbers[first:])
    floor = float(np.sqrt(2.0 * variance / max(int(kept.sum()), 1)))
    highest = [max((line.order for line in looked.all if line.gear == gear), default=0) for gear in (0, 1)]
    alone = [np.abs(each_alone(angle, rest, top, POOR)[0]) for angle, top in zip(one.angles, highest, strict=True)]
    seen = np.array([alone[line.gear][line.order] for line in looked.all])
    offsets, slack = {}, []
    for number, cut in enumerate(cuts):
        if flank == 1 and cut.flanks.gap is None:
            continue
        flanks, first = cut.flanks, len(cut.flanks.active)
        offsets[number] = float(flanks.active[0])
        own = float(flanks.covariance[0, 0])
        if flank == 1 and flanks.gap is not None:
            offsets[number] += float(flanks.gap[0])
            own = float(flanks.covariance[first, first])
        slack.append(own + place_slack(cut)[flank] ** 2)
    return Fit(
        lines=lines,
        phasors=phasors,
        covariance=covariance,
        offsets=offsets,
        offset_deviation=float(np.sqrt(np.mean(slack))) if slack else np.inf,
        floor=np.full(len(looked.all), floor),
        seen=seen,
        rest=rest,
        kept=kept,
        freedom=freedom / colour,
        scatter=float(np.sqrt(colour)),
        counted=np.zeros(len(phasors), complex),
    )

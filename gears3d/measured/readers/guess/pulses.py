"""Signals with two levels: raw quadrature of encoders, index marks, and pulses of a tacho."""

from __future__ import annotations

import json
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.guess.clues import Clue
from gears3d.measured.readers.guess.gears import Bench

# Part of the range within which a reading is at one of both levels.
NEAR = 0.2
# Readings that are at a level; edges of analog pulses lie between.
SHARE = 0.9
# Share of its readings that each level has at least; an index mark may have fewer.
RARE = 0.02
# Edges that a channel of an encoder or a tacho shows.
FEWEST = 8
# Share of transitions in which both channels of a quadrature may change at once.
ILLEGAL = 0.02


class Pulses(NamedTuple):
    """Two-level signals taken for one gear.

    Args:
        lines: of its table in the map.
        whys: reasons, one sentence each.
        used: names of the signals.
    """

    lines: tuple[str, ...]
    whys: tuple[str, ...]
    used: tuple[str, ...]


def two_level(clue: Clue) -> bool:
    """Return whether a signal is at one of two levels nearly always."""
    low, high = float(clue.values.min()), float(clue.values.max())
    if clue.family in ("time", "angle", "speed", "counts") or high <= low:
        return False
    other = clue.foreign or clue.says("angle") or clue.says("speed")  # "encoder A" is logic, "pos" a position at stops
    if other and np.any((clue.values != low) & (clue.values != high)):
        return False
    place = (clue.values - low) / (high - low)
    up, down = float(np.mean(place > 1.0 - NEAR)), float(np.mean(place < NEAR))
    return up + down > SHARE and min(up, down) > 0.0 and len(np.flatnonzero(np.diff(place > 0.5))) > 1


def pulses(found: list[Clue], bench: Bench, lasts: float, file: str) -> dict[str, Pulses]:
    """Return the gears that two-level signals show: quadrature first, else pulses of a tacho.

    ``lasts``: duration of the examined samples [s]. Raises InputError when the lines of an encoder or the pulses per
    revolution are not known.
    """
    pairs: list[tuple[Clue, Clue, Clue | None, int]] = []
    at = 0
    while at + 1 < len(found):
        turned = _quadrature(found[at], found[at + 1])
        if not turned:
            at += 1
            continue
        after = found[at + 2] if at + 2 < len(found) and _is_index(found[at + 2], found[at]) else None
        pairs.append((found[at], found[at + 1], after, turned))
        at += 2 if after is None else 3
    if pairs:
        return {
            gear: _encoder(gear, *pair, bench, file)
            for gear, pair in zip(_gears([pair[0] for pair in pairs]), pairs[:2], strict=False)
        }
    able = [each for each in found if len(_edges(each)) >= FEWEST and min(_shares(each)) > RARE]
    return {gear: _tacho(gear, clue, bench, lasts, file) for gear, clue in zip(_gears(able), able[:2], strict=False)}


def _gears(found: list[Clue]) -> tuple[str, ...]:
    """Return which gears signals belong to: by their names, else in the order of the file."""
    if len(found) == 1:
        return ("drive",) if found[0].says("drive") else ("loose",)
    turned = len(found) > 1 and (found[0].says("loose") or found[1].says("drive"))
    return ("loose", "drive") if turned else ("drive", "loose")


def _high(clue: Clue) -> np.ndarray:
    return clue.values > 0.5 * (float(clue.values.min()) + float(clue.values.max()))


def _edges(clue: Clue) -> np.ndarray:
    return np.flatnonzero(np.diff(_high(clue)))


def _shares(clue: Clue) -> tuple[float, float]:
    up = float(np.mean(_high(clue)))
    return up, 1.0 - up


def _quadrature(a: Clue, b: Clue) -> int:
    """Return the sense of rotation of two channels in quadrature, 0 where they are not in quadrature."""
    if len(a.values) != len(b.values) or min(len(_edges(a)), len(_edges(b))) < FEWEST:
        return 0
    state = np.array([0, 1, 3, 2])[2 * _high(a).astype(int) + _high(b)]  # the order of states when b leads
    steps = np.diff(state) % 4
    moved = steps[steps != 0]
    if np.mean(moved == 2) > ILLEGAL or min(np.bincount(state, minlength=4)) < RARE * len(state):
        return 0
    return 1 if np.sum(moved == 3) > np.sum(moved == 1) else -1


def _is_index(clue: Clue, a: Clue) -> bool:
    return len(_edges(clue)) < 0.25 * len(_edges(a)) and min(_shares(clue)) < 0.25


def _encoder(gear: str, a: Clue, b: Clue, index: Clue | None, turned: int, bench: Bench, file: str) -> Pulses:
    counts = bench.counts[0 if gear == "drive" else 1]
    if not counts:
        what = f"{a.signal.name} and {b.signal.name} are raw quadrature, and the lines of its encoder are not known"
        remedy = f'give --rig with sensors.{gear}.counts_per_revolution, or write decode = {{ kind = "quadrature" }}'
        raise InputError(Fault(f"{gear}.decode.lines", what, remedy, file))
    decode = f'kind = "quadrature", a = {_text(a)}, b = {_text(b)}, lines = {counts / 4:.12g}'
    lines = [f"[{gear}]", f"decode = {{ {decode} }}"]
    whys = ["two levels each, a quarter of a period apart: raw quadrature", f"{counts / 4:g} lines: of the rig"]
    if turned < 0:
        lines.append("sign = -1")
        whys.append("b leads a, and angles are positive in the gear's own sense of rotation")
    if index is not None:
        lines.append(f"index = {{ channel = {_text(index)} }}")
        whys.append(f"{index.signal.bare!r} has few pulses: the index mark")
    used = (a.signal.name, b.signal.name, *([index.signal.name] if index else []))
    return Pulses(tuple(lines), tuple(whys), used)


def _tacho(gear: str, clue: Clue, bench: Bench, lasts: float, file: str) -> Pulses:
    which = 0 if gear == "drive" else 1
    rate = 0.5 * len(_edges(clue)) / lasts
    teeth = None if bench.teeth is None else bench.teeth[which]
    if teeth is None or not bench.mean:
        what = f"{clue.signal.name} has {rate:.4g} pulses a second, and how many are a revolution is not known"
        remedy = f'write channel and decode = {{ kind = "tacho", positions = ... }} below [{gear}], or give --rig'
        raise InputError(Fault(f"{gear}.decode.positions", what, remedy, file))
    mean = abs(bench.mean) * (1.0 if which == 0 else bench.teeth[0] / bench.teeth[1] if bench.teeth else 1.0)
    positions = rate / (mean / (2.0 * np.pi))
    near = next((one for one in (teeth, round(positions)) if one > 0 and abs(positions / one - 1.0) < 0.1), None)
    if near is None:
        what = f"{clue.signal.name} has {positions:.3g} pulses a revolution at the mean speed of the rig"
        raise InputError(Fault(f"{gear}.decode.positions", what, "check motion.mean, or write the map", file))
    whys = ("two levels, one pulse after the other: a tacho", f"{positions:.4g} pulses a revolution at the rig's speed")
    table = (f"[{gear}]", f"channel = {_text(clue)}", f'decode = {{ kind = "tacho", positions = {near} }}')
    return Pulses(table, whys, (clue.signal.name,))


def _text(clue: Clue) -> str:
    return json.dumps(clue.signal.name, ensure_ascii=False).replace("\x7f", "\\u007f")

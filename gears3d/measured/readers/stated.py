"""The sampling rate that a file states in words: lines of a header, names of properties and of variables."""

from __future__ import annotations

import re
from collections.abc import Iterable
from math import isfinite

# Characters of a note that are searched.
LONGEST = 2000
# Rates that a sampled record has [Hz].
SLOWEST, FASTEST = 1.0, 1e9
_RATE = re.compile(
    r"(?:sampl\w*|abtast\w*|mess|scan|acq\w*|logging|daq)[\s_-]*(?:rate|freq\w*|hz)|\bf_?s\b|\brate\b|SampleFrequency",
    re.IGNORECASE,
)
_STEP = re.compile(
    r"delta_x|\bd_?t\b|sampl\w*[\s_-]*(?:interval|period|time|step)|time[\s_-]*(?:step|increment)|abtast(?:zeit|intervall)"
    r"|wf_increment|\bxincr(?:ement)?\b|x_?increment",
    re.IGNORECASE,
)
_NUMBER = re.compile(
    r"[\s=:;,\[(\"]\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)\s*(\]|\))?\s*([kM]?Hz|[kM]?S/s|[mu\u00b5\u03bcn]?s(?:ec)?)?\b"
)
_BRACKETED = re.compile(r"[\[(]\s*([kM]?Hz|[kM]?S/s|[mu\u00b5\u03bcn]?s(?:ec)?)\s*[\])]")
_SCALES = {"k": 1e3, "M": 1e6, "m": 1e-3, "u": 1e-6, "\u00b5": 1e-6, "\u03bc": 1e-6, "n": 1e-9}


def stated_rate(notes: Iterable[str]) -> float | None:
    """Return the sampling rate that lines state [Hz], as a rate or as an interval.

    >>> stated_rate(["Operator: A", "Sample rate: 50 kHz"]), stated_rate(["Delta_X;0,0005"]), stated_rate(["fs=1000"])
    (50000.0, 2000.0, 1000.0)
    """
    for note in (" ".join(each[:LONGEST].split()) for each in notes):
        for form, is_rate in ((_STEP, False), (_RATE, True)):
            match = form.search(note)
            if match is None:
                continue
            number = _NUMBER.search(note, match.end())
            if number is None:
                continue
            head = _BRACKETED.search(note, match.end(), number.start(1))
            unit = number[3] or (head[1] if head else "")
            rate = _hertz(number[1].replace(",", "."), unit, is_rate)
            if rate is not None:
                return rate
    return None


def stated_clock(notes: Iterable[str]) -> tuple[float, float] | None:
    """Return start and step [s] of an even sampling that lines state."""
    rate = stated_rate(notes)
    return None if rate is None else (0.0, 1.0 / rate)


def _hertz(text: str, unit: str, is_rate: bool) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    in_hertz = unit.endswith(("Hz", "S/s"))
    if unit and in_hertz != is_rate:
        is_rate = in_hertz
    scale = _SCALES.get(unit[:1], 1.0) if len(unit.removesuffix("ec")) > 1 and unit not in ("Hz", "S/s") else 1.0
    size = value * scale
    if size <= 0.0 or not isfinite(size):
        return None
    rate = size if is_rate else 1.0 / size
    return rate if SLOWEST <= rate <= FASTEST else None

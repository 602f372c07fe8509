"""Units of times, angles and speeds as files and maps write them, and sampling rates stated in words."""

from __future__ import annotations

import re
from collections.abc import Iterable
from math import isfinite, pi

import numpy as np

from gears3d.errors import Fault, InputError

# Words for the counts of an encoder; each may be followed by ``/s``.
COUNTS = ("counts", "count", "cts", "ct", "inc", "incr", "increments", "ticks", "pulses", "steps", "lsb", "edges")
SAMPLES = ("samples", "sample", "index")
_ALIASES = {
    "rpm": "1/min U/min min-1 min^-1 r/min rev/min r.p.m. RPM upm Upm 1/Min /min tr/min min⁻¹",
    "rev": "U turn turns revs revolution revolutions cycle cycles tr Umdr r",
    "rev/s": "U/s turns/s r/s",
    "deg": "degree degrees Grad grd ° DEG °(deg) Deg",
    "deg/s": "°/s degree/s degrees/s dps",
    "rad": "radian radians Rad RAD",
    "rad/s": "radian/s radians/s 1/s s-1 s^-1 rad*s^-1 rad·s⁻¹",
    "s": "sec secs second seconds Sekunden Sek S",
    "ms": "msec millisecond milliseconds",
    "us": "usec microsecond microseconds µs μs",
}
_SPELT = {alias: unit for unit, aliases in _ALIASES.items() for alias in aliases.split()}

# Units that are the same in capitals.
_CASELESS = {unit.lower(): unit for unit in ("rpm", "rad/s", "deg/s", "rad", "deg", "rev/s")}
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


def is_counts(unit: str) -> bool:
    """Return whether a unit is encoder counts, or counts per second.

    >>> is_counts("ticks"), is_counts("Counts/s"), is_counts("deg")
    (True, True, False)
    """
    return unit.lower().removesuffix("/s") in COUNTS


def to_si(unit: str, families: tuple[str, ...], counts: float | None = None) -> tuple[float, str]:
    """Return the factor that converts a unit to SI, and the family of the unit.

    Raises InputError when the unit is unknown, of another family, or a count of an encoder that is not declared.

    >>> to_si("U/min", ("angle", "speed")), to_si("counts", ("angle", "speed"), 4.0)
    ((0.10471975511965977, 'speed'), (1.5707963267948966, 'angle'))
    >>> to_si("Rad/S", ("speed",))
    (1.0, 'speed')
    """
    from gears3d.units import parse_any

    text = unit.strip().strip("[]()").strip()
    if is_counts(text):
        if counts is None:
            remedy = "give counts_per_revolution: edges, four times the lines of a quadrature encoder"
            raise InputError(Fault("", f"is in {text}, and how many are a revolution is not known", remedy))
        family = "speed" if text.endswith("/s") else "angle"
        if family not in families:
            raise InputError(Fault("", f"{text} are no unit here", f"give a unit of {' or '.join(families)}"))
        return 2.0 * pi / counts, family
    text = _SPELT.get(text, text)
    if text.lower() in _CASELESS:  # "Rad/S", "DEG/S", "RPM"
        text = _CASELESS[text.lower()]
    number, _, rest = text.partition(" ")
    quantity = text if _is_float(number) else f"1 {text}"
    if rest.strip() in _SPELT and quantity == text:
        quantity = f"{number} {_SPELT[rest.strip()]}"
    factor, family = parse_any(quantity, families)
    if factor == 0.0 or not isfinite(1.0 / factor):
        raise InputError(
            Fault("", f"{unit!r} has the value 0", "give the unit, such as deg, or what one of it is: 0.36 deg")
        )
    return factor, family


def scaled(values: np.ndarray, factor: float) -> np.ndarray:
    """Return values in SI, changed in place and rounded once: 9 ms are 0.009 s.

    ``values``: in a unit, float64, (n,); overwritten.

    >>> scaled(np.array([9.0]), 1e-3).tolist(), (np.array([9.0]) * 1e-3).tolist()
    ([0.009], [0.009000000000000001])
    """
    inverse = round(1 / factor) if factor else 0
    if inverse > 1 and abs(inverse * factor - 1) < 1e-12:
        return np.divide(values, inverse, out=values)
    return values if factor == 1.0 else np.multiply(values, factor, out=values)


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


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

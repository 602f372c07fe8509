"""Formatted numbers: scaled and rounded, together with the SI value."""

from __future__ import annotations

import re
from math import ceil, floor, isfinite, log10
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

# What a quantity is shown in: from which size on, scale, unit; largest first.
SCALES = {
    "velocity": ((1.0, 1.0, "m/s"), (1e-3, 1e-3, "mm/s"), (0.0, 1e-6, "µm/s")),
    "length": ((1.0, 1.0, "m"), (1e-3, 1e-3, "mm"), (1e-6, 1e-6, "µm"), (1e-9, 1e-9, "nm"), (0.0, 1e-12, "pm")),
    "time": ((1.0, 1.0, "s"), (1e-3, 1e-3, "ms"), (0.0, 1e-6, "µs")),
    "ratio": ((1e-5, 1e-2, "%"), (1e-7, 1e-6, "ppm"), (0.0, 1e-9, "ppb")),
    "cycles": ((0.0, 1.0, "cycle"),),
    "torque": ((0.1, 1.0, "N·m"), (0.0, 1e-3, "mN·m")),
    "angle": ((0.1, 1.0, "rad"), (1e-4, 1e-3, "mrad"), (0.0, 1e-6, "µrad")),
    "speed": ((0.0, np.pi / 30.0, "rpm"),),
    "power": ((1.0, 1.0, "W"), (1e-3, 1e-3, "mW"), (1e-6, 1e-6, "µW"), (0.0, 1e-9, "nW")),
}

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

# How the names of the contract end, and what kind of quantity that makes them.
SUFFIXES = (
    ("_J_s", "power"),
    ("_rad_s", "speed"),
    ("_rad", "angle"),
    ("_N_m", "torque"),
    ("_m_s", "velocity"),
    ("_m", "length"),
    ("_s", "time"),
    ("_cycles", "cycles"),
)


class Figure(NamedTuple):
    """A number or word to be shown.

    Args:
        text: what is read.
        value: the bare SI value, ``None`` for words.
    """

    text: str
    value: float | None = None


def figure(value: Any, kind: str = "", digits: int = 4) -> Figure:
    r"""Return a value as it is read.

    >>> figure(0.0312425, "velocity").text
    '31.24\xa0mm/s'
    >>> figure(0.0, "length").text
    '0\xa0m'
    >>> figure(True).text
    'yes'
    """
    if isinstance(value, bool):
        return Figure("yes" if value else "no")
    if value is None or (isinstance(value, Real) and not isfinite(float(value))):
        return Figure("–")
    if not isinstance(value, Real):
        return Figure(str(value).replace("_sided", "-sided").replace("_", " "))
    if isinstance(value, int) and not kind:
        return Figure(str(value), float(value))
    number = float(value)
    scales = SCALES.get(kind, ((0.0, 1.0, ""),))
    _, scale, unit = next(one for one in scales if abs(number) >= one[0]) if number else scales[0]
    return Figure(f"{plain(number / scale, digits)}\N{NO-BREAK SPACE}{unit}".strip(), number)


def plain(number: float, digits: int = 4) -> str:
    """Return a number with so many significant digits, without an exponent where it stays readable.

    >>> plain(1234.5678), plain(-0.5), plain(3.2e-7)
    ('1235', '−0.5', '3.2·10⁻⁷')
    """
    if number == 0:
        return "0"
    if 1e-3 <= abs(number) < 10 ** max(digits, 6):
        text = f"{number:.{max(digits - 1 - floor(log10(abs(number))), 0)}f}".replace("-", "−")
        return text.rstrip("0").rstrip(".") if "." in text else text
    mantissa, power = f"{number:.{digits - 1}e}".split("e")
    mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"{mantissa.replace('-', '−')}·10{str(int(power)).translate(RAISED)}"


def kind_of(name: str) -> str:
    """Return the kind of quantity that a name of the contract stands for.

    >>> kind_of("flight_height_min_m"), kind_of("impacts_matched")
    ('length', '')
    """
    return next((kind for end, kind in SUFFIXES if name.endswith(end)), "")


# Typography of units.
SIGNS = {r"\bu(?=[ms]\b)": "µ", r"\bdeg\b": "°", r"(?<=\w) (?=\w)": "·", r"\*(?!\*)": "·", r"\^2": "²", r"\^3": "³"}


def pretty(text: str) -> str:
    """Return a quantity with its unit in the field's signs; other text stays as it is.

    >>> pretty("250 um"), pretty("0.0695 kg m^2"), pretty("a measured file")
    ('250 µm', '0.0695 kg·m²', 'a measured file')
    """
    if not re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)? \S.*", text):
        return text
    number, unit = text.split(" ", 1)
    for plain_sign, sign in SIGNS.items():
        unit = re.sub(plain_sign, sign, unit)
    return f"{number}{'' if unit == '°' else ' '}{unit}"


def sized(value: float | None, unit: str, digits: int = 3) -> Figure:
    r"""Return a size with its SI unit as it is read.

    >>> sized(2.5e-6, "rad").text, sized(3e-6, "m").text, sized(0.5, "sigma").text, sized(0.62, "1").text
    ('2.5\xa0µrad', '3\xa0µm', '0.5\xa0σ', '62\xa0%')
    """
    if value is None or not isfinite(value):
        return Figure("–")
    kind = {"s": "time", "m": "length", "m/s": "velocity"}.get(unit)
    if kind:
        return figure(float(value), kind, digits)
    others = {"rad": (1e6, "µrad"), "rad/s^2": (1.0, "rad/s²"), "sigma": (1.0, "σ"), "1": (100.0, "%")}
    scale, name = others.get(unit, (1.0, unit))
    return Figure(f"{plain(float(value) * scale, digits)}\N{NO-BREAK SPACE}{name}".strip(), float(value))


def percent(value: float | None) -> Figure:
    r"""Return a part of a whole as it is read.

    >>> percent(0.12345).text, percent(0.99987).text, percent(None).text
    ('12.3\xa0%', '> 99.9\xa0%', '–')
    """
    if value is None:
        return Figure("–")
    value = 0.0 if abs(value) < 1e-6 else value
    text = "> 99.9" if 0.999 < value < 1.0 else plain(100.0 * value, 3)
    return Figure(f"{text}\N{NO-BREAK SPACE}%", float(value))


# Kind of quantity by SI unit, where another unit is easier to read.
KINDS = {"m": "length", "s": "time", "rad": "angle", "N m": "torque", "m/s": "velocity"}


def spread(value: float, low: float, high: float, unit: str = "") -> tuple[Figure, str]:
    r"""Return a value with as many digits as its 95 % interval leaves, and the interval in words.

    >>> number, interval = spread(0.30012713, 0.299917, 0.300337)
    >>> number.text, interval
    ('0.30013', '± 2.1·10⁻⁴ (95 %)')
    >>> spread(2.5e-4, 2.4e-4, 2.6e-4, "m")[1], spread(0.0, 0.0, 2.5e-4)[1]
    ('± 10\xa0µm (95 %)', '95 %: 0 to 2.5·10⁻⁴')
    """
    scale, tail = 1.0, f"\N{NO-BREAK SPACE}{pretty(f'1 {unit}')[1:].strip()}" if unit else ""
    if unit in KINDS:
        size = max((abs(one) for one in (value, low, high) if isfinite(one)), default=0.0)
        _, scale, name = next(one for one in SCALES[KINDS[unit]] if size >= one[0])
        tail = f"\N{NO-BREAK SPACE}{name}"
    shown, low, high = value / scale, low / scale, high / scale
    half, digits = 0.5 * (high - low), 4
    if isfinite(half) and half > 0.0 and shown:
        digits = int(min(max(ceil(log10(abs(shown) / half)) + 1, 2), 9)) if half < abs(shown) else 2
    number = Figure(plain(shown, digits) + tail, value)
    if isfinite(half) and abs(shown - 0.5 * (low + high)) <= 0.05 * half:
        return number, f"± {plain(half, 2)}{tail} (95 %)"
    ends = [plain(end, max(digits, 2)) if isfinite(end) else "∞" for end in (low, high)]
    return number, f"95 %: {ends[0]} to {ends[1]}{tail}"

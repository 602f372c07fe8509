"""Formatted numbers: scaled and rounded, together with the SI value."""

from __future__ import annotations

from math import isfinite
from numbers import Real
from typing import Any, NamedTuple

SCALES = {
    "velocity": ((1.0, 1.0, "m/s"), (1e-3, 1e-3, "mm/s"), (0.0, 1e-6, "µm/s")),
    "length": ((1.0, 1.0, "m"), (1e-3, 1e-3, "mm"), (1e-6, 1e-6, "µm"), (1e-9, 1e-9, "nm"), (0.0, 1e-12, "pm")),
    "time": ((1.0, 1.0, "s"), (1e-3, 1e-3, "ms"), (0.0, 1e-6, "µs")),
    "ratio": ((1e-5, 1e-2, "%"), (1e-7, 1e-6, "ppm"), (0.0, 1e-9, "ppb")),
    "cycles": ((0.0, 1.0, "cycle"),),
    "power": ((1.0, 1.0, "W"), (1e-3, 1e-3, "mW"), (1e-6, 1e-6, "µW"), (0.0, 1e-9, "nW")),
}
"""What a quantity is shown in: from which size on, scale, unit; largest first."""

RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

SUFFIXES = (
    ("_J_s", "power"),
    ("_m_s", "velocity"),
    ("_m", "length"),
    ("_s", "time"),
    ("_cycles", "cycles"),
)
"""How the names of the contract end, and what kind of quantity that makes them."""


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
        whole = len(str(int(abs(number))))
        leading = whole if abs(number) >= 1 else 0
        text = f"{number:.{max(digits - leading, 0)}f}".replace("-", "−")
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

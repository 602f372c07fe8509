"""Puts units on and takes them off; the only file that knows pint.

Every quantity belongs to a *family* (length, speed, frequency, torque ...), which is narrower than a dimension: a
rotational speed is not a frequency and an energy is not a torque, though their dimensions agree. Inside the package
everything is a bare SI float.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import Any

from gears3d.errors import Fault, InputError, did_you_mean


@dataclass(frozen=True)
class Family:
    """A unit family.

    Args:
        name: as parameters and keys name it.
        words: as people call it, with its article.
        si: its SI unit; empty for a bare number.
        example: a typical value with its unit.
        units: common spellings and their factors to SI; what is not listed here is looked up in pint.
        people: the units that people read, finest first.
    """

    name: str
    words: str
    si: str
    example: str
    units: dict[str, float]
    people: tuple[str, ...] = ()


# The unit families by name.
FAMILIES: dict[str, Family] = {}


def add_family(
    name: str,
    words: str,
    si: str,
    example: str,
    units: dict[str, float] | None = None,
    people: tuple[str, ...] = (),
) -> Family:
    """Make a unit family known, e.g. for the parameter of an effect in another package.

    Args:
        name: of the family.
        words: as people call it, with its article.
        si: its SI unit.
        example: a typical value with its unit.
        units: common spellings and their factors to SI.
        people: the units that people read, finest first; all must be in ``units`` or be ``si``.

    Returns:
        The family.

    >>> add_family("flow", "a volume flow", "m^3/s", "0.2 l/min").name
    'flow'
    >>> round(parse("6 l/min", "flow"), 12)
    0.0001
    """
    FAMILIES[name] = family = Family(name, words, si, example, {si: 1.0, **(units or {})}, people or (si,))
    _unit.cache_clear()
    return family


# Characters of a quantity.
LONGEST = 200
# Above it not every whole number is a float of its own.
MOST_COUNT = 2**53 - 1
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
_OFFSETS = {"degC": 273.15, "°C": 273.15}
_RAISED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_SUPERSCRIPT = re.compile(r"[⁻⁺]?[⁰¹²³⁴⁵⁶⁷⁸⁹]+")
_SPELLING = str.maketrans({"·": " ", "⋅": " ", "−": "-", "\u00a0": " "})
_SIGNS = ("%", "°", "°C")
_TOKEN = re.compile(r" ?(?:(°C?|%|[^\W\d_]\w*)|(?:\^|\*\*) ?([+-]?[1-9])(?![0-9.])|([*/()])) ?")


def parse(text: Any, family: str) -> float:
    """Return a quantity in SI units.

    Args:
        text: number and unit, e.g. ``"20 rpm"``; a bare number for ``"ratio"`` and ``"count"``.
        family: the unit family that is expected.

    Returns:
        The value in the family's SI unit.

    Raises:
        InputError: no quantity, an unknown unit, or a unit of another family; one fault without a key.

    >>> parse("250 um", "length")
    0.00025
    >>> parse("2 J", "torque")
    Traceback (most recent call last):
    gears3d.errors.InputError: '2 J' is an energy, not a torque (a torque is written in N m, e.g. "0.22 N m")
    """
    wanted = FAMILIES[family]
    number, unit = _split(text, wanted)
    if family == "count" and number != int(number):
        raise _error(f"{text!r} is not {wanted.words}", f"e.g. {wanted.example}")
    if family == "count" and abs(number) > MOST_COUNT:
        raise _error(f"{_shown(text)} is beyond {MOST_COUNT}", "give a smaller whole number")
    if not unit:
        if wanted.si:
            raise _error(f"{text!r} has no unit; {wanted.words} is needed", f'e.g. "{wanted.example}"')
        return number
    found, factor = _unit(unit, family)
    if found != family:
        raise _error(f"{str(text)!r} is {_words(found)}, not {wanted.words}", _hint(number * factor, found, wanted))
    return _scaled(number, factor, text) + _OFFSETS.get(unit, 0.0)


def parse_any(text: Any, families: tuple[str, ...]) -> tuple[float, str]:
    """Return a quantity of one of several families in SI units, and its family.

    Args:
        text: number and unit.
        families: the unit families that are allowed.

    Returns:
        The value in the SI unit of its family, and the family.

    Raises:
        InputError: as :func:`parse` raises it.

    >>> parse_any("2 rad/s^2", ("speed", "acceleration"))
    (2.0, 'acceleration')
    """
    number, unit = _split(text, FAMILIES[families[0]])
    found, factor = _unit(unit, families[0]) if unit else ("", 1.0)
    if found in families:
        return _scaled(number, factor, text), found
    if len(families) == 1 or not unit:
        return parse(text, families[0]), families[0]
    wanted = " or ".join(FAMILIES[family].words for family in families)
    examples = ", ".join(f'"{FAMILIES[family].example}"' for family in families)
    raise _error(f"{str(text)!r} is {_words(found)}, not {wanted}", f"e.g. {examples}")


def show(value: float, family: str, digits: int = 6) -> str:
    """Return a quantity as people read it.

    Args:
        value: in the family's SI unit.
        family: its unit family.
        digits: significant digits.

    Returns:
        Number and unit; :func:`parse` reads it back.

    >>> show(0.00025, "length"), show(0.3, "ratio"), show(2.0943951023931953, "speed")
    ('250 um', '0.3', '20 rpm')
    """
    kind = FAMILIES[family]
    if not math.isfinite(value):
        return f"{value} {kind.si}".strip()
    unit = kind.people[0]
    for coarser in kind.people[1:]:
        if abs(value) >= 0.9999999 * kind.units[coarser]:
            unit = coarser
    if value == 0:
        unit = kind.si if kind.si in kind.people else kind.people[-1]
    return f"{value / kind.units[unit]:.{digits}g} {unit}".strip()


def _split(text: Any, wanted: Family) -> tuple[float, str]:
    """Return number and unit."""
    if isinstance(text, int | float) and not isinstance(text, bool):
        try:
            number, unit = float(text), ""
        except OverflowError:
            number, unit = math.inf, ""
    else:
        tidy = _tidy(text) if isinstance(text, str) and len(text) <= LONGEST else ""
        match = _NUMBER.match(tidy)
        if match is None:
            raise _error(f"{_shown(text)} is no quantity; {wanted.words} is needed", f'e.g. "{wanted.example}"')
        number, unit = float(match[0]), tidy[match.end() :].strip()
        if number == 0.0 and re.search("[1-9]", match[0].lower().partition("e")[0]):
            raise _error(f"{text!r} is too small for a number", "write 0 if that is meant")
    if re.match(r"[.,']\d", unit):
        point = f'"{str(text).replace(",", ".")}"' if str(text).count(",") == 1 and "." not in str(text) else ""
        remedy = f"the decimal point is a point, and nothing parts thousands, e.g. {point or repr(wanted.example)}"
        raise _error(f"{text!r} has {'a comma' if unit[0] == ',' else 'a mark'} in its number", remedy)
    prefix, _, rest = unit.partition(" ")
    if prefix in _PREFIXES:
        meant = [known for known in wanted.units if known == prefix + rest or (not rest and known[:1] == prefix)]
        example = f"{number:g} {meant[0]}" if meant else wanted.example
        raise _error(
            f"{text!r} has the prefix {prefix!r} without a unit; {wanted.words} is needed", f'e.g. "{example}"'
        )
    if not math.isfinite(number):
        raise _error(f"{_shown(text)} is not finite; {wanted.words} is needed", f'e.g. "{wanted.example}"')
    return number, unit


def _tidy(text: str) -> str:
    """Return a text with one spelling of signs, powers and blanks."""
    text = _SUPERSCRIPT.sub(lambda match: "^" + match[0].translate(_RAISED), text)
    return " ".join(text.translate(_SPELLING).split())


def _shown(value: Any) -> str:
    """Return the written value, shortened for a message."""
    if isinstance(value, int) and abs(value) >= 10**40:
        return "a number of more than 40 digits"
    told = repr(value)
    return told if len(told) <= 80 else f"{told[:60]}... ({len(told)} characters)"


def _scaled(number: float, factor: float, text: Any) -> float:
    """Return the product, rounded once: ``9 mm`` is 0.009 m and not 0.009000000000000001 m."""
    inverse = round(1 / factor)
    value = number / inverse if inverse > 1 and abs(inverse * factor - 1) < 1e-12 else number * factor
    if not math.isfinite(value) or (value == 0.0) != (number == 0.0):
        raise _error(f"{text!r} is too {'small' if value == 0.0 else 'large'} for a number in SI units", "check it")
    return value


def _error(message: str, remedy: str) -> InputError:
    return InputError(Fault("", message, remedy))


def _words(found: str) -> str:
    return FAMILIES[found].words if found in FAMILIES else f"of dimension {found}"


def _hint(value: float, found: str, wanted: Family) -> str:
    """Return what to write in place of a quantity of the wrong family."""
    given = show(value, found) if found in FAMILIES else ""
    if (found, wanted.name) == ("speed", "frequency"):
        right = show(value / (2 * math.pi), "frequency")
        return f'{given} are {right.split()[0]} turns a second: if that is meant, write "{right}"'
    if (found, wanted.name) == ("frequency", "speed"):
        return f'{given} as turns a second would be "{show(value * 2 * math.pi, "speed")}"'
    if (found, wanted.name) == ("energy", "torque"):
        return f'a torque is written in N m, e.g. "{wanted.example}"'
    if (found, wanted.name) == ("torque", "energy"):
        return f'an energy is written in J, e.g. "{wanted.example}"'
    return f'e.g. "{wanted.example}"' if wanted.si else f"e.g. {wanted.example}"


@cache
def _unit(unit: str, family: str) -> tuple[str, float]:
    """Return the family that a unit belongs to (``family`` if it can) and its factor to SI."""
    for kind in (FAMILIES[family], *FAMILIES.values()):
        if unit in kind.units:
            return kind.name, kind.units[unit]
    signature, factor = _look_up(unit)
    for kind in (FAMILIES[family], *FAMILIES.values()):
        if kind.name == "count":
            continue
        for own in kind.units:
            if own not in _OFFSETS and _look_up(own)[0] == signature:
                return kind.name, factor
    return " ".join(f"{base}^{power:g}" for base, power in signature) or "1", factor


@cache
def _registry() -> Any:
    import pint

    registry = pint.UnitRegistry()
    registry.define("rev = turn")
    return registry


@cache
def _look_up(unit: str) -> tuple[tuple[tuple[str, float], ...], float]:
    """Return a unit's signature (base units, with angle and energy kept apart) and its factor to SI.

    Pint receives single names only: it evaluates other expressions.

    Raises:
        InputError: it is not a unit, pint does not know a name in it, or it has an offset.
    """
    import pint

    if not unit:
        return (), 1.0
    registry = _registry()
    powers = _powers(unit)
    try:
        parsed = registry.Unit("")
        for name, power in powers.items():
            parsed *= registry.parse_units(name) ** power
        factor = float(registry.Quantity(1.0, parsed).to_root_units().to_base_units().magnitude)
    except (pint.PintError, AttributeError, TypeError, ValueError, ArithmeticError, KeyError, AssertionError) as why:
        raise _unknown(unit) from why
    if not registry.Quantity(1.0, parsed)._is_multiplicative:
        raise _error(f"unit {unit!r} has an offset", 'write degC or K, e.g. "50 degC"')
    if not powers or not math.isfinite(factor) or factor == 0.0:
        raise _unknown(unit)
    return _signature(registry, parsed), factor


def _powers(unit: str) -> dict[str, int]:
    """Return the names in a unit with their powers.

    A unit is made of names parted by blanks, ``*`` or ``/``, each with a power of one digit or none, and of such units
    in parentheses; 1 stands only above a line.

    >>> _powers("N m s/rad"), _powers("1/min"), _powers("mN/(rad/s)**2")
    ({'N': 1, 'm': 1, 's': 1, 'rad': -1}, {'min': -1}, {'mN': 1, 'rad': -2, 's': 2})
    """
    stack: list[tuple[dict[str, int], int]] = []
    powers: dict[str, int] = {}
    last: dict[str, int] = {}
    sign, after_sign, at = 1, True, 0
    if unit.startswith("1") and unit[1:].lstrip().startswith("/"):
        after_sign, at = False, 1
    while at < len(unit):
        match = _TOKEN.match(unit, at)
        name, power, mark = match.groups() if match else ("", "", "")
        if match is None or (name and not name.isidentifier() and name not in _SIGNS):
            raise _unknown(unit)
        at = match.end()
        if name or mark == ")":
            if mark and (not stack or after_sign):
                raise _unknown(unit)
            if name:
                last = {name: sign}
            else:
                inner, (powers, sign) = powers, stack.pop()
                last = {each: sign * count for each, count in inner.items()}
            _add(powers, last, 1)
            sign, after_sign = 1, False
        elif power and last and not after_sign:
            _add(powers, last, int(power) - 1)
            last = {}
        elif mark in ("*", "/") and not after_sign:
            sign, after_sign, last = (-1 if mark == "/" else 1), True, {}
        elif mark == "(" and (after_sign or at > 1) and len(stack) < 3:
            stack.append((powers, sign))
            powers, sign, after_sign, last = {}, 1, True, {}
        else:
            raise _unknown(unit)
    if stack or after_sign or any(abs(count) > 9 for count in powers.values()):
        raise _unknown(unit)
    return {name: count for name, count in powers.items() if count}


def _add(powers: dict[str, int], more: dict[str, int], times: int) -> None:
    for name, count in more.items():
        powers[name] = powers.get(name, 0) + times * count


def _unknown(unit: str) -> InputError:
    known = [spelling for kind in FAMILIES.values() for spelling in kind.units if spelling]
    alike = [spelling for spelling in known if spelling.lower() == unit.lower()]
    nearest = did_you_mean(alike[0] if alike else unit, known)
    remedy = nearest if nearest.startswith("did") else 'write number and unit, e.g. "250 um"'
    return _error(f"unit {unit!r} is not known", remedy)


def _signature(registry: Any, parsed: Any) -> tuple[tuple[str, float], ...]:
    powers: dict[str, float] = {}
    for base, power in registry.get_root_units(parsed)[1]._units.items():
        powers[base] = powers.get(base, 0.0) + float(power)
    for token, power in parsed._units.items():
        if registry.Unit(token).dimensionality in (registry.J.dimensionality, registry.W.dimensionality):
            powers["joule"] = powers.get("joule", 0.0) + float(power)
    return tuple(sorted((base, power) for base, power in powers.items() if power))


_MICRO = ("u", "µ", "μ")
# Prefixes that are no unit of the field by themselves.
_PREFIXES = ("k", "M", "G", "n", *_MICRO)
_DEG = math.pi / 180
_RPM = math.pi / 30


def _micro(unit: str, factor: float = 1e-6) -> dict[str, float]:
    return {prefix + unit: factor for prefix in _MICRO}


add_family("length", "a length", "m", "250 um", {"mm": 1e-3, "cm": 1e-2, "nm": 1e-9, **_micro("m")}, ("um", "mm", "m"))
add_family("per_length", "a reciprocal length", "1/m", "50 1/mm", {"1/mm": 1e3})
add_family("angle", "an angle", "rad", "20 deg", {"mrad": 1e-3, "deg": _DEG, "°": _DEG, **_micro("rad")}, ("deg",))
add_family("time", "a time", "s", "5 s", {"ms": 1e-3, "min": 60.0, **_micro("s")}, ("us", "ms", "s"))
add_family("speed", "a rotational speed", "rad/s", "30 rpm", {"rpm": _RPM, "deg/s": _DEG}, ("rpm",))
add_family("frequency", "a frequency", "Hz", "3 Hz", {"kHz": 1e3, "MHz": 1e6, "mHz": 1e-3}, ("Hz", "kHz"))
add_family("velocity", "a velocity", "m/s", "0.1 mm/s", {"mm/s": 1e-3, **_micro("m/s")}, ("um/s", "mm/s", "m/s"))
add_family("linear_acceleration", "an acceleration along a line", "m/s^2", "0.5 m/s^2", {"mm/s^2": 1e-3})
add_family("acceleration", "an angular acceleration", "rad/s^2", "300 rad/s^2", {"deg/s^2": _DEG})
add_family("torque", "a torque", "N m", "0.22 N m", {"Nm": 1.0, "mN m": 1e-3, "mNm": 1e-3}, ("mN m", "N m"))
add_family("energy", "an energy", "J", "2 mJ", {"mJ": 1e-3})
add_family("power", "a power", "W", "50 W", {"kW": 1e3, "N m/s": 1.0})
add_family("force", "a force", "N", "14.5 N", {"kN": 1e3, "mN": 1e-3})
add_family("mass", "a mass", "kg", "0.38 kg", {"g": 1e-3})
add_family("inertia", "a moment of inertia", "kg m^2", "0.0695 kg m^2", {"kg mm^2": 1e-6, "g mm^2": 1e-9})
add_family("stiffness", "a stiffness", "N/m", "2.6e6 N/m", {"N/mm": 1e3, "N/um": 1e6})
add_family("damping", "a damping", "N s/m", "100 N s/m")
add_family(
    "rotational_damping", "a rotational damping", "N m s/rad", "1e-3 N m s/rad", {"N m s": 1.0, "mN m s/rad": 1e-3}
)
add_family("rotational_stiffness", "a rotational stiffness", "N m/rad", "1e4 N m/rad")
add_family("slowness", "a slowness", "s/m", "-4 s/m", {"s/mm": 1e3})
add_family("density", "a density", "kg/m^3", "7850 kg/m^3", {"g/cm^3": 1e3})
add_family("pressure", "a pressure", "Pa", "2 bar", {"MPa": 1e6, "GPa": 1e9, "bar": 1e5})
add_family("viscosity", "a dynamic viscosity", "Pa s", "10 mPa s", {"mPa s": 1e-3})
add_family("kinematic_viscosity", "a kinematic viscosity", "m^2/s", "34 mm^2/s", {"mm^2/s": 1e-6})
add_family("volume", "a volume", "m^3", "2 l", {"l": 1e-3})
add_family("temperature", "a temperature", "K", "50 degC", dict.fromkeys(_OFFSETS, 1.0))
add_family("ratio", "a plain number", "", "0.3", {"%": 0.01, "percent": 0.01})
add_family("count", "a whole number", "", "90")

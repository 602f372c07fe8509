"""Scenario documents that are mutated: each loads, or is refused with a reason; what loads says what was written."""

import copy
import math
import random
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import tomlkit

from gears3d.effects import catalogue
from gears3d.errors import GearsError
from gears3d.scenario import STARTERS, Scenario, load
from gears3d.scenario.document import literal, names, read
from gears3d.scenario.starting import starter
from gears3d.simulation import MODELS, refusals
from gears3d.units import FAMILIES, parse
from tests.fuzz import isolated
from tests.fuzz.tally import Tally

BASES = 40
"""Shipped scenarios that are mutated, besides the starters."""
SOLID = 0.02
"""Share of accepted scenarios whose gears are made."""
Way = tuple[str | int, ...]


def run(seed: int) -> Iterator[Tally]:
    """Try mutated scenarios without end; yield the tally after every batch."""
    return isolated.run("scenarios", seed)


def prepare(folder: Path) -> Callable[[random.Random, int], tuple[str, str]]:
    """Return what tries one case."""
    bases = [starter(kind, "fuzz") for kind in STARTERS]
    bases += [read(name).text() for name in random.Random(0).sample(names(), min(BASES, len(names())))]
    plain = [tomllib.loads(base) for base in bases]

    def attempt(rng: random.Random, case: int) -> tuple[str, str]:
        at = rng.randrange(len(bases))
        how = rng.random()
        if how < 0.3:
            source: Any = _text(rng, bases[at])
        elif how < 0.9:
            source = _tables(rng, plain[at], plain)
        else:
            source = _chain(rng, bases, folder, case)
        overrides = [_override(rng, plain[at]) for _ in range(rng.choice((0, 0, 0, 0, 1, 2)))]
        return _judge(rng, source, overrides)

    return attempt


def _judge(rng: random.Random, source: Any, overrides: list[str]) -> tuple[str, str]:
    try:
        scenario = load(source, overrides)
        faults = refusals(scenario, rng.choice(tuple(MODELS)))
        assert all(fault.message for fault in faults)
    except GearsError as error:
        return ("refused", "") if str(error).strip() else ("silent", "an error without a word")
    again = load(scenario.document)
    if (difference := _difference(scenario, again)) is not None:
        return "changed", f"document read again: {difference}"
    if rng.random() < 0.25:
        difference = _difference(scenario, load(tomllib.loads(scenario.document)))
        if difference is not None:
            return "changed", f"mapping read again: {difference}"
    if rng.random() < 0.25 and (told := _other_unit(rng, scenario)):
        return "changed", told
    if rng.random() < SOLID:
        return _made(scenario)
    return "accepted", ""


def _made(scenario: Scenario) -> tuple[str, str]:
    from gears3d.gears import solid

    try:
        pair = scenario.pair()
        scenario.rows()
        solid(pair, "loose")
    except GearsError:
        return "no solid", ""
    return "made", ""


def _values(item: Any, way: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every value of a scenario with the way to it."""
    if is_dataclass(item):
        for one in fields(item):
            if way or one.name not in ("document", "path"):
                yield from _values(getattr(item, one.name), f"{way}.{one.name}")
    elif isinstance(item, dict):
        for key in sorted(item):
            yield from _values(item[key], f"{way}.{key}")
    elif isinstance(item, (list, tuple)):
        yield f"{way}.length", len(item)
        for at, one in enumerate(item):
            yield from _values(one, f"{way}[{at}]")
    else:
        yield way, item


def _difference(one: Scenario, other: Scenario) -> str | None:
    """Return where two scenarios differ in a bit."""
    for (way, mine), (where, theirs) in zip(_values(one), _values(other), strict=True):
        if way != where or type(mine) is not type(theirs) or repr(mine) != repr(theirs):
            return f"{way} is {mine!r}, then {where} is {theirs!r}"
    return None


def _other_unit(rng: random.Random, scenario: Scenario) -> str | None:
    """Write one value in another unit of its family; return what that changed."""
    document = tomllib.loads(scenario.document)
    ways = [(way, value) for way, value in _leaves(document) if isinstance(value, str)]
    rng.shuffle(ways)
    for way, value in ways:
        family, si = _family_of(value)
        if family is None or way[0] == "expect" or way[-1] == "uncertainty":
            continue
        unit = rng.choice([each for each in FAMILIES[family].units if each])
        number = si / FAMILIES[family].units[unit]
        written = f"{number!r} {unit}"
        if not math.isclose(parse(written, family), si, rel_tol=1e-12):
            return f"{value!r} is {si!r}, {written!r} is {parse(written, family)!r}"
        changed = copy.deepcopy(document)
        _put(changed, way, written)
        try:
            other = load(changed)
        except GearsError as error:
            return None if "must be" in str(error) else f"{way}: {value!r} is taken, {written!r} is not: {error}"
        for (where, mine), (_, theirs) in zip(_values(scenario), _values(other), strict=True):
            same = mine == theirs or (isinstance(mine, float) and math.isclose(mine, theirs, rel_tol=1e-9))
            if not same:
                return f"{way}: {value!r} as {written!r}: {where} is {mine!r}, then {theirs!r}"
        return None
    return None


def _family_of(value: str) -> tuple[str | None, float]:
    for family in ("length", "speed", "frequency", "torque", "inertia", "angle", "time", "velocity", "stiffness"):
        try:
            return family, parse(value, family)
        except GearsError:
            continue
    return None, 0.0


def _leaves(item: Any, way: Way = ()) -> Iterator[tuple[Way, Any]]:
    inner = item.items() if isinstance(item, dict) else enumerate(item) if isinstance(item, list) else ()
    for key, value in inner:
        yield (*way, key), value
        yield from _leaves(value, (*way, key))


def _put(item: Any, way: Way, value: Any) -> None:
    for key in way[:-1]:
        item = item[key]
    item[way[-1]] = value


def _take(item: Any, way: Way) -> Any:
    for key in way[:-1]:
        item = item[key]
    return item.pop(way[-1])


# What is written in place of something else.

NUMBERS = (
    "0", "-0", "1", "-1", "1e-300", "1e300", "-1e300", "5e-324", "1e308", "1e400", "1e-400", "nan", "inf", "-inf",
    "0.5",
    "1" + "0" * 400, "3.", ".5", "+7", "1_000", "0x10", "1,5", "1.000.000", "٣", "½", "9007199254740993", "1e5",
    "12345.678", "0.1", "1e-6",
)  # fmt: skip
ODD = (
    "", " ", "\n", "\t", "\0", "nul\0byte", "é", "\u202e", "\ufeff", "𝟙 m", "m" * 300, "()", "^0", "{m}", "m=1", "um!",
    "%", "°", "'", '"', "\\", "/dev/zero", "../../etc/passwd", "a\u0301", "1 m^9^9^9", "1 m/0", "1 (m", "1 m)",
    "1 m**-1",
    "1 m⁻¹", "20 periods", "1e9 periods", "-2 periods", "nan periods", "active", "both", "reverse", "drive", "loose",
    "linear",
)  # fmt: skip


def _unit(rng: random.Random) -> str:
    family = rng.choice(tuple(FAMILIES.values()))
    known = [unit for unit in family.units if unit]
    if not known or rng.random() < 0.1:
        return rng.choice(
            ("furlong", "lbf ft", "m/s/s", "degC", "K", "dB", "turn", "kg m^2", "m^0", "rad*s^-1", "1/s", "Hz")
        )
    return rng.choice(known)


def _quantity(rng: random.Random) -> str:
    number = rng.choice(NUMBERS) if rng.random() < 0.5 else f"{rng.gauss(0, 1) * 10.0 ** rng.randint(-8, 8):.6g}"
    return f"{number} {_unit(rng)}"


def _value(rng: random.Random, depth: int = 0) -> Any:
    """Return a value of any kind."""
    kind = rng.randrange(14)
    if kind < 4:
        return _quantity(rng)
    if kind == 4:
        return rng.choice(ODD)
    if kind == 5:
        return rng.choice((0, 1, -1, 2, 7, 90, 1000, 2**31, 2**53 + 1, -(2**63), 10**40))
    if kind == 6:
        return rng.choice((0.0, -0.0, 0.3, 1.0, 1e300, 5e-324, math.inf, -math.inf, math.nan))
    if kind == 7:
        return rng.random() < 0.5
    if kind == 8:
        return {"value": _value(rng, depth + 1), "uncertainty": rng.choice(("5 %", "1 um", "-5 %", 3, _quantity(rng)))}
    if kind == 9 and depth < 4:
        return [_value(rng, depth + 1) for _ in range(rng.randrange(4))]
    if kind == 10 and depth < 4:
        return {_key(rng): _value(rng, depth + 1) for _ in range(rng.randrange(4))}
    if kind == 11:
        deep: Any = 1
        for _ in range(rng.choice((3, 20, 90, 120))):
            deep = [deep] if rng.random() < 0.5 else {"a": deep}
        return deep
    return "".join(
        chr(rng.choice((rng.randrange(32, 127), rng.randrange(0x20, 0xD7FF)))) for _ in range(rng.randrange(9))
    )


def _key(rng: random.Random) -> str:
    known = (
        "module",
        "teeth",
        "mean",
        "amplitude",
        "value",
        "uncertainty",
        "kind",
        "phase",
        "flank",
        "effect",
        "tip_relief",
    )
    return rng.choice((*known, "", "a.b", "é", " ", "modul", '"', "\n", "extends", "versions", "format"))


def _near(rng: random.Random, value: Any) -> Any:
    """Return a value that is like another."""
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        return _value(rng)
    if isinstance(value, str):
        number, blank, unit = value.partition(" ")
        try:
            size = float(number)
        except ValueError:
            return rng.choice((value.upper(), value + " ", value[:-1], rng.choice(ODD)))
        kind = rng.randrange(6)
        if kind == 0:
            return f"{size * 10.0 ** rng.randint(-3, 3)!r}{blank}{unit}"
        if kind == 1:
            return f"{size * rng.uniform(0.5, 2.0)!r}{rng.choice(('', ' ', '  '))}{unit}"
        if kind == 2:
            return f"{rng.choice(NUMBERS)}{blank}{unit}"
        if kind == 3:
            return f"{number} {_unit(rng)}"
        if kind == 4:
            return {"value": value, "uncertainty": rng.choice(("5 %", value, "1e300 %", _quantity(rng)))}
        return number + blank + _flipped(rng, unit)
    return rng.choice((-value, value * 2, value + 1, float(value) + 0.5, str(value), value * 10**6, 0))


def _flipped(rng: random.Random, text: str) -> str:
    if not text:
        return rng.choice(ODD)
    at = rng.randrange(len(text))
    new = rng.choice(
        (chr(rng.randrange(1, 128)), chr(rng.randrange(0xA0, 0x2FFF)), "", text[at] * 2, "^", "/", "*", "(", "=")
    )
    return text[:at] + new + text[at + 1 :]


# Ways to mutate.


def _tables(rng: random.Random, base: dict[str, Any], others: list[dict[str, Any]]) -> Any:
    """Return a document with some values, keys and tables changed, as text or as a mapping."""
    document = copy.deepcopy(base)
    for _ in range(rng.choice((0, 1, 1, 1, 2, 3))):
        ways = [way for way, _ in _leaves(document)]
        if not ways:
            break
        way = rng.choice(ways)
        kind = rng.randrange(12)
        if kind < 5:
            _put(document, way, _near(rng, dict(_leaves(document))[way]))
        elif kind < 7:
            _put(document, way, _value(rng))
        elif kind == 7:
            _take(document, way)
        elif kind == 8:
            value = _take(document, way)
            _put(document, (*way[:-1], _key(rng)) if isinstance(way[-1], str) else (_key(rng),), value)
        elif kind == 9:
            _effects(rng, document)
        elif kind == 10:
            other = rng.choice(others)
            name = rng.choice(tuple(other))
            document[name] = copy.deepcopy(other[name])
        else:
            parent = way[:-1]
            _put(document, (*parent, _key(rng)) if not parent or isinstance(way[-1], str) else way, _value(rng))
    if rng.random() < 0.1:
        return document
    try:
        return tomlkit.dumps(document) + "\n"
    except (TypeError, ValueError, RecursionError):
        return document


def _effects(rng: random.Random, document: dict[str, Any]) -> None:
    """Add effects, most of them whole."""
    kinds = catalogue()
    made = document.setdefault("effect", [])
    for _ in range(rng.choice((1, 1, 2, 5, 40))):
        kind = rng.choice(tuple(kinds))
        effect: dict[str, Any] = {"kind": kind}
        for name, param in kinds[kind].params.items():
            if param.default is not None and rng.random() < 0.5:
                continue
            family = FAMILIES.get(param.family)
            if param.choices:
                effect[name] = rng.choice(param.choices)
            elif rng.random() < 0.1 or family is None:
                effect[name] = _value(rng)
            elif family.name == "count":
                effect[name] = rng.choice((1, 2, 90, 0, -1))
            elif not family.si:
                effect[name] = rng.choice((0.1, 0.5, 1, 2, -0.3))
            else:
                effect[name] = family.example if rng.random() < 0.7 else f"{rng.gauss(0, 1):.4g} {family.si}"
        if isinstance(made, list):
            made.append(effect)


def _text(rng: random.Random, text: str) -> str:
    """Return a text with bytes flipped, cut, doubled or moved."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        lines = text.split("\n")
        at, kind = rng.randrange(len(lines)), rng.randrange(9)
        if kind < 3:
            text = _flipped(rng, text)
        elif kind == 3:
            text = text[: rng.randrange(len(text) + 1)] + "\n"
        elif kind == 4:
            text = "\n".join([*lines[:at], lines[at], *lines[at:]])
        elif kind == 5:
            text = "\n".join([*lines[:at], *lines[at + 1 :]]) + "\n"
        elif kind == 6:
            rng.shuffle(lines)
            text = "\n".join(lines)
        elif kind == 7:
            lines[at] = rng.choice(
                ("[", "[[effect]]", "[gears]", "a" * 70000, "x = " + "[" * 200, "=", "\x00", "'''", '"""', "{")
            )
            text = "\n".join(lines) + "\n"
        else:
            line = lines[at]
            key, equals, _ = line.partition("=")
            new = rng.choice(
                (*ODD, *NUMBERS, f'"{_quantity(rng)}"', "9" * 5000, "1979-05-27", "[[[[", "{a.b=1,a=2}", '"\\u0000"')
            )
            lines[at] = f"{key}{equals}{new}"
            text = "\n".join(lines) + "\n"
    return text if "\n" in text else text + "\n"


def _chain(rng: random.Random, bases: list[str], folder: Path, case: int) -> Path:
    """Return a file that extends others: a chain, a circle, or what is no file."""
    here = folder / f"case{case % 50}"
    here.mkdir(exist_ok=True)
    files = [here / f"f{at}.toml" for at in range(rng.choice((1, 2, 3, 5, 40)))]
    circle = rng.random() < 0.2
    for at, file in enumerate(files):
        last = at == len(files) - 1
        head = f'extends = "{files[0 if last else at + 1].name}"\n' if circle or not last else ""
        if rng.random() < 0.05:
            target = rng.choice(
                ("/dev/zero", ".", "..", "\\u0000", "a" * 300, "missing.toml", "/", "base/rigaud-2020", "")
            )
            head = f'extends = "{target}"\n'
        body = (
            rng.choice(bases)
            if last
            else rng.choice(("[run]\nseed = 3\n", '[motion]\nmean = "40 rpm"\n', "", "[effect]\n"))
        )
        text = head + body
        if rng.random() < 0.1:
            text = _text(rng, text)
        file.write_bytes(text.encode("utf-8", "surrogatepass"))
    return files[0]


def _override(rng: random.Random, document: dict[str, Any]) -> str:
    """Return a text for --set."""
    way, value = rng.choice(list(_leaves(document)))
    key = ""
    for step in way:
        key += f"[{step}]" if isinstance(step, int) else f".{step}"
    key = rng.choice((key.lstrip("."),) * 6 + (_flipped(rng, key), key + "[+]", key + "[-1]", key + ".x", _key(rng)))
    new = _near(rng, value) if rng.random() < 0.7 else _value(rng)
    text = new if isinstance(new, str) else repr(new).replace("True", "true").replace("'", '"')
    literal(text)
    return f"{key}={text}"


if __name__ == "__main__":
    isolated.repeat("scenarios", int(sys.argv[1]), int(sys.argv[2]))

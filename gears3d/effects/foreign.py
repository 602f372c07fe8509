"""Effects of other packages: whether a class is one, and what its own code raises, as faults that name the package."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from importlib.metadata import packages_distributions
from math import isfinite
from pathlib import Path
from traceback import extract_tb
from typing import Any

from gears3d.effects.rows import WIDTH, Row
from gears3d.errors import Fault, GearsError, InputError, did_you_mean

_OWN_CODE = ("__init__", "rows", "unit_size", "observe")
_PLAIN = ("count", "choice")  # families of parameters that have no unit


def check(effect: type, places: tuple[str, ...], param: type) -> None:
    """Raise a TypeError that states what is missing for a class to be an effect.

    Args:
        effect: class of another package.
        places: where an effect can act.
        param: the class of parameters.
    """
    name = f"{effect.__module__}.{effect.__qualname__}"
    lacking = [part for part in ("kind", "place", "params", "rows", "unit_size") if not hasattr(effect, part)]
    if lacking or not is_dataclass(effect):
        raise TypeError(f"{name} is not an effect: it has no {', '.join(lacking) or 'dataclass decorator'}")
    kind, place, params = effect.kind, effect.place, effect.params  # type: ignore[attr-defined]
    if not isinstance(kind, str) or place not in places:
        raise TypeError(f"{name} is not an effect: kind {kind!r}, place {place!r}")
    if place == "sensor" and not hasattr(effect, "observe"):
        raise TypeError(f"{name} is not an effect: place 'sensor', and it has no observe")
    if not isinstance(params, dict) or not all(isinstance(one, param) for one in params.values()):
        raise TypeError(f"{name} is not an effect: params are not Param by name")
    for key, one in params.items():
        _check_param(f"{name}: parameter {key!r}", one)
    _check_fields(name, effect, params)


def _check_param(named: str, param: Any) -> None:
    from gears3d.units import FAMILIES

    for family in (param.family, *param.also):
        if family not in FAMILIES and family not in _PLAIN:
            near = did_you_mean(str(family), [*FAMILIES, *_PLAIN])
            near = f"{near} " if near.startswith("did you mean") else ""
            raise TypeError(f"{named} has the unknown unit family {family!r}: {near}known families: gears3d list units")
    if param.family == "choice" and not param.choices:
        raise TypeError(f"{named} is a choice without choices")


def _check_fields(name: str, effect: Any, params: dict[str, Any]) -> None:
    given = {one.name: one for one in fields(effect) if one.init}
    filled = {*params, *(f"{key}_family" for key, one in params.items() if one.also)}
    for key in sorted(filled - {*given}):
        raise TypeError(
            f"{name}: parameter {key!r} of params is not a field of the class; {did_you_mean(key, [*given])}"
        )
    for key, one in given.items():
        if key not in filled and one.default is MISSING and one.default_factory is MISSING:
            raise TypeError(f"{name}: field {key!r} has no default and is not in params")


def guard(effect: type) -> None:
    """Make what the class's own code raises an :class:`InputError` that names package, class and line.

    Args:
        effect: class of another package; its methods are replaced, once.
    """
    for name in _OWN_CODE:
        method = getattr(effect, name, None)
        if callable(method) and not hasattr(method, "_guarded"):
            setattr(effect, name, _guarded(method, name))


def _guarded(method: Callable[..., Any], name: str) -> Callable[..., Any]:
    allowed = (GearsError, ValueError) if name == "__init__" else (GearsError,)  # a ValueError says what does not fit

    @wraps(method)
    def call(self: Any, *args: Any, **more: Any) -> Any:
        try:
            made = method(self, *args, **more)
            return made if name != "rows" else _rows(made)
        except allowed:
            raise
        except Exception as error:  # code of third parties may raise any exception
            raise InputError(_fault(type(self), name, error)) from error

    call._guarded = True  # type: ignore[attr-defined]
    return call


def _rows(made: Any) -> list[Row]:
    """Return the rows, if they are rows."""
    if not isinstance(made, list | tuple) or isinstance(made, Row) or not all(isinstance(one, Row) for one in made):
        raise TypeError(f"returns {made!r:.80}, not a list of rows; gears3d.effects has the functions that make them")
    for row in made:
        if len(row.p) > WIDTH or not all(isfinite(value) for value in row.p):
            raise ValueError(f"a row has numbers that are not finite, or more than {WIDTH}: {row.p}")
    return [*made]


def _fault(effect: Any, name: str, error: Exception) -> Fault:
    why = " ".join(str(error).split()) or "no reason given"
    source = getattr(sys.modules.get(effect.__module__), "__file__", None) or ""
    place = next((one for one in reversed(extract_tb(error.__traceback__)) if one.filename == source), None)
    if isinstance(error, AttributeError) and isinstance(error.obj, effect):
        why += f"; {did_you_mean(str(error.name), [*effect.params])}"
    line = f"line {place.lineno} of {Path(source).name}: " if place is not None else ""
    method = "the class" if name == "__init__" else f"{name}()"
    return Fault(
        "",
        f"effect {effect.kind!r} of the package {_package(effect)}: {method} of {effect.__qualname__} fails: "
        f"{line}{type(error).__name__}: {why}",
        f"correct {source or effect.__module__}, or remove the effect",
    )


def _package(effect: type) -> str:
    top = effect.__module__.partition(".")[0]
    return next(iter(packages_distributions().get(top, ())), top)

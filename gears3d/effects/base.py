"""What an effect is, and the registry that finds it by its kind.

An effect is one physical cause with named parameters that acts in one *place*. Adding one is adding one file: a
frozen dataclass with ``kind``, ``place``, ``params``, ``rows`` and ``unit_size``, decorated with :func:`register`.
Files in ``gears3d/effects/`` are found by themselves; those of other packages through the entry-point group
``gears3d.effects``, which names the class or its module, or simply by importing them.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from math import radians
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar, get_args, runtime_checkable

from gears3d.effects.foreign import check, guard
from gears3d.effects.rows import Row
from gears3d.plugins import plug_in

if TYPE_CHECKING:
    import numpy as np

Place = Literal["geometry", "torque", "impact", "gap_force", "motion", "sensor"]


class Refined(NamedTuple):
    """How a diagnosis refines a shape parameter once the cause is accepted: within bounds, most by its logarithm.

    Args:
        low: lower bound.
        high: upper bound.
        log: whether by its logarithm.
        unit: change over which the response is about linear; by default the parameter itself.
    """

    low: float
    high: float
    log: bool = True
    unit: float | None = None


class Param(NamedTuple):
    """A named parameter of an effect.

    Args:
        family: its unit family as ``gears3d.units`` knows it (``"length"``, ``"torque"`` ...), ``"count"`` for an
            integer or ``"choice"`` for one of ``choices``.
        low: smallest admissible value, SI.
        high: largest admissible value, SI.
        default: value when the scenario does not give it; ``None`` means that it must be given.
        choices: the words allowed when ``family`` is ``"choice"``.
        linear: whether the observables change in proportion to it; a diagnosis takes more rounds to fit others.
        also: further unit families that are allowed; the effect then has a further field ``<parameter>_family``,
            which takes the family that was written.
        of: gear whose angle it counts from, ``"drive"``, ``"loose"``, or ``"gear"`` for that of the parameter ``gear``.
        tried: values at which a diagnosis tries it: speeds in mean speeds of the loose gear, times in durations of a
            record. Without them it tries all choices, orders and teeth.
        refined: bounds within which a diagnosis refines it; ``None`` for a parameter that stays as it was tried.
    """

    family: str
    low: float = float("-inf")
    high: float = float("inf")
    default: Any = None
    choices: tuple[str, ...] = ()
    linear: bool = True
    also: tuple[str, ...] = ()
    of: Literal["", "drive", "loose", "gear"] = ""
    tried: tuple[Any, ...] = ()
    refined: Refined | None = None


@dataclass(frozen=True)
class Rig:
    """The base model's constants that an effect may need for its size, all SI.

    Args:
        base_radius_drive: m.
        base_radius_loose: m.
        inertia: of the loose gear, kg·m².
        drag_torque: base Coulomb torque, N·m.
        backlash: width of the dead band along the transverse line of action, m.
        restitution: base coefficient.
        mean_speed: of the drive gear, rad/s.
        teeth_drive: number of teeth.
        teeth_loose: number of teeth.
        working_pressure_angle: transverse, rad.
        base_helix_angle: rad.
        face_width: common to both gears, m.
        contact_ratio: transverse.
    """

    base_radius_drive: float
    base_radius_loose: float
    inertia: float
    drag_torque: float
    backlash: float
    restitution: float
    mean_speed: float
    teeth_drive: int
    teeth_loose: int
    working_pressure_angle: float = radians(20)
    base_helix_angle: float = 0.0
    face_width: float = 0.0
    contact_ratio: float = 1.0

    @property
    def mean_speed_loose(self) -> float:
        """Size of the loose gear's mean speed [rad/s]."""
        return abs(self.mean_speed) * self.base_radius_drive / self.base_radius_loose


@runtime_checkable
class Effect(Protocol):
    """One physical cause, as data and a law in normal form."""

    kind: ClassVar[str]
    place: ClassVar[Place]
    params: ClassVar[dict[str, Param]]

    def rows(self, rig: Rig) -> list[Row]:
        """Lower the effect to normal forms.

        Raises:
            InputError: it does not fit the rig; the fault's key names the parameter.
        """
        ...

    def unit_size(self, rig: Rig) -> float:
        """Return the size of the leading parameter that changes its channel by 100 %."""
        ...


@runtime_checkable
class SensorEffect(Effect, Protocol):
    """An effect of the measurement: it changes the recording, not the motion."""

    def observe(self, gear_angles: dict[str, np.ndarray], time: np.ndarray) -> dict[str, np.ndarray]:
        """Return the angles ``{"drive": (n,), "loose": (n,)}`` [rad] as the sensors read them at ``time`` [s], (n,)."""
        ...


E_ = TypeVar("E_", bound=type)
_REGISTRY: dict[str, type] = {}
_EXCLUDED: dict[str, str] = {}
_LOADED: set[str] = set()  # those of ``"built-in"`` and ``"plug-ins"`` that are registered
_HERE = "gears3d.effects"


def register(effect: E_) -> E_:
    """Make an effect known by its ``kind`` (class decorator).

    Raises:
        ValueError: the kind is taken by a class of another module.
        TypeError: a class of another package is not an effect; says what it lacks.
    """
    if not effect.__module__.startswith(f"{_HERE}."):
        _load_built_in()  # kinds of gears3d are registered first, so that no other package takes them
    known = _REGISTRY.get(effect.kind)  # type: ignore[attr-defined]
    if known is not None and known.__module__ != effect.__module__:
        raise ValueError(f"effect kind {known.kind!r} is taken by {known.__module__}")
    if not effect.__module__.startswith(f"{_HERE}."):
        check(effect, get_args(Place), Param)
        guard(effect)
    _REGISTRY[effect.kind] = effect  # type: ignore[attr-defined]
    return effect


def built_in() -> dict[str, Any]:
    """Return the effect classes of gears3d by kind, sorted."""
    _load_built_in()
    return {kind: one for kind, one in sorted(_REGISTRY.items()) if one.__module__.startswith(f"{_HERE}.")}


def catalogue() -> dict[str, type]:
    """Return every known effect class by kind, sorted.

    >>> "transmission_error" in catalogue()
    True
    """
    _load_built_in()
    if "plug-ins" not in _LOADED:
        _LOADED.add("plug-ins")
        _EXCLUDED.update(plug_in(_HERE, _load_plug_in))
    return dict(sorted(_REGISTRY.items()))


def excluded() -> dict[str, str]:
    """Return why plug-ins of effects are excluded, by the names of their entry points."""
    catalogue()
    return dict(_EXCLUDED)


def _load_built_in() -> None:
    if "built-in" not in _LOADED:
        _LOADED.add("built-in")
        for module in pkgutil.iter_modules(importlib.import_module(_HERE).__path__):
            importlib.import_module(f"{_HERE}.{module.name}")


def _load_plug_in(load: Callable[[], Any], package: str) -> None:
    """Register the effects of another package, all or none; a TypeError or ValueError states what is invalid."""
    before = dict(_REGISTRY)
    try:
        found = load()
        if isinstance(found, type):
            check(found, get_args(Place), Param)  # before its kind is read
            register(found)
            return
        if not isinstance(found, ModuleType):
            raise TypeError(f"{found!r:.80} is not a class of an effect or a module that registers some")
        if not any(f"{one.__module__}.".startswith(f"{found.__name__}.") for one in _REGISTRY.values()):
            raise TypeError(f"the module {found.__name__} registers no effect")
    except BaseException:
        _REGISTRY.clear()
        _REGISTRY.update(before)
        raise

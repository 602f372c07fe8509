"""What an effect is, and the registry that finds it by its kind.

An effect is one physical cause with named parameters that acts in one *place*. Adding one is adding one file: a
frozen dataclass with ``kind``, ``place``, ``params``, ``rows`` and ``unit_size``, decorated with :func:`register`.
Files in ``gears3d/effects/`` are found by themselves; those of other packages through the entry-point group
``gears3d.effects`` or simply by importing them.
"""

from __future__ import annotations

import importlib
import pkgutil
from dataclasses import dataclass
from importlib.metadata import entry_points
from math import radians
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, Protocol, TypeVar, runtime_checkable

from gears3d.effects.rows import Row

if TYPE_CHECKING:
    import numpy as np

Place = Literal["geometry", "torque", "impact", "gap_force", "motion", "sensor"]


class Param(NamedTuple):
    """A named parameter of an effect.

    Args:
        family: its unit family as ``gears3d.units`` knows it (``"length"``, ``"torque"`` ...), ``"count"`` for an
            integer or ``"choice"`` for one of ``choices``.
        low: smallest admissible value, SI.
        high: largest admissible value, SI.
        default: value when the scenario does not give it; ``None`` means that it must be given.
        choices: the words allowed when ``family`` is ``"choice"``.
        linear: whether the observables change in proportion to it (what diagnosis asks).
        also: further unit families that are allowed; the effect then has a field ``<parameter>_family`` beside the
            parameter, which takes the family that was written.
    """

    family: str
    low: float = float("-inf")
    high: float = float("inf")
    default: Any = None
    choices: tuple[str, ...] = ()
    linear: bool = True
    also: tuple[str, ...] = ()


@dataclass(frozen=True)
class Rig:
    """The base model's constants that an effect may need to size itself, all SI.

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
    """An effect of the measurement: it changes what is recorded, not what happens."""

    def observe(self, gear_angles: dict[str, np.ndarray], time: np.ndarray) -> dict[str, np.ndarray]:
        """Return the angles ``{"drive": (n,), "loose": (n,)}`` in rad as the sensors see them at ``time`` (n,) in s."""
        ...


E_ = TypeVar("E_", bound=type)
_REGISTRY: dict[str, type] = {}
_ALL_LOADED = False


def register(effect: E_) -> E_:
    """Make an effect known by its ``kind`` (class decorator).

    Raises:
        ValueError: the kind is taken by a class of another module.
    """
    known = _REGISTRY.get(effect.kind)  # type: ignore[attr-defined]
    if known is not None and known.__module__ != effect.__module__:
        raise ValueError(f"effect kind {known.kind!r} is taken by {known.__module__}")
    _REGISTRY[effect.kind] = effect  # type: ignore[attr-defined]
    return effect


def catalogue() -> dict[str, type]:
    """Return every known effect class by kind, sorted.

    >>> "transmission_error" in catalogue()
    True
    """
    global _ALL_LOADED
    if not _ALL_LOADED:
        package = importlib.import_module("gears3d.effects")
        for module in pkgutil.iter_modules(package.__path__):
            importlib.import_module(f"gears3d.effects.{module.name}")
        for point in entry_points(group="gears3d.effects"):
            point.load()
        _ALL_LOADED = True
    return dict(sorted(_REGISTRY.items()))

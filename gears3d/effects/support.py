"""Which normal forms each model evaluates: the one table for models, messages and documentation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from gears3d.effects.rows import Code, Gate, Row
from gears3d.errors import Fault

if TYPE_CHECKING:
    from gears3d.effects.base import Effect, Rig

NATIVE = "bullet, native contact"
_ANY = frozenset(Gate)
_ALWAYS = frozenset({Gate.ALWAYS})
_ALL: dict[Code, frozenset[Gate]] = dict.fromkeys(Code, _ANY)
# Normal forms that each model evaluates, each with the gates that it observes. Effects of sensors have no rows: they
# act on the recording of any model.
TAKEN: Mapping[str, Mapping[Code, frozenset[Gate]]] = {
    "bullet": _ALL,
    NATIVE: {
        code: _ALWAYS  # Bullet's own contact is inside its solver and not accessible within a step
        for code in Code
        if code not in (Code.TORQUE_FRICTION, Code.TORQUE_CARRIED, Code.IMPACT_SCATTER, Code.GAP_SPRING, Code.GAP_FILM)
    },
    "rigid": _ALL,
    "plastic": {Code.TORQUE_CONSTANT: _ALWAYS},
    "lubricated": {code: _ANY for code in Code if not 300 < code < 400},  # its teeth are compliant: no restitution
}


def takes(model: str, row: Row) -> bool:
    """Return whether a model, a key of :data:`TAKEN`, evaluates a row.

    >>> from gears3d.effects.rows import torque_constant
    >>> takes("plastic", torque_constant(0.1)), takes("plastic", torque_constant(0.1, Gate.CONTACT))
    (True, False)
    """
    return row.gate in TAKEN[model].get(row.code, ())


def models_of(effect: Effect, rig: Rig) -> tuple[str, ...]:
    """Return the models in which an effect acts.

    >>> from math import pi
    >>> from gears3d.effects import Rig, catalogue
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.3, pi, 90, 90)
    >>> models_of(catalogue()["tooth_compliance"](stiffness=1e7), rig)
    ('bullet', 'rigid', 'lubricated')
    """
    rows = effect.rows(rig)
    return tuple(model for model in TAKEN if all(takes(model, row) for row in rows))


def refused(effects: Iterable[Effect], rig: Rig, model: str, file: str = "") -> list[Fault]:
    """Return a fault for every effect that does not act in a model, with the models in which it does.

    >>> from math import pi
    >>> from gears3d.effects import Rig, catalogue
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.3, pi, 90, 90)
    >>> refused([catalogue()["drag_viscous"](coefficient=1e-3)], rig, "plastic")[0].message
    "'drag_viscous' does not act in the plastic model"
    """
    faults = []
    for index, effect in enumerate(effects):
        models = models_of(effect, rig)
        if model in models:
            continue
        where = "Bullet's own contact" if model == NATIVE else f"the {model} model"
        ways = f"run it with --model {' or '.join(other for other in models if other != NATIVE)}"
        if model == NATIVE and "bullet" in models:
            ways = "use contact = located"
        faults.append(
            Fault(f"effect[{index}]", f"{effect.kind!r} does not act in {where}", f"leave it out, or {ways}", file)
        )
    return faults

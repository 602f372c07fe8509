"""What oil between the flanks takes the ground from."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gears3d.effects.rows import Code
from gears3d.errors import Fault, InputError

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


def refuse_oil(scenario: Scenario, asks: str) -> None:
    """Refuse oil between the flanks, for a test that has to touch them.

    Args:
        scenario: what is tested.
        asks: what the test asks for.

    Raises:
        InputError: there is oil.

    >>> from gears3d.scenario import load
    >>> refuse_oil(load("scenarios/rigaud-2020/fig5-20rpm.toml"), "contact of the flanks")
    """
    file = "" if scenario.path is None else str(scenario.path)
    for index, effect in enumerate(scenario.effects):
        if any(row.code == Code.GAP_FILM for row in effect.rows(scenario.rig())):
            text = f"{effect.kind!r} keeps the flanks apart; this test asks for {asks}"
            raise InputError(Fault(f"effect[{index}]", text, "leave the oil out for this test", file))

"""Tests of a rig: the one list that synthetic records, virtual tests and identification share."""

from __future__ import annotations

from typing import NamedTuple


class RigTest(NamedTuple):
    """A test that a rig is put through.

    Args:
        about: what happens, in a few words.
        synthesized: whether encoder records of it are synthesized.
        in_engine: whether it runs in the 3D engine.
        laws: that are identified from its records.
        old_name: it was called this before; empty if never.
    """

    about: str
    synthesized: bool
    in_engine: bool
    laws: tuple[str, ...]
    old_name: str = ""


# Every test by name.
TESTS = {
    "rattle": RigTest("the motion of the scenario", True, False, ("restitution",)),
    "coastdown": RigTest("coast-down of a gear out of mesh, or of both in mesh", True, True, ("coastdown",), "rundown"),
    "threshold": RigTest("speed-fluctuation amplitude up and down", True, True, ("threshold",)),
    "transmission-error": RigTest(
        "slow revolutions forward and back", True, True, ("transmission-error", "backlash"), "ste"
    ),
    "drop": RigTest("impacts on both flanks at given velocities", False, True, ("restitution",)),
}

# Tests of ``gears3d synthesize``.
SYNTHESIZED = tuple(name for name, test in TESTS.items() if test.synthesized)
# Tests of ``gears3d bench``.
IN_ENGINE = tuple(name for name, test in TESTS.items() if test.in_engine)
# Kinds of ``gears3d identify``.
LAWS = tuple(dict.fromkeys(law for test in TESTS.values() for law in test.laws))
# New names by the old ones.
RENAMED = {test.old_name: name for name, test in TESTS.items() if test.old_name}

"""The extended scenario as a file: the rig's own text, with a comment above each cause."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from gears3d.diagnosis.cause import significant_digits
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.diagnosis.diagnosis import Diagnosis
    from gears3d.diagnosis.verdict import Named

HEAD = "[[effect]]"


def extended_text(found: Diagnosis) -> str:
    """Return the extended scenario as text, with a comment above each cause.

    Args:
        found: the diagnosis; without causes the text is that of the rig.
    """
    text = found.extended.document
    lines = text.splitlines()
    heads = [k for k, line in enumerate(lines) if line.strip() == HEAD]
    if not found.causes or len(heads) < len(found.causes):
        return text
    for k, cause in reversed(list(zip(heads[-len(found.causes) :], found.causes, strict=True))):
        lines[k:k] = ["", *(f"# {line}" for line in about(cause))]
    told = "\n".join(lines) + "\n"
    return told if tomllib.loads(told) == tomllib.loads(text) else text


def about(cause: Named) -> list[str]:
    """Return the known facts on a cause, line by line."""
    told = [f"found by gears3d diagnose: {cause.kind}", *(f"95 %: {each}" for each in intervals(cause))]
    if cause.zero:
        told.append(
            f"phase and tooth number count from the first angle of {Path(cause.zero).name}, not from an index mark"
        )
    return told


def intervals(cause: Named) -> list[str]:
    """Return the 95 % intervals of a cause's numbers in the form of a scenario."""
    told = []
    for name, one in cause.parameters.items():
        family, digits = cause.effect.params[name].family, significant_digits(one)
        told.append(f"{name} {show(one.low, family, digits)} to {show(one.high, family, digits)}")
    return told

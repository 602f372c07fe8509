"""Once a turn in both flanks at once: whether a gear whose teeth stand off its axis explains it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gears3d.identify.order_lines import GEARS, Line
from gears3d.identify.rolling import Rolled

CLOSE = 0.02
"""Part of the amplitude that the closed form, which is one of first order, may leave over."""


@dataclass(frozen=True)
class Axis:
    """An offset axis that explains order 1 of both flanks.

    Args:
        gear: whose teeth are eccentric.
        offset: [m].
        phase: as the effect ``eccentricity`` has it [rad].
        rest: what it leaves over, as a part of the amplitude.
    """

    gear: str
    offset: float
    phase: float
    rest: float

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {"gear": self.gear, "offset_m": self.offset, "phase_rad": self.phase, "rest": self.rest}

    def comment(self) -> str:
        """Return the effect as comments in TOML."""
        what = f"in place of order 1 of the {self.gear} gear on both flanks (leaves {self.rest:.1%} over):"
        size = f'kind = "eccentricity", gear = "{self.gear}", offset = "{1e6 * self.offset:.5g} um"'
        return f'# {what}\n# {size}, phase = "{np.degrees(self.phase):.4g} deg"\n'


def eccentric_axes(rolled: Rolled) -> list[Axis]:
    """Return the gears whose eccentric teeth would explain order 1 of both flanks.

    To first order, an offset e at the phase p moves the active flank by e·sin(θ + p + αw) and the reverse one by
    e·sin(θ + p − αw), or of the loose gear by −e·sin(θ + p − αw) and −e·sin(θ + p + αw): alike in
    amplitude and 2·αw apart in phase, in a sense that tells whose teeth they are.

    Args:
        rolled: both flanks.

    Source: geometry, as the effect ``eccentricity``.
    """
    active, reverse = rolled.fits
    if active is None or reverse is None:
        return []
    found = []
    for gear in (0, 1):
        line = Line(gear, 1)
        either = rolled.lines.alike.get(line)
        at = next((one for one in (line, either) if one is not None and one in active.lines), None)
        at = at or next((one for one in active.lines if rolled.lines.alike.get(one) == line), None)
        if at is None or at.order != 1:
            continue
        place = active.lines.index(at)
        if max(active.chance[place], reverse.chance[place]) > rolled.level:
            continue
        one, other = complex(active.phasors[place]), complex(reverse.phasors[place])
        turn = np.exp(1j * rolled.contacts.pressure_angle) * -1j
        back = np.exp(-1j * rolled.contacts.pressure_angle) * -1j
        shape = np.array([turn, back]) if gear == 0 else -np.array([back, turn])
        pair = np.array([one, other])
        offset = np.vdot(shape, pair) / 2.0
        rest = float(np.linalg.norm(pair - offset * shape) / np.linalg.norm(pair))
        noise = float(np.hypot(active.deviation[place], reverse.deviation[place]) / np.linalg.norm(pair))
        if rest < max(CLOSE, 3.0 * noise):
            found.append(Axis(GEARS[gear], float(abs(offset)), float(np.angle(offset)), rest))
    return found

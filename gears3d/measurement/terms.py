"""What the place of a flank is made of: constant, slow drift, and orders of both gears."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measurement.smoothing import Blocks

LOW_ORDERS = (1, 2, 3)
"""Of either gear, once per revolution and its multiples, that flanks may have."""
MESH_ORDERS = (1, 2)
"""Multiples of the tooth number."""
PRIOR = {"offset": 1e3, "drift": 0.05, "low": 0.3, "mesh": 0.05}
"""Expected size of a term in gaps: what the record does not tell stays small."""


class Terms(NamedTuple):
    """What a flank's place is made of.

    Args:
        kinds: ``"offset"``, ``"drift"``, ``"drive"``, ``"loose"`` each with its degree or order, in columns.
        prior: expected size of each column in gaps, (p,).
        begin: of the record [s].
        span: of the record [s].
        grown: orders, the last ones, that the record itself asked for.
    """

    kinds: tuple[tuple[str, int], ...]
    prior: np.ndarray
    begin: float
    span: float
    grown: int = 0

    def with_orders(self, taken: list[tuple[str, int]], size: float) -> Terms:
        """Return the terms with further orders.

        Args:
            taken: gear and order of each.
            size: expected of them, in gaps.
        """
        prior = np.append(self.prior, np.full(2 * len(taken), size))
        return self._replace(kinds=(*self.kinds, *taken), prior=prior, grown=self.grown + len(taken))

    def columns(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return the columns at times and angles, (n, p).

        Args:
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        x = 2.0 * (time - self.begin) / self.span - 1.0
        made: list[np.ndarray] = []
        for kind, order in self.kinds:
            if kind == "offset":
                made.append(np.ones_like(time))
            elif kind == "drift":
                made.append(x if order == 1 else 1.5 * x * x - 0.5)
            else:
                angle = order * (drive if kind == "drive" else loose)
                made += [np.cos(angle), np.sin(angle)]
        return np.column_stack(made)


def make_terms(path: Blocks, teeth: tuple[int, int] | None) -> Terms:
    """Return the terms that a record can tell apart.

    Orders of both gears are one where the gears have turned almost alike; mesh orders need blocks short enough and a
    record of some meshes.

    Args:
        path: displacement in blocks.
        teeth: of drive and loose gear where known.
    """
    span = float(path.time[-1] - path.time[0])
    turns = [abs(float(angle[-1] - angle[0])) / (2 * np.pi) for angle in (path.drive, path.loose)]
    kinds, prior = [("offset", 0)], [PRIOR["offset"]]
    for degree in (1, 2):
        kinds.append(("drift", degree))
        prior.append(PRIOR["drift"])
    apart = abs(turns[0] - turns[1])
    for gear in ("drive", "loose") if apart > 0.5 else ("drive",):
        for order in LOW_ORDERS:
            kinds.append((gear, order))
            prior += 2 * [PRIOR["low"] / order]
    per_turn = len(path.time) / max(turns[0], 1e-9)
    for multiple in MESH_ORDERS if teeth else ():
        order = multiple * (teeth or (0, 0))[0]
        if order * turns[0] > 10.0 and per_turn > 8.0 * order:
            kinds.append(("drive", order))
            prior += 2 * [PRIOR["mesh"]]
    return Terms(tuple(kinds), np.array(prior), float(path.time[0]), span)

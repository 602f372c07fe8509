"""Terms of the position of a flank: constant, slow drift, and orders of both gears."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.segmentation.kernels import orders
from gears3d.measured.segmentation.smoothing import Blocks, Shape
from gears3d.signals.orders import GEARS

# Codes of the kinds of terms in the kernels, which do not handle shapes.
SORTS = {"offset": orders.OFFSET, "drift": orders.DRIFT, "drive": orders.DRIVE, "loose": orders.LOOSE,
         "shape": orders.OFFSET}  # fmt: skip
# Columns before those of shapes.
SHAPED = 3

# Of either gear, once per revolution and its multiples, that flanks may have.
LOW_ORDERS = (1, 2, 3)
# Multiples of the tooth number.
MESH_ORDERS = (1, 2)
# Expected size of a term in gaps: terms that the record does not determine stay small.
PRIOR = {"offset": 1e3, "drift": 0.05, "low": 0.3, "mesh": 0.05, "shape": 0.3, "known": 0.005}
# Standard deviation, in gaps, of order 1 (order n: the n-th part) and of mesh orders of gears of quality 6 to 9 in
# usual backlash: runout and transmission error after ISO 1328, backlash after DIN 3967.
USUAL = {"low": 0.05, "mesh": 0.005}


class Terms(NamedTuple):
    """Terms of a flank's position.

    Args:
        kinds: ``"offset"``, ``"drift"``, ``"shape"``, ``"drive"``, ``"loose"`` each with its number, degree or order,
            in columns.
        prior: expected size of each column in gaps, (p,).
        begin: of the record [s].
        span: of the record [s].
        grown: orders, the last ones, that the record itself asked for.
        shapes: that flanks may have besides orders.
        gap: expected size of each column of the dead band in gaps, (p,); half of ``prior`` without.
    """

    kinds: tuple[tuple[str, int], ...]
    prior: np.ndarray
    begin: float
    span: float
    grown: int = 0
    shapes: tuple[Shape, ...] = ()
    gap: np.ndarray | None = None

    @property
    def both(self) -> np.ndarray:
        """Expected sizes of the columns of the active flank and of the dead band in gaps, (2p,)."""
        return np.concatenate([self.prior, 0.5 * self.prior if self.gap is None else self.gap])

    def with_orders(self, taken: list[tuple[str, int]], size: float) -> Terms:
        """Return the terms with further orders.

        Args:
            taken: gear and order of each.
            size: expected of them, in gaps.
        """
        prior = np.append(self.prior, np.full(2 * len(taken), size))
        gap = None if self.gap is None else np.append(self.gap, np.full(2 * len(taken), 0.5 * size))
        return self._replace(kinds=(*self.kinds, *taken), prior=prior, gap=gap, grown=self.grown + len(taken))

    def without_mesh(self, size: float) -> Terms:
        """Return the terms with mesh orders that are expected to be as small as this part of what they were."""
        widths = [2 if kind in GEARS else 1 for kind, _ in self.kinds]
        mesh = np.repeat([kind in GEARS and order not in LOW_ORDERS for kind, order in self.kinds], widths)
        return self._replace(prior=np.where(mesh, size, 1.0) * self.prior)

    def columns(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return the columns at times and angles, (n, p).

        Args:
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(time), len(self.prior)))
        orders.columns(*self._coded(), *self._at(time, drive, loose), made)
        for number, shape in enumerate(self.shapes):
            made[:, SHAPED + number] = shape.over(drive, loose)
        return made

    def sums(self, numbers: np.ndarray, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return sums of the columns, without making these, (s, n).

        Args:
            numbers: of each sum, (s, p).
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(numbers), len(time)))
        known = numbers.copy()
        known[:, SHAPED : SHAPED + len(self.shapes)] = 0.0
        orders.sums(*self._coded(), *self._at(time, drive, loose), known, made)
        return made + self.shaped(numbers, drive, loose)

    @property
    def flank(self) -> np.ndarray:
        """Flank that each column belongs to, 0 active, 1 reverse, -1 both, (p,)."""
        owner = np.full(len(self.prior), -1)
        owner[SHAPED : SHAPED + len(self.shapes)] = [shape.flank for shape in self.shapes]
        return owner

    @property
    def fixed(self) -> np.ndarray:
        """Whether each column is the offset or a shape, which no order replaces, (p,)."""
        fixed = np.zeros(len(self.prior), bool)
        fixed[0] = True
        fixed[SHAPED : SHAPED + len(self.shapes)] = True
        return fixed

    @property
    def usual(self) -> np.ndarray:
        """Size of each column in usual gears in gaps, that of ``prior`` for what is no order, (p,)."""
        sizes = self.prior.copy()
        first = 0
        for place, (kind, order) in enumerate(self.kinds):
            wide = 2 if kind in GEARS else 1
            if wide == 2 and place < len(self.kinds) - self.grown:
                sizes[first : first + 2] = USUAL["low"] / order if order in LOW_ORDERS else USUAL["mesh"]
            first += wide
        return sizes

    @property
    def expected(self) -> np.ndarray:
        """Numbers that the columns are expected to have beforehand, each on its flank [m], (p,)."""
        numbers = np.zeros(len(self.prior))
        numbers[SHAPED : SHAPED + len(self.shapes)] = [shape.size for shape in self.shapes]
        return numbers

    def shaped(self, numbers: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return the contribution of the shapes alone to sums of the columns, (s, n).

        Args:
            numbers: of each sum, (s, p).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(numbers), len(drive)))
        for number, shape in enumerate(self.shapes):
            made += numbers[:, SHAPED + number, None] * shape.over(drive, loose)
        return made

    def _coded(self) -> tuple[np.ndarray, np.ndarray]:
        """Return sort and order of the terms as numbers."""
        return np.array([SORTS[kind] for kind, _ in self.kinds]), np.array([order for _, order in self.kinds])

    def _at(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return time from -1 to 1 over the record, and the angles, as the kernels take them."""
        x = 2.0 * (time - self.begin) / self.span - 1.0
        return x, np.ascontiguousarray(drive), np.ascontiguousarray(loose)


def make_terms(path: Blocks, teeth: tuple[int, int] | None) -> Terms:
    """Return the terms that a record can distinguish.

    Orders of both gears are one where the gears have turned by almost equal angles; mesh orders need blocks short
    enough and a record of some meshes.

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
    for number, shape in enumerate(path.shapes):
        kinds.append(("shape", number))
        prior.append(PRIOR["known" if shape.known else "shape"])
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
    return Terms(tuple(kinds), np.array(prior), float(path.time[0]), span, shapes=path.shapes)

"""Columns that are worked out when they are asked for: a long record has no room for all of them at once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

Table = Mapping[str, np.ndarray]


class Derived(Mapping[str, np.ndarray]):
    """A table of which some columns are there and the others follow from them.

    Args:
        stored: columns that are there, each (n,), ``time_s`` among them.
        made: by name what gives a column at some rows; it goes before one that is stored.
        order: names of all columns in order.

    >>> made = {"twice": lambda rows: 2.0 * np.arange(4.0)[rows]}
    >>> table = Derived({"time_s": np.arange(4.0)}, made, ["time_s", "twice"])
    >>> table["twice"].tolist(), table.part("twice", slice(None, None, 3)).tolist(), len(table)
    ([0.0, 2.0, 4.0, 6.0], [0.0, 6.0], 2)
    """

    def __init__(self, stored: Table, made: Mapping[str, Callable[[slice], np.ndarray]], order: list[str]) -> None:
        self._stored, self._made, self._order = dict(stored), dict(made), list(order)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.part(name, slice(None))

    def __iter__(self) -> Iterator[str]:
        return iter(self._order)

    def __contains__(self, name: object) -> bool:
        return name in self._order

    def __len__(self) -> int:
        return len(self._order)

    def part(self, name: str, rows: slice) -> np.ndarray:
        """Return a column at some rows, read-only.

        Args:
            name: of the column.
            rows: which.

        Raises:
            KeyError: there is no such column.
        """
        if name not in self._made:
            return self._stored[name][rows]
        values = self._made[name](rows)
        values.flags.writeable = False
        return values


def part_of(table: Table, name: str, rows: slice) -> np.ndarray:
    """Return a column of any table at some rows.

    Args:
        table: columns, each (n,).
        name: of the column.
        rows: which.
    """
    return table.part(name, rows) if isinstance(table, Derived) else table[name][rows]

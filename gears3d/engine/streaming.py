"""A run that is written to disk during the run: samples, impacts and contacts leave the memory a group at a time."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.engine.closing import Arc, ContactSystem
from gears3d.engine.log import HELICAL, Impact, Log
from gears3d.engine.run import Asked, check_contact, simulated
from gears3d.errors import InputError
from gears3d.recording import SIGNAL_UNITS
from gears3d.recording.streaming import TableStream

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario

ROWS = 1 << 16  # samples of a group
EVENTS = 1 << 10  # impacts, or contacts, of a group
CONTACTS: tuple[str, ...] = ("flank", "time_s", "end_s")


class Contacts(list[tuple[int, float, float]]):
    """Permanent contacts that are written in groups.

    Args:
        table: to write to.
    """

    def __init__(self, table: TableStream) -> None:
        super().__init__()
        self._table = table

    def append(self, contact: tuple[int, float, float]) -> None:
        """Add a contact."""
        super().append(contact)
        if len(self) >= EVENTS:
            self.flush()

    def flush(self) -> None:
        """Write the contacts that are held."""
        if len(self):
            columns = dict(zip(CONTACTS, np.array(self).T, strict=True))
            self.clear()
            self._table.write(columns)


class StreamedLog(Log):
    """Samples and impacts of one run, on disk.

    Args:
        folder: gets ``signals.parquet``, ``impacts.parquet`` and ``contacts.parquet``.
        span: duration of the run [s] and rate of the samples [Hz].
        motion: table of the drive gear's motion.
        base_radii: of drive and loose gear [m].
        helical: whether impacts have the columns of helical teeth.

    Raises:
        InputError: the folder cannot be written.
    """

    def __init__(
        self,
        folder: Path,
        span: tuple[float, float],
        motion: np.ndarray,
        base_radii: tuple[float, float],
        helical: bool,
    ) -> None:
        duration, self._rate = span
        self._total = math.floor(duration * self._rate * (1.0 + 1e-12)) + 1
        self._first, self._motion, self._radii = 0, motion, base_radii
        super().__init__(0.0, self._rate, self._times())
        names = tuple(name for name in Impact._fields if helical or name not in HELICAL)
        self._tables: list[TableStream] = []
        try:
            for name, columns in (("signals", tuple(SIGNAL_UNITS)), ("impacts", names), ("contacts", CONTACTS)):
                self._tables.append(TableStream(folder / f"{name}.parquet", columns))
        except InputError:
            self.abandon()
            raise
        self.contacts = Contacts(self._tables[2])

    def flight(self, arc: Arc, until: float) -> None:
        """Write the samples of a flight that starts at ``arc.time`` and ends at ``until`` [s]."""
        super().flight(arc, until)
        while self._turned_over():
            super().flight(arc, until)

    @property
    def goes_on(self) -> bool:  # type: ignore[override]
        """Whether further samples follow in another block."""
        return self._first + self.times.size < self._total

    def turn_over(self) -> None:
        """Write groups that are full, or have no space for the next step."""
        if len(self.impacts) >= EVENTS:
            self._flush_impacts()
        if self.goes_on:
            self._flush_signals()

    def finish(self, theta: float, omega: float, time: float) -> None:
        """Write the sample that falls on the end of the run, if one does."""
        self._turned_over()
        super().finish(theta, omega, time)

    def end(self, meta: dict[str, Any]) -> None:
        """Write the remaining rows and put the tables into their places.

        A full disk is an InputError, unless ``meta["stopped_by"]`` already states one.
        """
        fault: InputError | None = None
        for flush in (self._flush_signals, self._flush_impacts, self.contacts.flush):
            try:
                flush()
            except InputError as error:
                fault = error
        if "stopped_by" in meta:
            fault = None
        elif fault is not None:
            meta = {**meta, "interrupted": True, "stopped_by": str(fault)}
        try:
            for table in self._tables:
                table.end(meta)
        except InputError:
            self.abandon()
            raise
        if fault is not None:
            raise fault

    def abandon(self) -> None:
        """Remove the temporary tables."""
        for table in self._tables:
            table.abandon()

    def _times(self) -> np.ndarray:
        return np.arange(self._first, min(self._first + ROWS, self._total)) / self._rate

    def _turned_over(self) -> bool:
        """Write full groups; return whether the samples continue in a new one."""
        full = self.written >= self.times.size and self.goes_on
        if full or len(self.impacts) >= EVENTS:
            self.turn_over()
        return full

    def _flush_signals(self) -> None:
        columns = self.signals(self._motion, self._radii)
        self._first += self.written
        self.times, self.written = self._times(), 0
        if len(columns["time_s"]):
            self._tables[0].write(columns)

    def _flush_impacts(self) -> None:
        columns = self.impact_columns()
        if len(columns["time_s"]):
            self.impacts.clear()
            full = {name: columns.get(name, np.full(len(columns["time_s"]), np.nan)) for name in Impact._fields}
            self._tables[1].write(full)


def stream(
    scenario: Scenario,
    folder: Path,
    pair: Pair | None = None,
    contact: str = "located",
    progress: Callable[[float], None] | None = None,
    about: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """Run a scenario as :func:`gears3d.engine.simulate` does, and write it to disk during the run.

    Memory does not grow with the duration. A run that is interrupted, cannot continue or fills the disk leaves its
    tables up to that instant.

    Args:
        scenario: the scenario to be simulated.
        folder: gets ``signals.parquet``, ``impacts.parquet`` and ``contacts.parquet``, each when it is complete.
        pair: gears that take the place of the scenario's own.
        contact: ``"located"`` or ``"native"``.
        progress: called now and then with the simulated time done [s].
        about: further metadata of the tables.

    Returns:
        The metadata of the recording, without its contacts, which are a table here.

    Raises:
        UsageError, InputError, EngineError: as for :func:`gears3d.engine.simulate`; an InputError for a full disk. What
            is written is kept, with ``stopped_by`` in the tables' metadata.
    """
    check_contact(contact)
    span = (scenario.run.duration, scenario.run.output_rate)

    def begin(system: ContactSystem, radii: tuple[float, float]) -> tuple[Log, Contacts]:
        log = StreamedLog(folder, span, system.motion, radii, not system.surfaces.planar)
        return log, log.contacts

    made = simulated(Asked(scenario, pair, contact, progress), begin)
    log = made.log
    if not isinstance(log, StreamedLog):
        raise TypeError("the log of a streamed run is a streamed one")
    meta = {**(about or {}), **{key: value for key, value in made.meta.items() if key != "contacts"}}
    log.end(meta)
    if made.stopped is not None:
        raise made.stopped
    return meta

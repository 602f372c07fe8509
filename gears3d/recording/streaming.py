"""Tables of a recording that are written while it happens: memory stays flat, and a full disk spoils nothing."""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.files import temporary
from gears3d.recording.columns import FLANKS, INTEGERS, column_of, from_json, named_of, plain, to_json, unit_of
from gears3d.recording.files import IMPACTS, KEY, SIGNALS, read_parquet
from gears3d.recording.record import Recording

CONTACTS = "contacts.parquet"
THIN = 1024  # Samples of an excerpt
ROOM = 8 << 20  # Bytes that a table reserves on the disk, to be ended properly when the disk is full


def _opened(path: Path) -> Any:
    return path.open("wb", buffering=0)


class _Sink(io.RawIOBase):
    """A file that releases its reserved bytes when the disk is full, and reports it."""

    def __init__(self, path: Path) -> None:
        self.path, self.spare = path, path.with_name(f"{path.name}.room")
        self.full = False
        self._file = _opened(path)
        try:
            with self.spare.open("wb") as room:
                os.posix_fallocate(room.fileno(), 0, ROOM)
        except OSError:
            self.end()
            path.unlink(missing_ok=True)
            raise

    def writable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._file.tell()

    def write(self, data: Any) -> int:
        left = memoryview(data).cast("B")
        size = len(left)
        while len(left):
            try:
                left = left[self._file.write(left) :]
            except OSError as error:
                if error.errno not in (errno.ENOSPC, errno.EDQUOT) or self.full:
                    raise
                self.full = True
                self.spare.unlink(missing_ok=True)
        return size

    def end(self) -> None:
        self._file.close()
        with suppress(OSError):
            self.spare.unlink(missing_ok=True)


class TableStream:
    """One Parquet table, written a group of rows at a time under a temporary name."""

    def __init__(self, path: Path, names: tuple[str, ...]) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        self.path, self.rows = path, 0
        self._stack = ExitStack()
        fields = []
        for name in names:
            kind = pa.from_numpy_dtype(INTEGERS.get(name, np.float64))
            kind = pa.dictionary(kind, pa.string()) if name == "flank" else kind
            fields.append(pa.field(name, kind, nullable=False, metadata={"unit": unit_of(name)}))
        self._schema = pa.schema(fields)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._unfinished = self._stack.enter_context(temporary(path.parent)) / path.name
            self._sink = _Sink(self._unfinished)
        except OSError as error:
            self._stack.close()
            raise self._fault(error.strerror or str(error)) from error
        self._writer = pq.ParquetWriter(
            pa.PythonFile(self._sink, mode="w"),
            self._schema,
            compression="zstd",
            use_dictionary=["flank"] if "flank" in names else False,  # type: ignore[arg-type]
            use_byte_stream_split=[f.name for f in fields if pa.types.is_floating(f.type)],  # type: ignore[arg-type]
        )

    def write(self, columns: Mapping[str, np.ndarray]) -> None:
        """Write a group of rows."""
        import pyarrow as pa

        arrays = []
        for field in self._schema:
            values = np.asarray(columns[field.name], INTEGERS.get(field.name, np.float64))
            arrays.append(named_of(values, FLANKS) if field.name == "flank" else column_of(values))
        try:
            self._writer.write_table(pa.Table.from_arrays(arrays, schema=self._schema))
        except OSError as error:
            raise self._fault(error.strerror or str(error)) from error
        self.rows += len(arrays[0])
        if self._sink.full:
            raise self._fault("the disk is full")

    def end(self, meta: dict[str, Any]) -> Path:
        """Put the table into its place.

        Returns:
            The place.
        """
        try:
            self._writer.add_key_value_metadata({KEY: to_json(plain(meta)).encode()})
            self._writer.close()
            self._sink.end()
            self._unfinished.replace(self.path)
        except OSError as error:
            self.abandon()
            raise self._fault(error.strerror or str(error)) from error
        self._stack.close()
        return self.path

    def abandon(self) -> None:
        """Leave nothing behind."""
        with suppress(OSError, ValueError):
            self._writer.close()
        self._sink.end()
        self._stack.close()

    def _fault(self, why: str) -> InputError:
        return InputError(Fault("", f"cannot be written: {why}", "free space or name another place", str(self.path)))


def excerpt(folder: Path) -> Recording:
    """Return what describes a long recording without its signals: all impacts and contacts, and a few samples.

    Args:
        folder: of a recording that was streamed.

    Returns:
        Its impacts, its ``meta`` with the contacts, and angles of its first group of rows, thinned, and of its end.

    Raises:
        InputError: a table cannot be read.
    """
    import pyarrow.parquet as pq

    names = ["time_s", "theta_drive_rad", "theta_loose_rad"]
    with pq.ParquetFile(folder / SIGNALS) as file:
        meta = from_json((file.metadata.metadata or {}).get(KEY, b"{}"))
        groups = [file.read_row_group(k, names) for k in {0, file.num_row_groups - 1} if file.num_row_groups]
    signals = {name: np.zeros(0) for name in names}
    if groups:
        step = max(groups[0].num_rows // THIN, 1)
        parts = {name: [groups[0][name].to_numpy()[::step], groups[-1][name].to_numpy()[-1:]] for name in names}
        some = np.unique(np.concatenate(parts["time_s"]), return_index=True)[1]
        signals = {name: np.concatenate(values)[some] for name, values in parts.items()}
    contacts, _ = read_parquet(folder / CONTACTS)
    resting = zip(*(contacts[name].tolist() for name in ("flank", "time_s", "end_s")), strict=True)
    meta["contacts"] = [[FLANKS.index(flank), start, end] for flank, start, end in resting]
    return Recording(signals, read_parquet(folder / IMPACTS)[0], meta)

"""Measured files that are mutated: each is read, or refused with a reason; what is read comes back as it was."""

import contextlib
import random
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gears3d import recording
from gears3d.errors import GearsError
from gears3d.measured.checks import examine
from gears3d.measured.readers import Channels, propose, read
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.units import parse
from tests.fuzz import isolated
from tests.fuzz.files import LIES, MAP, NAMES, WRITERS, drawn, rattling
from tests.fuzz.tally import Tally

ROWS = 240
VARIANTS = 6
"""Files of each format that are mutated."""
FORBIDDEN = ("pickle.find_class", "os.system", "subprocess.Popen", "os.exec", "os.posix_spawn", "socket.connect")
"""What nothing that reads a file does."""


def run(seed: int) -> Iterator[Tally]:
    """Try mutated records without end; yield the tally after every batch."""
    return isolated.run("records", seed)


class _Watch:
    """Notes what is opened outside of a folder, and code that is run."""

    def __init__(self, folder: Path) -> None:
        self.on = False
        self.seen: list[str] = []
        own = Path(__file__).resolve().parents[2]
        self.allowed = tuple(
            map(
                str,
                (
                    folder,
                    own,
                    sys.prefix,
                    sys.base_prefix,
                    "/proc",
                    "/sys",
                    "/dev/null",
                    "/usr",
                    "/lib",
                    f"{tempfile.gettempdir()}/tmp",
                ),
            )
        )
        self.writable = (str(folder), f"{tempfile.gettempdir()}/tmp")
        sys.addaudithook(self)

    def __call__(self, event: str, args: tuple[Any, ...]) -> None:
        if not self.on:
            return
        if event in FORBIDDEN and not _of_kernels():
            self.seen.append(f"{event} {args!r:.80}")
        elif event == "open" and isinstance(args[0], str | bytes):
            path = args[0] if isinstance(args[0], str) else args[0].decode(errors="replace")
            writes = isinstance(args[2], int) and args[2] & 3
            if (
                (
                    path.startswith("/")
                    and path != tempfile.gettempdir()
                    and not path.startswith(self.writable if writes else self.allowed)
                )
                and "numba" not in path
                and "__pycache__" not in path
            ):
                self.seen.append(f"open {path}")


def _of_kernels() -> bool:
    """Return whether compiled kernels come out of their cache, as pickles."""
    frame = sys._getframe()
    while frame is not None and "numba" not in frame.f_code.co_filename:
        frame = frame.f_back
    return frame is not None


def prepare(folder: Path) -> Callable[[random.Random, int], tuple[str, str]]:
    """Return what tries one case."""
    own, secret = folder / "own", folder.parent / f"{folder.name}-secret.h5"
    own.mkdir(exist_ok=True)
    secret.write_bytes(np.full(64, 1.25).tobytes())
    watch = _Watch(folder)
    chart = own / "record.toml"
    chart.write_text(MAP)
    made = {}
    for kind, write in WRITERS.items():
        for variant in range(VARIANTS):
            write(own / "a", rattling(ROWS), random.Random(variant))
            made[kind, variant] = (own / "a").read_bytes()
    rig = load("rigaud-2020/fig5-20rpm")
    parse("1 furlong", "length")  # imports whatever pint imports

    def attempt(rng: random.Random, case: int) -> tuple[str, str]:
        how = rng.random()
        watch.seen.clear()
        for file in own.iterdir():
            if file.name != "record.toml":
                file.unlink()
        kind, variant = rng.choice(tuple(made))
        ending = rng.choice((kind, kind, "dat"))
        path = own / f"a.{ending}"
        if how < 0.12:
            kind = rng.choice(tuple(WRITERS))
            path = own / f"a.{kind if kind == 'mat' else rng.choice((kind, 'dat'))}"
            truth = drawn(rng, rng.choice((2, 3, 20, 60)))
            if not _written(kind, path, truth, rng):
                return "not written", ""
            watch.on = True
            told = _same_as(truth, path, kind, chart)
        elif how < 0.16:
            kind = rng.choice(tuple(LIES))
            path = own / f"a.{rng.choice((kind, 'dat'))}"
            LIES[kind](path, secret, rng)
            watch.on = True
            told = _judge(rng, path, kind, chart, rig, own, watch)
        else:
            data = _values(rng, kind, path) if how < 0.24 else _bytes(rng, made[kind, variant], made)
            path.write_bytes(data)
            watch.on = True
            told = _judge(rng, path, kind, chart, rig, own, watch)
        watch.on = False
        strange = {file.name for file in own.iterdir()} - {
            path.name,
            "record.toml",
            "out.parquet",
            "out.csv",
            "map.toml",
        }
        if watch.seen or strange:
            return "outside", "; ".join([*watch.seen[:3], *sorted(strange)])
        return told

    return attempt


def _columns(path: Path, kind: str, chart: Path) -> Channels:
    return read(path, chart if kind == "mf4" else None)


def _same_as(truth: dict[str, np.ndarray], path: Path, kind: str, chart: Path) -> tuple[str, str]:
    """Hold what is read of a sound file against what was written."""
    found = _columns(path, kind, chart).columns
    for name in NAMES:
        if name not in found:
            return "changed", f"{path.name}: {name} is not read; there is {list(found)}"
        bound = 1e-11 * np.abs(truth[name]) if kind == "text.unv" else 0.0
        if found[name].shape != truth[name].shape or not np.all(np.abs(found[name] - truth[name]) <= bound):
            return "changed", f"{path.name}: {name} is {found[name][:3]}, not {truth[name][:3]}"
    return "same", ""


def _judge(
    rng: random.Random, path: Path, kind: str, chart: Path, rig: Any, own: Path, watch: _Watch
) -> tuple[str, str]:
    """Read, examine and measure a file."""
    try:
        if rng.random() < 0.08:
            own_map = own / "map.toml"
            own_map.write_text(_chart(rng))
            channels = read(path, own_map)
        else:
            channels = _columns(path, kind, chart)
    except GearsError as error:
        return ("refused", "") if str(error).strip() else ("silent", "an error without a word")
    if rng.random() < 0.05:
        with contextlib.suppress(GearsError):
            propose(path, rig)
    watch.on = False  # kernels come out of their cache as pickles
    if rng.random() < 0.3:
        examine(channels, rig)
    if rng.random() < 0.01:
        _measured(path, kind, chart)
    return _kept(rng, channels, own)


def _kept(rng: random.Random, channels: Channels, own: Path) -> tuple[str, str]:
    """Write what was read, and read it again."""
    try:
        record = Recording(channels.columns, meta=channels.meta)
    except GearsError:
        return "read", ""
    if not len(record.time):
        return "read", ""
    place = own / rng.choice(("out.parquet", "out.csv"))
    record.write(place)
    again = recording.read(place)
    if place.suffix == ".parquet" and again != record:
        return "changed", f"{place.name}: {record!r} is read as {again!r}"
    found = read(place).columns
    for name, values in record.signals.items():
        if name not in found or not np.array_equal(found[name], values, equal_nan=True):
            return "changed", f"{place.name}: column {name!r} is {found.get(name)}, not {values}"
    return "kept", ""


def _measured(path: Path, kind: str, chart: Path) -> None:
    from gears3d.cli import main

    given = ["segment", str(path), "--rig", "rigaud-2020/fig5-20rpm", "--json"]
    try:
        code = main([*given, "--map", str(chart)] if kind == "mf4" else given)
    except SystemExit as done:
        code = done.code
    assert code in (0, 2, 3), f"measure ends with exit code {code}"


def _chart(rng: random.Random) -> str:
    """Return a map with units, counts and decoders of any kind."""
    units = (
        "s",
        "ms",
        "rad",
        "deg",
        "rpm",
        "rev",
        "counts",
        "1 m^9^9^9",
        "",
        "()",
        "m=1",
        "samples",
        "0 rad",
        "1e300 deg",
        "1e-300 ms",
    )
    lines = ["format = 1", "[time]", 'channel = "time_s"', f'unit = "{rng.choice(units)}"']
    if rng.random() < 0.3:
        lines.append(f'sample_rate = "{rng.choice(("50 kHz", "0 Hz", "1e300 Hz", "-1 Hz", "1e-300 Hz", "x"))}"')
    for gear in ("drive", "loose"):
        lines += [f"[{gear}]", f'channel = "theta_{gear}_rad"', f'unit = "{rng.choice(units)}"']
        for key, values in (
            ("counts_per_revolution", ("4096", "1e300", "1e-300", "-1", "nan", "inf", '"x"')),
            ("ratio", ('"1/2"', "0", '"1/0"', "1e300", '"9/9/9"')),
            ("wraps_at", ('"360 deg"', '"0 deg"', '"1e-300 rad"', '"-1 rad"')),
            ("sign", ("-1", "2")),
            (
                "decode",
                ('{ kind = "counter", bits = 12 }', '{ kind = "tacho", positions = 60 }', '{ kind = "stamps" }'),
            ),
        ):
            if rng.random() < 0.15:
                lines.append(f"{key} = {rng.choice(values)}")
    return "\n".join(lines) + "\n"


SIZES = (
    0,
    1,
    2,
    7,
    8,
    127,
    128,
    255,
    2**15,
    2**16 - 1,
    2**24,
    2**31 - 1,
    2**31,
    2**32 - 1,
    2**40,
    2**63 - 1,
    2**64 - 1,
)


def _bytes(rng: random.Random, data: bytes, made: dict[Any, bytes]) -> bytes:
    """Return a file with bytes flipped, cut, moved, or with other sizes in it."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 4, 16))):
        if not changed:
            break
        edge = min(600, len(changed))
        at = rng.choice((rng.randrange(len(changed)), rng.randrange(edge), len(changed) - 1 - rng.randrange(edge)))
        kind = rng.randrange(9)
        if kind < 3:
            changed[at] ^= 1 << rng.randrange(8)
        elif kind == 3:
            changed[at] = rng.randrange(256)
        elif kind == 4:
            width = rng.choice((1, 2, 4, 8))
            size = rng.choice(SIZES) % 256**width
            changed[at : at + width] = size.to_bytes(width, rng.choice(("little", "big")))
        elif kind == 5:
            del changed[rng.choice((at, max(len(changed) - rng.randrange(1, 40), 0))) :]
        elif kind == 6:
            width = rng.choice((1, 8, 64, 512))
            changed[at:at] = changed[max(at - width, 0) : at] if rng.random() < 0.5 else bytes(width)
        elif kind == 7:
            del changed[at : at + rng.choice((1, 8, 64, 512))]
        else:
            other = made[rng.choice(tuple(made))]
            start = rng.randrange(len(other))
            width = rng.choice((8, 64, 512))
            changed[at : at + width] = other[start : start + width]
    return bytes(changed)


def _values(rng: random.Random, kind: str, path: Path) -> bytes:
    """Return a sound file of values that are none: holes, constants, repeated or falling times, no rows."""
    columns = rattling(rng.choice((1, 2, 5, ROWS)))
    for _ in range(rng.choice((1, 2))):
        name = rng.choice(NAMES)
        values = columns[name]
        rows = slice(rng.randrange(len(values)), None, rng.choice((1, 3, 50)))
        change = rng.randrange(9)
        if change < 4:
            values[rows] = rng.choice((np.nan, np.inf, -np.inf, 0.0, 1e300, -1e300, 5e-324, values[0]))
        elif change == 4:
            values[:] = values[::-1].copy()
        elif change == 5:
            np.random.default_rng(rng.getrandbits(32)).shuffle(values)
        elif change == 6:
            values *= rng.choice((1e3, 1e6, 1e-3, 57.29578, 1e300, -1.0, 0.0))
        elif change == 7:
            values[:] = np.round(values, rng.choice((0, 1, 2, 3)))
        else:
            values[:] = np.mod(values, rng.choice((0.1, 6.283185307179586, 360.0)))
    return path.read_bytes() if _written(kind, path, columns, rng) else b"0"


def _written(kind: str, path: Path, columns: dict[str, np.ndarray], rng: random.Random) -> bool:
    """Write a sound file; return whether the library of the format could."""
    try:
        WRITERS[kind](path, columns, rng)
    except Exception as error:
        if kind.endswith("unv"):
            return False
        raise AssertionError(f"{kind} is not written") from error
    return True


if __name__ == "__main__":
    isolated.repeat("records", int(sys.argv[1]), int(sys.argv[2]))

"""Run folders: written complete or not at all, and read again."""

from __future__ import annotations

import json
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import Fault, InputError
from gears3d.files import exchange, refuse_folder, temporary
from gears3d.inputs import read_text

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario


MARK = "summary.json"  # The file by which a run folder is known as one
MOST = 1 << 26  # Bytes of a summary


def default_folder(scenario: Scenario) -> Path:
    """Return ``runs/<name of the scenario's file>``.

    Args:
        scenario: the scenario that is run.
    """
    return Path("runs") / (Path(scenario.path).stem if scenario.path else "scenario")


class RunFolder:
    """A run folder while it is being written; use it as a context.

    Leaving the context without :meth:`commit` removes what was written, and an earlier run in the same place stays.

    Args:
        place: where the folder will be.

    Raises:
        InputError: the place is a file, a folder of something else, or cannot be written.
    """

    def __init__(self, place: Path) -> None:
        self.named = place
        self._stack = ExitStack()

    def __enter__(self) -> RunFolder:
        refuse_foreign(self.named)
        self.place = self.named.resolve()
        try:
            self.place.parent.mkdir(parents=True, exist_ok=True)
            self._hidden = self._stack.enter_context(temporary(self.place.parent))
            refuse_foreign(self.named)  # an earlier run may be back
            self.path = self._hidden / self.place.name
            self.path.mkdir()
        except OSError as error:
            self._stack.close()
            remedy = "name a folder that you may write with --out"
            raise InputError(Fault("--out", f"{self.named} cannot be written: {error.strerror}", remedy)) from error
        except InputError:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def write_scenario(self, scenario: Scenario, header: str) -> None:
        """Write ``scenario.toml``: the resolved scenario under a comment.

        Args:
            scenario: what was run.
            header: lines for the comment (versions, seed, command).
        """
        comment = "".join(f"# {line}\n" for line in header.splitlines())
        (self.path / "scenario.toml").write_text(comment + scenario.document, encoding="utf-8")

    def write_recording(self, recording: Recording, name: str = "") -> None:
        """Write ``signals.parquet`` and ``impacts.parquet``.

        Args:
            recording: what was recorded.
            name: subfolder, ``"twin"`` for the twin's.
        """
        recording.write(self.path / name)

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Write ``summary.json``.

        Args:
            summary: what :func:`gears3d.runs.summarise` made.
        """
        text = json.dumps(summary, indent=1, allow_nan=False)
        (self.path / MARK).write_text(text + "\n", encoding="utf-8")

    def commit(self) -> Path:
        """Put the folder into its place, taking an earlier run away only then.

        Returns:
            The place.

        Raises:
            InputError: the earlier run cannot be taken away; it stays as it was.
        """
        try:
            exchange(self.path, self.place, self._hidden)
        except OSError as error:  # on Windows, while another program has a file of the earlier run open
            remedy = "close the programs that have its files open, or name another folder with --out"
            raise InputError(Fault("--out", f"{self.named} cannot be replaced: {error.strerror}", remedy)) from error
        return self.named


def refuse_foreign(place: Path) -> None:
    """Refuse a place that holds something else than a run."""
    remedy = "name another folder with --out"
    refuse_folder(place)
    whole = place.resolve()
    if whole == Path.cwd() or whole in Path.cwd().parents:
        what = f"{place} is the current folder or one above it, which cannot be replaced"
        raise InputError(Fault("--out", what, f"name a folder in it, e.g. --out {place / 'run'}"))
    if place.is_dir() and any(place.iterdir()) and not (place / MARK).exists():
        raise InputError(Fault("--out", f"{place} is not a run folder and is not empty; it stays as it is", remedy))


@dataclass(frozen=True)
class Run:
    """A run folder's content.

    Args:
        path: the folder.
        scenario: what was simulated.
        recording: of the run.
        twin: what the twin said, if it ran.
        summary: the content of ``summary.json``.
    """

    path: Path
    scenario: Scenario
    recording: Recording
    twin: Recording | None
    summary: dict[str, Any]


def read_run(path: str | Path) -> Run:
    """Read a run folder.

    Args:
        path: the folder that ``gears3d run`` wrote.

    Returns:
        Its content; ``twin`` is ``None`` without one.

    Raises:
        InputError: it is not a run folder, or a file in it cannot be read.
    """
    from gears3d.recording import read
    from gears3d.scenario import load

    folder = Path(path)
    if not (folder / MARK).is_file():
        what = "is not there"
        if folder.exists():
            what = "is not a run folder: it has no summary.json" if folder.is_dir() else "is a file, not a run folder"
        raise InputError(Fault("", what, "make one with `gears3d run SCENARIO --out DIR`", str(folder)))
    try:
        summary = json.loads(read_text(folder / MARK, MOST))
    except (ValueError, RecursionError) as error:
        raise InputError(Fault("", f"is not JSON: {error}", "run the scenario again", str(folder / MARK))) from error
    twin = read(folder / "twin") if (folder / "twin").is_dir() else None
    return Run(folder, load(folder / "scenario.toml"), read(folder), twin, summary)

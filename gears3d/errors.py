"""The errors that gears3d raises on purpose, each with the exit code of the command line contract."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, ClassVar


@dataclass(frozen=True)
class Fault:
    """One thing wrong with an input.

    Args:
        key: dotted path of the key, e.g. ``motion.harmonics[0].frequency``; empty for the whole file.
        message: what is wrong, with the value and its unit.
        remedy: what to do about it; empty when the message says it.
        file: the file with the fault; empty where no file is involved.
    """

    key: str
    message: str
    remedy: str = ""
    file: str = ""

    def __str__(self) -> str:
        place = ": ".join(part for part in (self.file, self.key) if part)
        text = f"{place}: {self.message}" if place else self.message
        return f"{text} ({self.remedy})" if self.remedy else text


class GearsError(Exception):
    """Base of all errors that gears3d raises on purpose; the text says what to do."""

    exit_code: ClassVar[int] = 3


class UsageError(GearsError):
    """The command line or an argument is invalid."""

    exit_code = 2


class InputError(GearsError):
    """An input (scenario, record, mesh, output folder) cannot be used; carries every fault found.

    Args:
        faults: the faults, in the order of the file; a plain text stands for one fault without a key.

    >>> str(InputError([Fault("run.duration", "is 0 s", "give a positive time", "a.toml")]))
    'a.toml: run.duration: is 0 s (give a positive time)'
    """

    exit_code = 3

    def __init__(self, faults: Sequence[Fault] | Fault | str) -> None:
        if isinstance(faults, str):
            faults = [Fault("", faults)]
        elif isinstance(faults, Fault):
            faults = [faults]
        self.faults: tuple[Fault, ...] = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


class MissingExtraError(InputError):
    """An optional library is needed that is not installed; the remedy is the line for pip.

    Args:
        fault: what needs which library.
        extra: of gears3d that installs it.
    """

    def __init__(self, fault: Fault, extra: str) -> None:
        super().__init__(fault)
        self.extra = extra


class EngineError(GearsError):
    """A simulation cannot continue or cannot be trusted (jammed gears, gap outside the hull budget, NaN).

    Args:
        message: what happened, when, and what to do.
        partial: the recording up to that instant, ``None`` without one; its ``meta`` has ``interrupted``,
            ``reached_s`` and ``stopped_by``.
    """

    exit_code = 4

    def __init__(self, message: str, partial: Any = None) -> None:
        super().__init__(message)
        self.partial = partial


def did_you_mean(word: str, known: Sequence[str]) -> str:
    """Return ``did you mean 'x'?`` for the nearest known word, or the list of known words.

    Args:
        word: what was given.
        known: what is allowed.

    Returns:
        One short clause for the ``remedy`` of a fault.

    >>> did_you_mean("modul", ["module", "teeth"])
    "did you mean 'module'?"
    """
    near = get_close_matches(word, known, n=1, cutoff=0.6)
    return f"did you mean {near[0]!r}?" if near else "known: " + ", ".join(sorted(known))

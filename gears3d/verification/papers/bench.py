"""The bench of the papers: runs shipped scenarios, each at most once."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from gears3d.scenario.document import shipped

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

T = TypeVar("T")
Overrides = Mapping[str, Any]


class Bench:
    """Runs scenarios and keeps what came out, so that claims and figures share their simulations.

    Args:
        progress: told what is being worked on, in words.

    Attributes:
        commands: for each paper and figure the commands that run its scenarios again.

    >>> bench = Bench()
    >>> bench.run("rigaud-2020/fig10.toml", {"run.duration": "1 s"}).impacts["flank"][0]
    np.int8(1)
    >>> bench.run("rigaud-2020/fig10.toml", {"run.duration": "1 s"}) is bench.run(
    ...     "rigaud-2020/fig10.toml", {"run.duration": "1 s"}
    ... )
    True
    """

    def __init__(self, progress: Callable[[str], None] | None = None) -> None:
        self._tell = progress or (lambda words: None)
        self._words = ""
        self._kept: dict[str, Any] = {}
        self._figure = ""
        self.commands: dict[str, list[str]] = {}

    @contextmanager
    def working_on(self, words: str, figure: str) -> Iterator[None]:
        """Tell what is worked on; commands asked for meanwhile belong to the figure.

        Args:
            words: for the progress line.
            figure: paper and name of the figure.
        """
        self._words = words
        self.breathe()
        before, self._figure = self._figure, figure
        try:
            yield
        finally:
            self._figure = before

    def breathe(self) -> None:
        """Tell again what is worked on: a moment at which work may be broken off."""
        self._tell(self._words)

    def scenario(self, name: str, overrides: Overrides | None = None) -> Scenario:
        """Return a shipped scenario, changed.

        Args:
            name: its file below ``scenarios/``.
            overrides: ``{"mount.backlash": "150 um"}``.
        """
        from gears3d.scenario import load

        key = f"scenario {name} {json.dumps(dict(overrides or {}))}"
        return self._keep(key, lambda: load(shipped() / name, dict(overrides or {})))

    def run(self, name: str, overrides: Overrides | None = None, model: str = "rigid") -> Recording:
        """Run a shipped scenario, changed, or return what came out of it before.

        Args:
            name: its file below ``scenarios/``.
            overrides: ``{"mount.backlash": "150 um"}``.
            model: of the simulation.

        Raises:
            InputError: the scenario is bad.
            EngineError: the simulation cannot go on.
        """
        from gears3d.simulation import simulate

        self.breathe()
        command = _command(name, overrides or {}, model)
        self._ask(command)
        return self._keep(command, lambda: simulate(self.scenario(name, overrides), model))

    def outcome(self, name: str, overrides: Overrides | None = None, model: str = "rigid") -> dict[str, Any]:
        """Return what a run came to: regime, speeds, energies, durations (:func:`gears3d.signals.describe`).

        Args:
            name: its file below ``scenarios/``.
            overrides: ``{"mount.backlash": "150 um"}``.
            model: of the simulation.
        """
        from gears3d.signals import describe

        run = self.run(name, overrides, model)
        key = f"outcome {_command(name, overrides or {}, model)}"
        return self._keep(key, lambda: describe(run.signals, run.impacts, run.meta))

    def once(self, key: str, compute: Callable[[], T]) -> T:
        """Compute something that several claims and figures need, once.

        Args:
            key: its name, of the paper and the quantity.
            compute: how.

        >>> bench = Bench()
        >>> bench.once("sum", lambda: 3), bench.once("sum", lambda: 4)
        (3, 3)
        """
        figure, self._figure = self._figure, f"once {key}"
        try:
            return self._keep(self._figure, compute)
        finally:
            self._figure, inner = figure, self.commands.get(self._figure, [])
            for command in inner:
                self._ask(command)

    def _ask(self, command: str) -> None:
        """Note that the figure in hand needs a command."""
        asked = self.commands.setdefault(self._figure, [])
        if command not in asked:
            asked.append(command)

    def _keep(self, key: str, compute: Callable[[], T]) -> T:
        if key not in self._kept:
            self._kept[key] = compute()
        return self._kept[key]


def _command(name: str, overrides: Overrides, model: str) -> str:
    """Return the command line that runs the same."""
    from shlex import quote

    parts = ["gears3d", "run", name.removesuffix(".toml"), "--model", model]
    for key, value in overrides.items():
        parts += ["--set", quote(f"{key}={_toml(value)}")]
    return " ".join(parts)


def _toml(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(each) for each in value) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)

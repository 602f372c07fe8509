"""The bench of the papers: runs shipped scenarios, each at most once."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeVar

from gears3d.scenario.document import shipped

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

T = TypeVar("T")
Overrides = Mapping[str, Any]


class Bench:
    """Runs scenarios and keeps the results, so that rows and figures share their simulations.

    Args:
        progress: receives a line of text that names the present row or figure.

    Attributes:
        commands: for each paper and figure the commands that run its scenarios again.

    >>> bench = Bench()
    >>> bench.run("rigaud-2020/fig10", {"run.duration": "1 s"}).impacts["flank"][0]
    np.int8(1)
    >>> bench.run("rigaud-2020/fig10", {"run.duration": "1 s"}) is bench.run(
    ...     "rigaud-2020/fig10", {"run.duration": "1 s"}
    ... )
    True
    """

    def __init__(self, progress: Callable[[str], None] | None = None) -> None:
        self._progress = progress or (lambda text: None)
        self._text = ""
        self._results: dict[str, Any] = {}
        self._figure = ""
        self.commands: dict[str, list[str]] = {}

    @contextmanager
    def working_on(self, text: str, figure: str) -> Iterator[None]:
        """Report a text as progress, and note the commands that are needed meanwhile for a figure.

        Args:
            text: of the progress line.
            figure: paper and name of the figure.
        """
        self._text = text
        self.breathe()
        before, self._figure = self._figure, figure
        try:
            yield
        finally:
            self._figure = before

    def breathe(self) -> None:
        """Report progress again: a moment at which the work may be interrupted."""
        self._progress(self._text)

    def case(self, name: str, overrides: Overrides | None = None, model: str = "rigid") -> Case:
        """Return a shipped scenario with changed values, and the model that runs it.

        Args:
            name: file below ``scenarios/``, without ``.toml``.
            overrides: changed values by key, ``{"mount.backlash": "150 um"}``.
            model: of the simulation.
        """
        return Case(self, name.removesuffix(".toml"), overrides or {}, model)

    def scenario(self, name: str, overrides: Overrides | None = None) -> Scenario:
        """Return a shipped scenario with changed values.

        Args:
            name: file below ``scenarios/``, without ``.toml``.
            overrides: changed values by key, ``{"mount.backlash": "150 um"}``.

        Raises:
            InputError: the scenario is invalid.
        """
        from gears3d.scenario import load

        case = self.case(name, overrides)
        key = f"scenario {case.name} {json.dumps(dict(case.overrides))}"
        return self._keep(key, lambda: load(shipped() / f"{case.name}.toml", dict(case.overrides)))

    def run(self, name: str, overrides: Overrides | None = None, model: str = "rigid") -> Recording:
        """Return the recording of a shipped scenario with changed values.

        Args:
            name: file below ``scenarios/``, without ``.toml``.
            overrides: changed values by key, ``{"mount.backlash": "150 um"}``.
            model: of the simulation.

        Raises:
            InputError: the scenario is invalid.
            EngineError: the simulation cannot continue.
        """
        from gears3d.simulation import simulate

        self.breathe()
        command = self.case(name, overrides, model).command
        self._note(command)
        return self._keep(command, lambda: simulate(self.scenario(name, overrides), model))

    def outcome(self, name: str, overrides: Overrides | None = None, model: str = "rigid") -> dict[str, Any]:
        """Return the summary of a run: regime, speeds, energies, durations (:func:`gears3d.signals.describe`).

        Args:
            name: file below ``scenarios/``, without ``.toml``.
            overrides: changed values by key, ``{"mount.backlash": "150 um"}``.
            model: of the simulation.
        """
        from gears3d.signals import describe

        run = self.run(name, overrides, model)
        key = f"outcome {self.case(name, overrides, model).command}"
        return self._keep(key, lambda: describe(run.signals, run.impacts, run.meta))

    def once(self, key: str, compute: Callable[[], T]) -> T:
        """Compute a quantity that several rows and figures need once; commands it needs count for all of them.

        Args:
            key: unique name of the quantity.
            compute: how it is computed.

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
                self._note(command)

    def _note(self, command: str) -> None:
        needed = self.commands.setdefault(self._figure, [])
        if command not in needed:
            needed.append(command)

    def _keep(self, key: str, compute: Callable[[], T]) -> T:
        if key not in self._results:
            self._results[key] = compute()
        return self._results[key]


@dataclass(frozen=True)
class Case:
    """A shipped scenario with changed values, the model that runs it, and the bench that keeps the result."""

    bench: Bench
    name: str
    overrides: Overrides = field(default_factory=dict)
    model: str = "rigid"

    def with_(self, overrides: Overrides) -> Case:
        """Return the case with further values changed."""
        return replace(self, overrides={**self.overrides, **overrides})

    @property
    def scenario(self) -> Scenario:
        """The scenario with the changed values."""
        return self.bench.scenario(self.name, self.overrides)

    @property
    def rig(self) -> Rig:
        """The rig of the scenario."""
        return self.scenario.rig()

    @property
    def run(self) -> Recording:
        """The recording."""
        return self.bench.run(self.name, self.overrides, self.model)

    @property
    def outcome(self) -> dict[str, Any]:
        """The summary of the run."""
        return self.bench.outcome(self.name, self.overrides, self.model)

    def once(self, label: str, compute: Callable[[], T]) -> T:
        """Compute a quantity of this case once; the label names it."""
        return self.bench.once(f"{label}: {self.command}", compute)

    @property
    def command(self) -> str:
        """The command line that runs the same."""
        from shlex import quote

        parts = ["gears3d", "run", self.name, "--model", self.model]
        for key, value in self.overrides.items():
            parts += ["--set", quote(f"{key}={_toml(value)}")]
        return " ".join(parts)


def _toml(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_toml(each) for each in value) + "]"
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(each)}" for key, each in value.items()) + " }"
    return json.dumps(value, ensure_ascii=False)

"""``gears3d run --stream``: a long run is written to disk while it is simulated."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from gears3d.errors import EngineError, GearsError, InputError, UsageError

if TYPE_CHECKING:
    from gears3d.runs import RunFolder
    from gears3d.scenario import Scenario


def refuse_with_stream(model: str, twin: str, error_estimate: bool) -> None:
    """Refuse options that need a whole recording in memory."""
    if model != "bullet":
        raise UsageError(f"model {model!r} is not streamed: --stream goes with the bullet model")
    if twin not in ("", "none"):
        raise UsageError(f"--twin {twin} needs the whole recording: omit it or --stream")
    if error_estimate:
        raise UsageError("--error-estimate needs the whole recording: omit it or --stream")


def streamed(
    folder: RunFolder, scenario: Scenario, contact: str | None, about: dict[str, Any], header: Any
) -> tuple[dict[str, Any], GearsError | None]:
    """Simulate into the folder; return the summary, and the error that ended the run early."""
    from gears3d.cli.progress import bars
    from gears3d.kernels import compiled
    from gears3d.recording.streaming import SIGNALS, excerpt
    from gears3d.runs import summarise
    from gears3d.simulation import stream

    begin = time.perf_counter()
    stopped: GearsError | None = None
    with bars() as track:
        try:
            stream(scenario, folder.path, contact=contact, progress=track("bullet", scenario.run.duration))
        except (EngineError, InputError) as error:
            if not (folder.path / SIGNALS).exists():
                raise
            stopped = error
    summary = {**summarise(scenario, excerpt(folder.path)), **about, "kernels_compiled": bool(compiled)}
    folder.write_scenario(scenario, header(summary))
    wall = time.perf_counter() - begin
    summary["wall_s"] = {"bullet": wall, "total": wall}
    folder.write_summary(summary)
    return summary, stopped

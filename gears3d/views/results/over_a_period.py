"""The camera's pictures as reports take them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario
    from gears3d.views.report import Picture


def over_a_period(seen: Recording | Measurement, scenario: Scenario) -> Picture | None:
    """Return the mesh over a period in pictures; ``None`` where a recording is too short for them."""
    from gears3d.views.camera import camera
    from gears3d.views.report import Picture

    try:
        taken = camera(seen, scenario)
    except InputError:
        return None
    begin, lasts = taken.span
    what = "a period; " if scenario.motion.harmonics else ""
    caption = (
        f"From {begin:.6g} s over {1e3 * lasts:.4g} ms, {what}gap drawn {taken.look.factor:g} times its width. "
        "More pictures, and videos: gears3d camera."
    )
    return Picture(taken.svg(), taken.words(), caption)

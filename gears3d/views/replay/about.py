"""The replay's text panel: what it shows, to which scale, in which colours."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

from gears3d.views.plots.motion import PLOT_RATE, is_measured
from gears3d.views.replay.layout import FRAMES_A_SECOND
from gears3d.views.replay.sdk import rr

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.views.plots.motion import Motion
    from gears3d.views.plots.teeth import Section


def about(scenario: Scenario, motion: Motion, wide: Section, scales: tuple[float, ...], rate: float) -> rr.TextDocument:
    """Return the text panel."""
    pair, recording = wide.pair, motion.recording
    flank = recording.impacts["flank"]
    active, reverse = int((flank == 0).sum()), int((flank == 1).sum())
    source = f" ({scenario.source})" if scenario.source else ""
    model = recording.meta.get("model", "")
    lines = [
        f"## {scenario.title or 'Gear rattle'}{source}",
        f"{pair.drive.teeth}/{pair.loose.teeth} teeth, module {pair.drive.module * 1e3:g} mm, backlash "
        f"{pair.backlash * 1e6:g} um, {motion_words(scenario)}, drag {scenario.drag.torque:g} N m, restitution "
        f"{scenario.impact.restitution:g}" + (f"; model: {model}" if model else "") + ".",
        f"**{active} impacts on the active flank (blue), {reverse} on the reverse flank (orange)**; grey is flight.",
        f"- Mesh zone: the pair is drawn as if its backlash were **{wide.factor:g} times** as wide "
        f"({wide.backlash:.3g} mm); flank deviations are part of the motion, but not of the drawing.",
        f"- Slow motion: 1 s takes {rate / FRAMES_A_SECOND:.0f} s. Pictures "
        f"{motion.frame_rate():.0f} per second and at every impact.",
        "- Dots: where teeth touch, thin lines through them: the common normal. Grey bars: the gaps of a flight.",
        "- Poincaré section: every impact up to now."
        + (
            ""
            if is_measured(recording)
            else " Torque: J dω/dt between impacts; contact is lost where it falls to the drag torque."
        ),
        f"- Curves: {PLOT_RATE:g} samples per second and all samples near impacts; the Parquet files hold all.",
    ]
    if all(scales):
        lines.append(
            "- Arrows: impulse on the loose gear where it acted, fading for two seconds; "
            f"1 N s = {scales[0]:g} mm in the scene, {scales[1]:g} mm in the zone."
        )
    if pair.drive.helix_angle:
        lines.append(
            "- Helical teeth: the mesh zone and all marks show the transverse section in the middle of the teeth."
        )
    if recording.meta.get("interrupted"):
        lines.insert(1, "**Interrupted: this is a part of the run.**")
    return rr.TextDocument("\n\n".join(lines[:4]) + "\n" + "\n".join(lines[4:]), media_type=rr.MediaType.MARKDOWN)


def motion_words(scenario: Scenario) -> str:
    """Return the drive's motion in words."""
    rpm = 30.0 / pi
    parts = [f"{scenario.motion.mean * rpm:g} rpm"]
    parts += [f"{h.amplitude * rpm:.3g} rpm at {h.frequency:g} Hz" for h in scenario.motion.harmonics]
    return "drive " + " + ".join(parts)

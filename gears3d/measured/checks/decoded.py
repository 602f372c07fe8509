"""What decoders of raw channels saw: illegal transitions, pulses that are missing, steps too large to be read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gears3d.measured.checks.finding import Finding

REMEDIES = {
    "illegal-transitions": "sample faster, or check thresholds and cables",
    "lost-counts": "check thresholds and cables: counts between index marks differ",
    "lost-pulses": "check the threshold of the tacho",
    "large-steps": "sample faster, or use a counter with more bits",
    "drift": "record an angle: an integrated speed drifts",
}


def examine(meta: Mapping[str, Any]) -> list[Finding]:
    """Find what a decoder noted that is wrong with a channel.

    Args:
        meta: of the record; ``decoded`` has what decoders saw.

    >>> note = {"kind": "lost-pulses", "channel": "T", "size": 2.0, "unit": "", "text": "2 missing", "harmless": False}
    >>> [(one.kind, one.channel, one.size) for one in examine({"decoded": [note, {**note, "harmless": True}]})]
    [('lost-pulses', 'T', 2.0)]
    """
    notes = meta.get("decoded", [])
    return [
        Finding(
            str(note["kind"]),
            str(note.get("channel", "")),
            float(note.get("size", 0.0)),
            str(note.get("unit", "")) or "1",
            str(note.get("text", "")),
            REMEDIES.get(note["kind"], ""),
        )
        for note in (notes if isinstance(notes, list) else [])
        if isinstance(note, Mapping) and note.get("kind") and not note.get("harmless", True)
    ]

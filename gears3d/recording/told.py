"""What a recording came to, as ``gears3d.describe``."""

from __future__ import annotations

from typing import Any

from gears3d import signals
from gears3d.recording.record import Recording


def describe(recording: Recording) -> dict[str, Any]:
    """Return regime, motion, speeds, energies and durations of a recording of any source, after its settling time.

    Args:
        recording: of a model, or measured, with impacts. The more its ``meta`` says (``period_s``, ``settle_s``,
            ``contacts``, ``inertia_kg_m2`` ...), the more numbers there are.

    Returns:
        What :func:`gears3d.signals.describe` returns: plain values by name, ``None`` for what is not known.

    >>> hits = {"time_s": [0.5], "flank": ["active"], "velocity_m_s": [-0.02]}
    >>> angles = {"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]}
    >>> describe(Recording(angles, hits))["regime"]
    'single_sided'
    """
    return signals.describe(recording.signals, recording.impacts, recording.meta)

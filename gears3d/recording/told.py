"""What a recording came to, as ``gears3d.describe``, and the strongest lines of its spectra."""

from __future__ import annotations

from typing import Any

from gears3d import signals
from gears3d.errors import Fault, InputError, UsageError
from gears3d.recording.record import Recording


def describe(recording: Recording) -> dict[str, Any]:
    """Return regime, motion, speeds, energies and durations of a recording of any source, after its settling time.

    Args:
        recording: of a model, or measured, with impacts. The more its ``meta`` says (``period_s``, ``settle_s``,
            ``contacts``, ``inertia_kg_m2`` ...), the more numbers there are.

    Returns:
        What :func:`gears3d.signals.describe` returns: plain values by name, ``None`` for what is not known.

    Raises:
        InputError: flights and contact do not explain the motion of the measured record.

    >>> hits = {"time_s": [0.5], "flank": ["active"], "velocity_m_s": [-0.02]}
    >>> angles = {"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]}
    >>> describe(Recording(angles, hits))["regime"]
    'single_sided'
    """
    refuse_unexplained(recording)
    return signals.describe(recording.signals, recording.impacts, recording.meta)


def refuse_unexplained(recording: Recording, file: str = "") -> None:
    """Refuse a measured record whose motion flights and contact do not explain: it has no impacts to speak of.

    Args:
        recording: of any source.
        file: named in the fault.

    Raises:
        InputError: the record is such a one.
    """
    if reason := recording.meta.get("unexplained"):
        raise InputError(Fault("", f"has no impacts: the loose gear {reason}", "see `gears3d segment`", file))


def described(recording: Recording) -> list[tuple[str, str]]:
    """Return the numbers that a reader asks for first, name and value; nothing without impacts.

    Args:
        recording: of any source.
    """
    if not len(recording.impacts["time_s"]):
        return []
    found = describe(recording)

    def scaled(key: str, factor: float, unit: str) -> str:
        return "" if found.get(key) is None else f"{factor * found[key]:.4g} {unit}".strip()

    return [
        ("regime", " ".join(str(found[key]).replace("_", " ") for key in ("regime", "motion") if found.get(key))),
        ("impacts a period", scaled("impacts_per_period", 1.0, "")),
        ("mean speed, active flank", scaled("active_velocity_mean_m_s", 1e3, "mm/s")),
        ("mean speed, reverse flank", scaled("reverse_velocity_mean_m_s", 1e3, "mm/s")),
        ("longest flight", scaled("flight_longest_s", 1e3, "ms")),
    ]


def settled(recording: Recording) -> Recording:
    """Return the part of a recording after its settling time, cut to whole periods of the excitation if it has one.

    Args:
        recording: with ``settle_s`` and ``period_s`` in its ``meta`` as far as known.
    """
    start, end = signals.window(recording.signals, recording.meta)
    period = recording.meta.get("period_s")
    count = int((end - start) / period + 1e-9) if period else 0
    if count >= 1 and len(recording.time) > 1:
        start = end - count * float(period or 0.0) + 0.5 * float(recording.time[1] - recording.time[0])
    return recording.between(start, end)


def spectra(recording: Recording) -> dict[str, signals.Spectrum | None]:
    """Return the amplitude spectra of the displacement after settling, over frequency and over both gears' orders.

    Args:
        recording: with a displacement.

    Returns:
        By ``"frequency"``, ``"order_drive"``, ``"order_loose"``; ``None`` where there are too few samples or
        revolutions, or a gear turns back.
    """
    part = settled(recording)
    if "displacement_m" not in part.signals:
        return dict.fromkeys(("frequency", "order_drive", "order_loose"))
    place = part.signals["displacement_m"]
    found: dict[str, signals.Spectrum | None] = {}
    for name in ("frequency", "order_drive", "order_loose"):
        try:
            if name == "frequency":
                found[name] = signals.frequency_spectrum(part.time, place)
            else:
                angle = part.signals[name.replace("order", "theta") + "_rad"]
                found[name] = signals.order_spectrum(angle, place)
        except UsageError:
            found[name] = None
    return found

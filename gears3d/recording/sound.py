"""A recording's impacts as a WAV file, with the numbers that say how loud they are."""

from __future__ import annotations

import io
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.files import write_bytes
from gears3d.laws import noise
from gears3d.recording.columns import FLANKS
from gears3d.recording.record import Recording, describe, refuse_unexplained
from gears3d.signals.impacts import impact_values
from gears3d.signals.outcome import drive_speed, equivalent_mass
from gears3d.signals.sound import MODES, Mode, normalised, ring

# What the strength of a burst is proportional to, and its unit; with energy it is the root of it
SCALINGS = {"impulse": "N s", "energy": "J^0.5", "velocity": "m/s"}
RATES = (44_100, 48_000)


def write_wav(
    recording: Recording,
    path: str | Path,
    *,
    slow: float = 1.0,
    rate: int = 48_000,
    by: str | None = None,
    stereo: bool = False,
    modes: tuple[Mode, ...] = MODES,
) -> dict[str, Any]:
    """Write the impacts of a recording as a 16 bit WAV file, under a temporary name that is renamed.

    Args:
        recording: with impacts.
        path: of the file.
        slow: how many times slower than real; bursts keep their pitch.
        rate: samples a second, 44100 or 48000.
        by: what scales a burst: ``"impulse"``, ``"energy"`` (its root) or ``"velocity"``; unless given, the impulse
            where it is known.
        stereo: active flank on the left, reverse flank on the right.
        modes: that ring after each impact.

    Returns:
        What was done: ``file``, ``duration_s``, ``sample_rate_Hz``, ``channels``, ``slow``, ``impacts``, ``by``,
        ``unit``, ``full_scale_per_unit`` (factor of the normalisation), ``modes``.

    Raises:
        InputError: there are no impacts, what is to scale them is not known, or the file cannot be written.
        UsageError: an unknown scaling or rate, or a slowing or a mode that cannot be.
    """
    from scipy.io import wavfile

    if rate not in RATES:
        raise UsageError(f"a rate of {rate} is not offered: 44100 or 48000")
    by, strengths = _strengths(recording, by)
    first = float(recording.time[0]) if len(recording.time) else 0.0
    last = max(float(recording.time[-1]) if len(recording.time) else 0.0, float(recording.impacts["time_s"][-1]))
    flank, times = recording.impacts["flank"], recording.impacts["time_s"] - first
    parts = [np.where(flank == code, strengths, 0.0) for code in (0, 1)] if stereo else [strengths]
    sound = np.stack([ring(times, one, last - first, rate, modes, slow) for one in parts], axis=1)
    whole, factor = normalised(sound)
    file = io.BytesIO()
    wavfile.write(file, rate, whole if stereo else whole[:, 0])
    write_bytes(path, file.getvalue())
    return {
        "file": str(path),
        "duration_s": len(whole) / rate,
        "sample_rate_Hz": rate,
        "channels": list(FLANKS) if stereo else ["both"],
        "slow": slow,
        "impacts": len(times),
        "by": by,
        "unit": SCALINGS[by],
        "full_scale_per_unit": factor,
        "modes": [{"frequency_Hz": m.frequency, "decay_s": m.decay, "weight": m.weight} for m in modes],
    }


def levels(recording: Recording, constant: float | None = None, whine: float = noise.WHINE_30_RPM) -> dict[str, Any]:
    """Return how loud a recording's rattle is, as far as impacts alone can say.

    The energy that impacts take is an upper bound of what can be radiated; its level compares recordings of one rig.

    Args:
        recording: with impacts.
        constant: A of Rigaud & Perret-Liaudet 2020, eq. (26) [s³/rad³]; without it the sound has no pressure level.
        whine: level of the whine [dB].

    Returns:
        ``energy_J_s``, ``active_energy_J_s``, ``reverse_energy_J_s``, ``energy_level_dB`` (re 1 pW),
        ``impacts_per_second``, ``rattle_drive_rad3_s3`` (ω²·ΔΩ), ``rattle_drive_level_dB`` (10·log10 of it), and with
        a constant ``whine_level_dB``, ``rattle_level_dB``, ``total_level_dB`` (re 20 µPa); ``None`` where unknown.

    Source: Rigaud & Perret-Liaudet 2020, eqs (22) to (27).
    """
    told = describe(recording)
    period, radius = recording.meta.get("period_s"), recording.meta.get("base_radius_drive_m")
    speed = drive_speed(recording.signals, recording.meta)
    driven = None
    if speed is not None and period and radius:
        driven = float(noise.rattle_drive(2 * pi / period, speed / radius))
    start = float(recording.meta.get("settle_s") or 0.0)
    span = float(recording.time[-1]) - start if len(recording.time) else 0.0
    power = told["energy_J_s"]
    rattle = None if driven is None or constant is None else 10.0 * float(np.log10(constant * driven))
    return {
        **{key: told[key] for key in ("energy_J_s", "active_energy_J_s", "reverse_energy_J_s")},
        "energy_level_dB": float(noise.power_level(power)) if power else None,
        "impacts_per_second": told["impacts"] / span if span > 0.0 else None,
        "rattle_drive_rad3_s3": driven,
        "rattle_drive_level_dB": None if driven is None else 10.0 * float(np.log10(driven)),
        "whine_level_dB": whine if rattle is not None else None,
        "rattle_level_dB": rattle,
        "total_level_dB": None if rattle is None else float(noise.total_level(whine, rattle)),
    }


def _strengths(recording: Recording, by: str | None) -> tuple[str, np.ndarray]:
    if by is not None and by not in SCALINGS:
        raise UsageError(f"impacts cannot be scaled by {by!r}; {did_you_mean(by, list(SCALINGS))}")
    impacts = recording.impacts
    refuse_unexplained(recording)
    if not len(impacts["time_s"]):
        raise InputError(Fault("impacts", "are missing: contact was never lost", "there is nothing to hear"))
    ones = impact_values(impacts, equivalent_mass(impacts, recording.meta))
    known = {
        "impulse": np.abs(ones["impulse_N_s"]),
        "energy": np.sqrt(np.maximum(ones["energy_J"], 0.0)),
        "velocity": np.abs(impacts["velocity_m_s"]),
    }
    if by is None:
        by = "impulse" if np.isfinite(known["impulse"]).all() else "velocity"
    if not np.isfinite(known[by]).all():
        raise InputError(Fault(f"impacts.{by}", "is not known of every impact", "scale the bursts by velocity"))
    return by, known[by]

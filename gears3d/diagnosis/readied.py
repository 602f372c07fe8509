"""Records made ready for cutting: what the sensors do to them is taken out first, and given back to the evidence.

Encoders that are read one after the other make the displacement follow the speed; by a large part of the backlash no
flank stands still then, and nothing is cut rightly. The gate tells the delay without any cutting.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.evidence import Evidence, evidence
from gears3d.effects import catalogue
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.gate import Admitted

MOST = 0.5
"""Part of the records in which the gate must see a delay for all of them to have it."""


def delay_of(admitted: Sequence[Admitted]) -> float:
    """Return by how much the loose gear is read later than the drive [s], 0 where the gate sees no such thing.

    Args:
        admitted: records that passed the sensor gate; a delay that was corrected there counts no more.
    """
    seen = [each.size for one in admitted for each in one.findings if each.kind == "skew" and not each.corrected]
    return float(np.median(seen)) if len(seen) > MOST * len(admitted) else 0.0


def ready(one: Admitted, delay: float = 0.0) -> Evidence:
    """Return a record as evidence, cut as if the loose gear had been read in time with the drive.

    Args:
        one: the record.
        delay: of the loose gear's readings [s]; the evidence has it as spared, so that it remains to be explained.

    Raises:
        InputError: the record cannot be measured.
    """
    from gears3d.measurement import measure

    assert one.rig is not None
    if delay == 0.0:
        return evidence(measure(one.recording, one.rig, one.file), one.rig, one.file)
    spared = (catalogue()["encoder_skew"](delay=delay, gear="loose"),)
    return evidence(measure(_read_in_time(one.recording, delay), one.rig, one.file), one.rig, one.file, spared)


def _read_in_time(record: Recording, delay: float) -> Recording:
    """Return a record whose loose gear is read earlier by a delay; what is then not known of it is cut off.

    The loose gear is moved by whole rows, so that its noise stays what it is; parts of a row go to the drive, which
    moves smoothly.
    """
    time = record.time
    spacing = float(np.median(np.diff(time)))
    rows = round(delay / spacing)
    kept = np.arange(max(-rows, 0) + 1, len(time) - max(rows, 0) - 1)
    drive = np.interp(time[kept] - (delay - rows * spacing), time, record.signals["theta_drive_rad"])
    signals = {name: values[kept] for name, values in record.signals.items()}
    signals |= {"theta_drive_rad": drive, "theta_loose_rad": record.signals["theta_loose_rad"][kept + rows]}
    return Recording(signals, meta=record.meta)

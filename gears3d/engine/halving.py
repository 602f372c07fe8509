"""The error of a run due to its step, from the difference to the same run with half of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.recording import Recording

# Order of the error in the step: flights and compliant contacts use two Gauss points a step; native is Bullet's own
# integration.
ORDER = {"located": 4, "native": 1}
PARTED = 0.01  # distance of two runs, as a part of the backlash, beyond which they are independent


def halved(made: Recording, finer: Recording, backlash: float, order: int) -> dict[str, Any]:
    """Return the error of a run ``made``, as estimated by the run ``finer`` with half its longest step.

    The dict has ``order``, that of the error in the step; ``step_s`` and ``half_step_s`` as in the runs' ``meta``;
    ``until_s``, up to which both were compared, and ``parted``, whether they diverged there, as chaotic motions do with
    any step; ``displacement_m`` and ``displacement_rms_m``; and of ``impacts`` compared one by one the largest
    ``impact_time_s`` and ``impact_velocity_m_s``. All errors are those of ``made``: the difference times
    2^order/(2^order - 1). ``backlash`` is in m.

    Source: Richardson's extrapolation.
    """
    share = 2.0**order / (2.0**order - 1.0)
    count = min(len(made.time), len(finer.time))
    apart = np.abs(made.signals["displacement_m"][:count] - finer.signals["displacement_m"][:count])
    gone = np.flatnonzero(apart > PARTED * backlash)
    parted = bool(gone.size)
    count = int(gone[0]) if parted else count
    until = float(made.time[count - 1]) if count else 0.0
    ours, theirs = ({name: hits[hits_name] for name, hits_name in _COMPARED} for hits in (made.impacts, finer.impacts))
    hits = min(*(int(np.searchsorted(table["time"], until, side="right")) for table in (ours, theirs)))
    other = np.flatnonzero(ours["flank"][:hits] != theirs["flank"][:hits])
    hits = int(other[0]) if other.size else hits
    off = {name: np.abs(ours[name][:hits] - theirs[name][:hits]) for name in ("time", "velocity")}
    return {
        "order": order,
        "step_s": made.meta["longest_step_s"],
        "half_step_s": finer.meta["longest_step_s"],
        "until_s": until,
        "parted": parted or bool(other.size),
        "displacement_m": share * float(apart[:count].max(initial=0.0)),
        "displacement_rms_m": share * float(np.sqrt(np.mean(apart[:count] ** 2))) if count else 0.0,
        "impacts": hits,
        "impact_time_s": share * float(off["time"].max(initial=0.0)),
        "impact_velocity_m_s": share * float(off["velocity"].max(initial=0.0)),
    }


_COMPARED = (("time", "time_s"), ("flank", "flank"), ("velocity", "velocity_m_s"))

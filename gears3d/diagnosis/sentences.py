"""Sentences on a cause and its competing hypotheses, with sizes that an engineer can compare with the test rig."""

from __future__ import annotations

import numpy as np

from gears3d.diagnosis.candidates import ACCEPT
from gears3d.diagnosis.cause import Cause, significance, table
from gears3d.diagnosis.heldout import UNITS
from gears3d.diagnosis.path_fit import EXCLUDED
from gears3d.diagnosis.path_search import Path
from gears3d.diagnosis.prediction import rms_of
from gears3d.diagnosis.search import Rival, Search
from gears3d.units import show

Array = np.ndarray
# Predicted quantity of each channel.
SEEN = {
    "flight": "angle in free flight",
    "contact": "displacement in contact",
    "impact": "rebound speed",
    "loss": "separation speed",
    "drive": "angle of the drive gear",
}


def alternative(rival: Rival) -> dict[str, str]:
    """Return a hypothesis that the data do not exclude, as ``kind`` and ``why``."""
    if rival.worse > 0.5:
        why = f"fits worse by Δχ² = {rival.worse:.4g}, which "
        why += (
            "errors of the model or few windows may make"
            if rival.worse > EXCLUDED
            else "is not sufficient to exclude it"
        )
    elif rival.worse < -ACCEPT:
        why = f"fits better by Δχ² = {-rival.worse:.4g}, but was not selected by the search"
    elif rival.worse < -0.5:
        why = f"fits better by Δχ² = {-rival.worse:.4g}, which is not sufficient to prefer it"
    else:
        why = "predicts the same values for all records"
    return {"kind": _kinds(rival), "why": f"{why} ({_shapes(rival)})"}


def refused(rival: Rival) -> dict[str, str]:
    """Return a hypothesis that the data exclude, as ``kind`` and ``why``."""
    return {"kind": _kinds(rival), "why": f"fits worse by {significance(rival.worse)} ({_shapes(rival)})"}


def _kinds(rival: Rival) -> str:
    return " + ".join(cause.candidate.kind for cause in rival.causes)


def _shapes(rival: Rival) -> str:
    return ", ".join(f"{name} = {value}" for one in rival.causes
                     for name, value in table(one.effect, digits=4).items() if name != "kind")  # fmt: skip


def evidence_for(found: Search, cause: Cause, without: Array, gain: float) -> str:
    """Return one sentence: where a cause shows, and by how much it reduces the residual there.

    without: residuals from the other causes alone, (n,); gain: fall of chi-square in addition to the others.
    """
    best, text = 0.0, ""
    for name in cause.candidate.channels:
        span = found.known.spans[name]
        before, after = without[span], found.fit.rest[span]
        fall = float(before @ before - after @ after)
        if fall > best and len(before):
            best = fall
            rms = [float(np.sqrt(np.mean(part**2))) for part in (before, after)]
            sizes = [sized(rms_of(part, found.records, name), UNITS[name]) for part in (before, after)]
            text = f"{SEEN[name]}: error {sizes[0]} without this cause, {sizes[1]} with it"
            text += f" ({rms[0]:.3g} and {rms[1]:.3g} times the noise); "
    return f"{text}total significance {significance(gain)}"


def along(path: Path, gain: float) -> str:
    """Return one sentence: by how much the causes reduce the path error, and the gain of one of them."""
    before, after = np.sqrt(path.before), np.sqrt(path.after)
    text = f"displacement predicted in {path.windows} windows: error {before:.3g} times the noise without causes"
    return f"{text}, {after:.3g} times with all of them; significance of this one {significance(gain)}"


def sized(size: float, unit: str) -> str:
    """Return a size of a channel [SI] with a readable unit.

    >>> sized(2.957e-5, "m"), sized(4.67e-8, "m"), sized(8.8e-7, "rad"), sized(1.2e-4, "m/s")
    ('29.6 um', '46.7 nm', '0.88 urad', '0.12 mm/s')
    """
    if unit == "rad":
        return f"{1e6 * size:.3g} urad"
    if unit == "m":
        return show(size, "length", 3) if size >= 1e-7 else f"{1e9 * size:.3g} nm"
    return f"{1e3 * size:.3g} mm/s"

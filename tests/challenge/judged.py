"""How a measurement compares with the truth of a record of the operating space: right, silent, wrong, and why."""

import re
import tempfile
from pathlib import Path

import numpy as np

from gears3d.errors import InputError

FOUND, INVENTED, FLANKS = 0.8, 0.05, 0.95
"""Wrong are: less of the visible impacts found, more of the reported ones invented, fewer on the right flank."""
GROSS = 3.0
"""Interval widths from which on an error is gross."""
MATTERS = 0.01, 0.05
"""Error of the backlash over the backlash, and of the restitution, below which a gross one makes no record wrong."""
NEAR = 1.5
"""A regime may rest on flights up to so many times the stated height: the height is known no better."""
SPEED = 0.1, 3.0
"""Median error of the approach speed, and its median pull, that both make a record wrong."""


def admitted(taken, folder):
    """The record as the command reads it, from its file through the checks of sensors."""
    from gears3d.measured.checks import admit

    file = Path(folder) / "record.parquet"
    taken.record.write(file)
    return admit(file, taken.scenario)


def judge(taken, laws=True):
    """Return a row: verdict and numbers of one record."""
    from gears3d.measured.segmentation import measure

    row = {"verdict": "silent", "why": "", "laws": {}}
    with tempfile.TemporaryDirectory() as folder:
        try:
            one = admitted(taken, folder)
        except InputError as error:
            return row | {"stage": "checks", "why": _kind(error)}
    row["findings"] = sorted({finding.kind for finding in one.findings})
    try:
        found = measure(one.recording, one.rig)
    except InputError as error:
        return row | {"stage": "measure", "why": _kind(error)}
    if found.summary["status"] == "unexplained":
        return row | {"stage": "measure", "why": "unexplained: " + _kind_of(found.summary["warnings"][0])}
    row |= {"stage": "measured"} | compared(taken.truth, found)
    if laws:
        row["laws"] = {"restitution": _restitution(taken.truth, found, one.rig), **_contact(taken.truth, one)}
    return row


def compared(truth, found):
    """Return verdict and numbers of a measurement."""
    summary, told = found.summary, found.segments.impacts
    height = summary["flight_height_min_m"]
    regimes = {truth.regime(h) for h in (0.0, 0.05e-6, 0.5 * height, height, NEAR * height)}
    row = {"regime": summary["regime"], "true_regime": truth.regime(), "seen_regime": truth.regime(height)}
    row |= {"height_min": height / truth.backlash, "warned": bool(summary["warnings"])}
    row["orders"] = len(summary["flanks"]["orders"]["active"])
    row |= _matched(truth, told, height) | _backlash(truth, summary["flanks"]["backlash_m"])
    wrong = []
    if row["regime"] not in regimes:
        wrong.append(f"regime {row['regime']} for {row['true_regime']}")
    if row.get("backlash_gross") and abs(row["backlash_error"]) > MATTERS[0]:
        wrong.append("backlash")
    if row["visible"] >= 5 and row["found"] < FOUND * row["visible"]:
        wrong.append("missed impacts")
    if row["invented"] > max(INVENTED * row["told"], 2):
        wrong.append("invented impacts")
    if row["found"] >= 5 and row["flank"] < FLANKS * row["found"]:
        wrong.append("flanks")
    if row["found"] >= 5 and row["speed_error"] > SPEED[0] and row["speed_pull"] > SPEED[1]:
        wrong.append("speeds")
    row["verdict"] = ("warned" if row["warned"] else "wrong") if wrong else "right"
    row["why"] = ", ".join(wrong)
    return row


def _matched(truth, told, height):
    """Impacts matched one to one by time: found, on the right flank, invented; errors of time and speed."""
    hits = truth.impacts
    visible = hits["flight_height_m"] > height
    row = {"impacts": len(hits["time_s"]), "visible": int(visible.sum()), "told": len(told["time_s"])}
    row |= {"found": 0, "flank": 0, "invented": row["told"], "speed_error": 0.0, "speed_pull": 0.0}
    if not row["told"] or not row["impacts"]:
        return row
    mine, time = told["time_s"], hits["time_s"]
    slack = np.maximum(5.0 * truth.step, 0.2 * hits["flight_s"])
    nearest = _nearest(mine, time)
    late = np.abs(mine[nearest] - time)
    found = visible & (late <= slack)
    back = _nearest(time, mine)
    error = told["time_sigma_s"]
    own = np.maximum(slack[back], 5.0 * np.nan_to_num(error))
    row["invented"] = int(np.sum(np.abs(time[back] - mine) > own))
    row["found"] = int(found.sum())
    right = told["flank"][nearest] == hits["flank"]
    row["flank"] = int((found & right).sum())
    good = found & right & np.isfinite(told["velocity_m_s"][nearest])
    if good.any():
        off = (told["velocity_m_s"][nearest] - hits["velocity_m_s"])[good]
        pulls = np.abs(off) / told["velocity_sigma_m_s"][nearest][good]
        row["speed_error"] = float(np.median(np.abs(off / hits["velocity_m_s"][good])))
        row["speed_pull"] = float(np.median(pulls)) / 0.6745
        row["speed_far"] = float(np.mean(pulls > 3.0))
    return row


def _nearest(sorted_times, times):
    after = np.clip(np.searchsorted(sorted_times, times), 1, max(len(sorted_times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(sorted_times) - 1)
    closer = np.abs(sorted_times[after] - times) < np.abs(sorted_times[before] - times)
    return np.where(closer, after, before)


def _backlash(truth, value):
    if value is None:
        return {"backlash": "silent"}
    low, high = value["ci95"]
    return _interval("backlash", value["value"], low, high, truth.backlash, truth.backlash)


def _interval(name, value, low, high, true, scale):
    """Return whether an interval holds, and its relative error and width."""
    error = value - true
    told = {f"{name}_error": error / scale, f"{name}_width": (high - low) / scale}
    told[name] = "right" if low <= true <= high else "wrong"
    told[f"{name}_gross"] = bool(abs(error) > GROSS * (high - low))
    return told


def _restitution(truth, found, rig):
    from gears3d.identify import identify_restitution

    try:
        law = identify_restitution([found], rig.rig())
    except InputError as error:
        return {"restitution": "silent", "why": _kind(error)}
    extra = [name for name in ("slope", "asymmetry") if name in law.parameters]
    one = law.parameters["restitution"]
    row = _interval("restitution", one.value, one.low, one.high, truth.restitution, 1.0)
    row["pairs"] = law.goodness["pairs"]
    if extra:  # a dependence that is not there
        return row | {"restitution": "wrong", "why": f"false {extra[0]}"}
    if row["restitution"] == "wrong":
        row["why"] = "gross" if row["restitution_gross"] and abs(row["restitution_error"]) > MATTERS[1] else "interval"
    return row


def _contact(truth, one):
    """Backlash from contact, and orders of flanks that are perfect."""
    from gears3d.identify import read_contacts, roll, transmission_error
    from gears3d.identify.backlash import backlash

    try:
        rolled = roll(read_contacts([one]))
    except InputError as error:
        return {name: {name: "silent", "why": _kind(error)} for name in ("backlash", "transmission_error")}
    told = {}
    try:
        wide = backlash(rolled).parameters["backlash"]
        row = _interval("backlash", wide.value, wide.low, wide.high, truth.backlash, truth.backlash)
        if row["backlash"] == "wrong":
            row["why"] = "gross" if row["backlash_gross"] and abs(row["backlash_error"]) > MATTERS[0] else "interval"
        told["backlash"] = row
    except InputError as error:
        told["backlash"] = {"backlash": "silent", "why": _kind(error)}
    orders = [part.value for name, part in transmission_error(rolled).parameters.items() if name.endswith("amplitude")]
    size = max(orders, default=0.0) / truth.backlash
    told["transmission_error"] = {"transmission_error": "wrong" if orders else "right", "size": size}
    if orders:
        told["transmission_error"]["why"] = "false order"
    return told


def _kind_of(text):
    """Return what is not explained, without numbers."""
    return re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text.split("the loose gear ")[-1])[:120]


def _kind(error):
    """Return the message of an error with its numbers taken out, so that like ones are counted together."""
    text = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", error.faults[0].message)
    kind = re.search(r"\[[a-z-]+\]$", text)
    return kind.group(0) if kind else text[:90]

"""How a measurement compares with the truth of a record of the operating space: right, silent, wrong, and why.

A row's ``verdict`` is ``right``, ``silent`` (refused), ``warned`` (wrong, with a warning in the summary) or ``wrong``.
A law is ``right`` when its 95 % interval holds the truth, ``narrow`` when it does not but the error is no gross one.
"""

import re
import tempfile
from pathlib import Path

import numpy as np

from gears3d.errors import InputError

FOUND, INVENTED, FLANKS = 0.8, 0.05, 0.95
"""Wrong are: less of the clear impacts found, more of the reported ones invented, fewer on the right flank."""
CLEAR = 2.0
"""Stated heights from which on a flight is clear; from one on it is visible."""
GROSS = 3.0
"""Interval widths from which on an error is gross."""
MATTERS = {"backlash": 0.01, "restitution": 0.05, "order": 0.005}
"""Errors of backlash and orders over the backlash, and of restitution, below which a gross one is not wrong."""
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
    summary, reported = found.summary, found.segments.impacts
    height = summary["flight_height_min_m"]
    regimes = {truth.regime(h) for h in (0.0, 0.05e-6, 0.5 * height, height, NEAR * height)}
    row = {"regime": summary["regime"], "true_regime": truth.regime(), "seen_regime": truth.regime(height)}
    row |= {"height_min": height / truth.backlash, "warned": bool(summary["warnings"])}
    orders = [one for side in summary["flanks"]["orders"].values() for one in side]
    known = {wave.order for wave in truth.waves}
    row["wave"] = max((one["amplitude_m"] for one in orders if one["order"] not in known), default=0.0) / truth.backlash
    row["chi2"], row["unexplained"] = summary["cut"]["chi2_median"], summary["cut"]["unexplained"]
    row["drive_error"] = _drive_error(truth, found.segments.track)
    row["noise_m"] = summary["quality"]["noise_m"] / truth.backlash
    row |= _matched(truth, reported, height) | _backlash(truth, summary["flanks"]["backlash_m"])
    wrong = []
    if row["regime"] not in regimes:
        wrong.append(f"regime {row['regime']} for {row['true_regime']}")
    if row.get("backlash_gross") and abs(row["backlash_error"]) > MATTERS["backlash"]:
        wrong.append("backlash")
    if row["clear"] >= 5 and row["found_clear"] < FOUND * row["clear"]:
        wrong.append("missed impacts")
    if row["invented"] > max(INVENTED * row["reported"], 2):
        wrong.append("invented impacts")
    if row["found"] >= 5 and row["flank"] < FLANKS * row["found"]:
        wrong.append("flanks")
    if row["found"] >= 5 and row["speed_error"] > SPEED[0] and row["speed_pull"] > SPEED[1]:
        wrong.append("speeds")
    row["verdict"] = ("warned" if row["warned"] else "wrong") if wrong else "right"
    row["why"] = ", ".join(wrong)
    return row


def _drive_error(truth, track):
    """Error of the drive's speed as measure has it, over its fluctuation: 1 when the fluctuation is lost."""
    time = np.linspace(track.time[0], track.time[-1], 20_001)[400:-400]
    true = truth.drive_speed(time)
    return float(np.std(track.steady.curve(time, 1) - true) / np.std(true))


def _matched(truth, reported, height):
    """Impacts matched one to one by time: found, on the right flank, invented; errors of time and speed."""
    hits = truth.impacts
    visible, clear = (hits["flight_height_m"] > times * height for times in (1.0, CLEAR))
    row = {"impacts": len(hits["time_s"]), "visible": int(visible.sum()), "reported": len(reported["time_s"])}
    row |= {"clear": int(clear.sum()), "found_clear": 0}
    row |= {"found": 0, "flank": 0, "invented": row["reported"], "speed_error": 0.0, "speed_pull": 0.0}
    if not row["reported"] or not row["impacts"]:
        return row
    mine, time = reported["time_s"], hits["time_s"]
    slack = np.maximum(5.0 * truth.step, 0.2 * hits["flight_s"])
    nearest = _nearest(mine, time)
    late = np.abs(mine[nearest] - time)
    found = visible & (late <= slack)
    back = _nearest(time, mine)
    own = np.maximum(slack[back], 5.0 * np.nan_to_num(reported["time_sigma_s"]))
    row["invented"] = int(np.sum(np.abs(time[back] - mine) > own))
    row["found"], row["found_clear"] = int(found.sum()), int((found & clear).sum())
    right = reported["flank"][nearest] == hits["flank"]
    row["flank"] = int((found & right).sum())
    good = found & right & np.isfinite(reported["velocity_m_s"][nearest])
    if good.any():
        error = (reported["velocity_m_s"][nearest] - hits["velocity_m_s"])[good]
        pulls = np.abs(error) / reported["velocity_sigma_m_s"][nearest][good]
        row["speed_error"] = float(np.median(np.abs(error / hits["velocity_m_s"][good])))
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
    row = {f"{name}_error": error / scale, f"{name}_width": (high - low) / scale}
    row[f"{name}_gross"] = bool(abs(error) > GROSS * (high - low))
    matters = row[f"{name}_gross"] and abs(error) / scale > MATTERS[name]
    row[name] = "right" if low <= true <= high else "wrong" if matters else "narrow"
    return row


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
    if extra:  # a dependence that is not there; its 95 % interval may be wide
        return row | {"restitution": "wrong" if row["restitution"] == "wrong" else "narrow", "why": f"false {extra[0]}"}
    if row["restitution"] != "right":
        row["why"] = "gross" if row["restitution"] == "wrong" else "interval"
    return row


def _contact(truth, one):
    """Backlash from contact, and orders that the flanks do not have."""
    from gears3d.identify import read_contacts, roll, transmission_error
    from gears3d.identify.transmission import backlash

    try:
        rolled = roll(read_contacts([one]))
    except InputError as error:
        return {name: {name: "silent", "why": _kind(error)} for name in ("backlash", "transmission_error")}
    laws = {}
    try:
        wide = backlash(rolled).parameters["backlash"]
        row = _interval("backlash", wide.value, wide.low, wide.high, truth.backlash, truth.backlash)
        if row["backlash"] != "right":
            row["why"] = "gross" if row["backlash"] == "wrong" else "interval"
        laws["backlash"] = row
    except InputError as error:
        laws["backlash"] = {"backlash": "silent", "why": _kind(error)}
    known = tuple(f"_{wave.order}_amplitude" for wave in truth.waves)
    found = transmission_error(rolled).parameters.items()
    orders = [part.value for name, part in found if name.endswith("amplitude") and not name.endswith(known)]
    size = max(orders, default=0.0) / truth.backlash
    verdict = "right" if not orders else "wrong" if size > MATTERS["order"] else "narrow"
    laws["transmission_error"] = {"transmission_error": verdict, "size": size}
    if orders:
        laws["transmission_error"]["why"] = "false order"
    return laws


def _kind_of(text):
    """Return what is not explained, without numbers."""
    return re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", text.split("the loose gear ")[-1])[:120]


def _kind(error):
    """Return the message of an error with its numbers taken out, so that like ones are counted together."""
    text = re.sub(r"[-+]?\d[\d.]*(e[-+]?\d+)?", "#", error.faults[0].message)
    kind = re.search(r"\[[a-z-]+\]$", text)
    return kind.group(0) if kind else text[:90]

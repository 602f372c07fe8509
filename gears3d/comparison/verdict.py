"""Verdict on a user's own model, by channel: drive, flight, contact, impact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gears3d.comparison.own_model import OWN, drive_angle, explained_part, from_angles, reference
from gears3d.recording import FLANKS, Recording
from gears3d.results import Result
from gears3d.scenario import Scenario, load

AMID = 0.2  # Part of the backlash, at either flank, whose samples are not taken for flight
FEWEST = 20  # Samples of flight at least
TRIMMED = 6.0  # Usual deviations beyond which a sample does not count
HARD = 0.25  # Part of the largest speed from which on an impact counts as hard
# Samples of a rebound, its height over the backlash, and the part of that height below which it is missing
SEEN, LOW, FLAT = 5.0, 1e-4, 0.25

Array = np.ndarray
# Largest relative difference that still is equal: that of impact speeds between engine and rigid model, 95 %
BUDGET = 0.005
CERTAIN = 3.0  # Standard deviations that a difference must exceed as well
CARRIED = 0.05  # Part of the drive's acceleration that the loose gear may take over in flight
BEYOND = 0.001  # Part of the backlash by which gears may go beyond a flank at an impact
# The same where no backlash could be measured, and parts of it beyond which no flank holds the gear
ASTRAY, GONE = 0.02, 3.0
BEYOND_FLANKS = "way beyond the flanks"
MISSING, SOME = 0.1, 3  # Part of the impacts, and number, without a rebound from which on bounces are missing
# Causes that spoil what backlash and restitution are measured by
SPOILING = {"drive", "time", "sign", "step", "flanks"}
MOVED = 0.5  # Part of a difference of the drive's motion that a shift in time must explain to be one


class Flights(NamedTuple):
    """The acceleration of the loose gear in the gap, by least squares over all samples there."""

    deceleration: tuple[float, float]  # at the mean speed [rad/s²], value and standard deviation
    # acceleration of the drive that the loose gear takes over in flight, 1 in contact and 0 in free flight
    carried: tuple[float, float]


class Impacts(NamedTuple):
    """The impacts."""

    time: Array  # [s], (n,)
    flank: Array  # (n,)
    speed: Array  # of approach [m/s], (n,)
    rebound: Array  # NaN where it was not observed [m/s], (n,)
    lasts: Array  # duration that is certain [s], (n,)

    @property
    def ratio(self) -> Array:
        """Rebound speed over approach speed, NaN where the rebound was not observed, (n,)."""
        return np.abs(self.rebound) / self.speed


def stated_displacement(recording: Recording, scenario: Scenario) -> Array:
    """Return the displacement as the model has it, with the datum of its own angles [m], (n,)."""
    rig, zero = scenario.rig(), recording.meta.get("zero_rad", {})
    drive, loose = (recording.signals[f"theta_{gear}_rad"] + zero.get(gear, 0.0) for gear in ("drive", "loose"))
    return rig.base_radius_loose * loose - rig.base_radius_drive * drive


def flights_of(recording: Recording, scenario: Scenario) -> Flights | None:
    """Return the law of motion in the gap; ``None`` where the recording has too little of it."""
    known = scenario.rig()
    time, drive, loose = (recording.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    place, step = stated_displacement(recording, scenario), float(np.median(np.diff(time)))
    free = _amid(place, 0.0, known.backlash)
    if len(free) < FEWEST:  # the datum of the angles is another
        free = _amid(place, float(place.min()), float(place.max()))
    if len(free) < FEWEST:
        return None

    def second(values: Array) -> Array:
        return (values[free + 1] - 2.0 * values[free] + values[free - 1]) / step**2

    gained = second(loose)
    pushed = known.base_radius_drive / known.base_radius_loose * second(drive)
    speed = (loose[free + 1] - loose[free - 1]) / (2.0 * step)
    base = np.stack([-np.ones(len(free)), pushed, speed - speed.mean()], axis=1)
    scale = np.maximum(np.abs(base).max(axis=0), 1e-300)
    kept = np.ones(len(free), dtype=bool)
    numbers = np.zeros(3)
    for _ in range(3):
        numbers = np.linalg.lstsq(base[kept] / scale, gained[kept], rcond=None)[0]
        rest = gained - base / scale @ numbers
        usual = 1.4826 * float(np.median(np.abs(rest[kept])))
        kept = np.abs(rest) <= TRIMMED * usual + 1e-12 * float(np.abs(gained).max())
    spread = float(np.std(rest[kept])) * np.sqrt(np.diag(np.linalg.pinv((base[kept] / scale).T @ (base[kept] / scale))))
    values, sigmas = numbers / scale, spread / scale
    return Flights((float(values[0]), float(sigmas[0])), (float(values[1]), float(sigmas[1])))


def _amid(place: Array, low: float, high: float) -> Array:
    """Return samples well within a gap together with both neighbours."""
    amid = (place > low + AMID * (high - low)) & (place < high - AMID * (high - low))
    return np.flatnonzero(amid[:-2] & amid[1:-1] & amid[2:]) + 1


def beyond(recording: Recording, scenario: Scenario) -> float:
    """Return how far the loose gear goes beyond its flanks [m], in one sample of a thousand."""
    if "backlash_m" in recording.meta:
        place, width = recording.signals["displacement_m"], float(recording.meta["backlash_m"])
    else:
        rig = scenario.rig()
        place, width = stated_displacement(recording, scenario), rig.backlash
        place = place - rig.base_radius_loose * offset_of(recording, scenario)
    return max(float(np.quantile(np.maximum(-place, place - width), 0.999)), 0.0)


def offset_of(recording: Recording, scenario: Scenario) -> float:
    """Return the constant offset of the loose gear's angle, as of an encoder without a datum [rad], 0 without.

    Gears that miss impacts move over more than the backlash; a datum displaces both ends equally, and compliant teeth
    yield by less than several backlashes.
    """
    rig, ends = scenario.rig(), np.quantile(stated_displacement(recording, scenario), (0.001, 0.999))
    way = max(-float(ends[0]), float(ends[1]) - rig.backlash)
    if way < GONE * rig.backlash or float(np.ptp(ends)) - rig.backlash > 0.5 * way:
        return 0.0
    return 0.5 * (float(ends.sum()) - rig.backlash) / rig.base_radius_loose


def impacts_of(recording: Recording) -> Impacts:
    """Return the impacts of a segmented recording."""
    table = recording.impacts
    none = np.zeros(len(table["time_s"]))
    lasts = table.get("duration_max_s", none) - 2.0 * 1.645 * np.nan_to_num(table.get("duration_sigma_s", none))
    lasts = np.maximum(np.where(np.isfinite(lasts), lasts, 0.0), 0.0)
    return Impacts(
        table["time_s"], table["flank"], np.abs(table["velocity_m_s"]), table["rebound_m_s"], np.nan_to_num(lasts)
    )


def restitution(tested: Impacts, known: Impacts) -> dict[str, tuple[float, float, float]]:
    """Return by flank the coefficient of restitution, that of the reference at the same speeds, and its deviation."""
    found = {}
    for code, name in enumerate(FLANKS):
        own, other = (np.flatnonzero((one.flank == code) & np.isfinite(one.ratio)) for one in (tested, known))
        if len(own) < 3 or len(other) < 3:
            continue
        expected = _over_speed(known.speed[other], known.ratio[other], tested.speed[own])
        apart = tested.ratio[own] / expected - 1.0
        shift = float(np.median(apart))
        spread = 1.4826 * float(np.median(np.abs(apart - shift)))
        level = float(np.median(expected))
        found[name] = (level * (1.0 + shift), level, 1.2533 * spread * level / np.sqrt(len(own)))
    return found


def missing(tested: Recording, own: Impacts, known: Impacts, scenario: Scenario) -> int:
    """Return how many impacts are followed by contact where a rebound would be seen."""
    rig, time, place = scenario.rig(), tested.time, tested.signals["displacement_m"]
    backlash = float(tested.meta.get("backlash_m") or rig.backlash)
    pushed = np.gradient(np.gradient(tested.signals["theta_drive_rad"], time), time)
    pull = -rig.base_radius_loose * rig.drag_torque / rig.inertia - rig.base_radius_drive * pushed
    step, count = float(np.median(np.diff(time))), 0
    for k in np.flatnonzero(~np.isfinite(own.ratio)):
        code = int(own.flank[k])
        others = np.flatnonzero((known.flank == code) & np.isfinite(known.ratio))
        if not len(others):
            continue
        speed = float(own.speed[k] * _over_speed(known.speed[others], known.ratio[others], own.speed[k : k + 1])[0])
        back = -float(np.interp(own.time[k], time, pull)) * (1.0 if code == 0 else -1.0)
        if back <= 0.0 or (lasts := 2.0 * speed / back) < SEEN * step:
            continue
        rows = slice(*np.searchsorted(time, [own.time[k] + step, own.time[k] + lasts]).tolist())
        gap = place[rows] if code == 0 else backlash - place[rows]
        height = 0.5 * speed**2 / back
        count += bool(len(gap) and height > LOW * backlash and float(gap.max()) < FLAT * height)
    return count


def passed(found: Impacts) -> float:
    """Return the way that gears go beyond a flank at an impact that lasts [m], that of the upper quartile."""
    hard = np.isfinite(found.ratio) & (found.speed > HARD * found.speed.max(initial=0.0))
    return float(np.quantile((found.lasts * found.speed)[hard], 0.75)) if hard.any() else 0.0


def _over_speed(speed: Array, ratio: Array, at: Array) -> Array:
    """Return a straight line through ratios over speed, robust against single ones, at other speeds."""
    middle = float(np.median(speed))
    base = np.stack([np.ones(len(speed)), speed - middle], axis=1)
    weight = np.ones(len(speed))
    line = np.array([float(np.median(ratio)), 0.0])
    for _ in range(5):
        rest = np.abs(ratio - base @ line)
        weight = 1.0 / np.maximum(rest, 1e-6 + float(np.median(rest)))
        line = np.linalg.lstsq(base * weight[:, None] ** 0.5, ratio * weight**0.5, rcond=None)[0]
    return np.maximum(line[0] + line[1] * (np.clip(at, speed.min(), speed.max()) - middle), 1e-3)


@dataclass(frozen=True)
class Finding:
    """One number of one channel."""

    channel: str  # ``drive``, ``flight``, ``contact`` or ``impact``, as in a diagnosis
    quantity: str  # what it is
    unit: str  # of both numbers
    model: float | None  # of the user's model; ``None`` where its motion does not show it
    reference: float | None  # of the rigid model
    difference: float | None  # relative to the reference, or absolute where that is 0
    tolerance: float  # of the difference
    deviates: bool  # whether the difference is larger


@dataclass(frozen=True, eq=False, repr=False)
class ModelVerdict(Result):
    """The verdict on a user's own model.

    Args:
        verdict: ``"equal"``, ``"different"``, or ``"undecided"`` where the motion shows too little.
        causes: what differs, the one that explains most first: ``drive``, ``time``, ``sign``, ``flanks``, ``step``,
            ``bounces``, ``restitution``, ``drag``, ``backlash``.
        sentence: both in words.
        findings: the numbers of every channel.
        tested: recording of the user's model.
        reference: recording of the rigid model.
    """

    verdict: str
    causes: tuple[str, ...]
    sentence: str
    findings: tuple[Finding, ...]
    tested: Recording = field(repr=False)
    reference: Recording = field(repr=False)

    def __repr__(self) -> str:
        return f"ModelVerdict({self.sentence})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        return notebook.table(f"Model: {self.sentence}", rows_of(self.findings))

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        numbers = [asdict(one) for one in self.findings]
        return {"verdict": self.verdict, "causes": [*self.causes], "sentence": self.sentence, "findings": numbers}


def validate_model(recording: Recording, scenario: Scenario | str | Path) -> ModelVerdict:
    """Compare a user's own lumped model with the rigid model, channel by channel, and name what differs.

    Single flights and impacts are compared, not the whole motion: chaotic motions that part are no difference.

    Args:
        recording: with both angles over even times from 0 s on, of :meth:`gears3d.Recording.from_angles` or
            :meth:`gears3d.Recording.from_displacement`.
        scenario: that the model is meant to simulate, or its file or name.

    Returns:
        The verdict.

    Raises:
        InputError: the recording cannot be segmented, or the rigid model cannot run the scenario.
    """
    scenario = scenario if isinstance(scenario, Scenario) else load(scenario)
    time, drive, loose = (recording.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    tested = recording if recording.meta.get("model") == OWN else from_angles(time, drive, loose, scenario)
    made = reference(scenario, time)
    known = from_angles(made.time, made.signals["theta_drive_rad"], made.signals["theta_loose_rad"], scenario)
    findings = [_drive(time, drive, scenario)]
    findings += _flights(flights_of(tested, scenario), flights_of(known, scenario))
    if "unexplained" in tested.meta:
        findings.append(_beyond(tested, scenario))
    shifted, backlash, explained = _shifted(time, drive, scenario), scenario.rig().backlash, False
    causes = _causes(findings, shifted, backlash)
    if not {*causes} & SPOILING:
        own, other = explained_part(tested, scenario), explained_part(known, scenario)
        explained = not {"unexplained"} & {*own.meta, *other.meta}
        if explained:
            findings = [one for one in findings if one.quantity != BEYOND_FLANKS]
            findings += [_backlash(own, other), *_impacts(own, impacts_of(own), impacts_of(other), scenario)]
            causes = _causes(findings, shifted, backlash)
    shown = any(one.model is not None and one.reference for one in findings)
    verdict = "different" if causes else "equal" if shown and explained else "undecided"
    sentence = _sentence(verdict, causes, findings, tested)
    if "unexplained" in tested.meta and (offset := offset_of(tested, scenario)):
        sentence += f"; the loose gear's angle has a constant offset of {offset:.3g} rad, which is left out"
    return ModelVerdict(verdict, tuple(causes), sentence, tuple(findings), tested, known)


def _drive(time: np.ndarray, drive: np.ndarray, scenario: Scenario) -> Finding:
    """Return the largest deviation of the drive's angle from the stated motion, over its fluctuation."""
    stated = drive_angle(scenario, time)
    rest = drive - stated - (drive[0] - stated[0])
    moves = stated - np.polyval(np.polyfit(time, stated, 1), time)
    size = float(np.ptp(moves)) or float(np.ptp(stated)) or 1.0
    apart = float(np.abs(rest).max()) / size
    return Finding("drive", "drive angle, deviation over fluctuation", "", apart, 0.0, apart, BUDGET, apart > BUDGET)


def _shifted(time: np.ndarray, drive: np.ndarray, scenario: Scenario) -> bool:
    """Return whether a shift in time explains the deviation of the drive's motion."""
    stated = drive_angle(scenario, time)
    rest = drive - stated
    base = np.stack([np.ones(len(time)), np.gradient(stated, time)], axis=1)
    numbers = np.linalg.lstsq(base, rest, rcond=None)[0]
    left = rest - base @ numbers
    rest = rest - rest.mean()
    return float(left @ left) < (1.0 - MOVED) ** 2 * float(rest @ rest)


def _relative(channel: str, quantity: str, unit: str, model: float, known: float, sigma: float = 0.0) -> Finding:
    apart = (model - known) / abs(known) if known else model - known
    tolerance = BUDGET + CERTAIN * sigma / (abs(known) or 1.0)
    return Finding(channel, quantity, unit, model, known, apart, tolerance, bool(abs(apart) > tolerance))


def _flights(found: Flights | None, known: Flights | None) -> list[Finding]:
    if found is None or known is None:
        one = None if found is None else found.deceleration[0]
        other = None if known is None else known.deceleration[0]
        lost = (found is None) != (known is None)
        return [Finding("flight", "deceleration in free flight", "rad/s^2", one, other, None, BUDGET, lost)]
    sigma = float(np.hypot(found.deceleration[1], known.deceleration[1]))
    apart = found.carried[0] - known.carried[0]
    tolerance = CARRIED + CERTAIN * float(np.hypot(found.carried[1], known.carried[1]))
    return [
        _relative(
            "flight", "deceleration in free flight", "rad/s^2", found.deceleration[0], known.deceleration[0], sigma
        ),
        Finding(
            "flight", "drive acceleration carried over in flight", "", found.carried[0], known.carried[0], apart,
            tolerance, bool(abs(apart) > tolerance),
        ),
    ]  # fmt: skip


def _backlash(tested: Recording, known: Recording) -> Finding:
    one, other = tested.meta.get("backlash_m"), known.meta.get("backlash_m")
    if one is None or other is None:
        return Finding("contact", "backlash", "m", one, other, None, BUDGET, (one is None) != (other is None))
    return _relative("contact", "backlash", "m", one, other)


def _impacts(tested: Recording, own: Impacts, known: Impacts, scenario: Scenario) -> list[Finding]:
    found, backlash = [], scenario.rig().backlash
    for flank, (value, expected, sigma) in restitution(own, known).items():
        found.append(_relative("impact", f"restitution, {flank} flank", "", value, expected, sigma))
    count = missing(tested, own, known, scenario)
    limit = max(MISSING * len(own.speed), SOME)
    found.append(
        Finding(
            "impact", "impacts without their rebound", "", float(max(count, 0)), 0.0, float(count), limit, count > limit
        )
    )
    way = max(passed(own), beyond(tested, scenario))
    found.append(
        Finding("impact", BEYOND_FLANKS, "m", way, passed(known), way, BEYOND * backlash,
                way > BEYOND * backlash)
    )  # fmt: skip
    return found


def _beyond(tested: Recording, scenario: Scenario) -> Finding:
    """Return how far the gear of a motion that is not explained goes beyond its flanks."""
    way, backlash = beyond(tested, scenario), scenario.rig().backlash
    return Finding("contact", BEYOND_FLANKS, "m", way, 0.0, way, ASTRAY * backlash, way > ASTRAY * backlash)


def _causes(findings: Sequence[Finding], shifted: bool, backlash: float) -> list[str]:
    """Return what differs; a cause that spoils the measurement of the others stands alone."""
    off = {one.quantity: one for one in findings if one.deviates}
    if "drive angle, deviation over fluctuation" in off:
        return ["time" if shifted else "drive"]
    slowing = off.get("deceleration in free flight")
    turned = slowing is not None and slowing.difference is not None and slowing.difference < -1.0
    if turned or "drive acceleration carried over in flight" in off:
        return ["sign"]
    if BEYOND_FLANKS in off:
        return ["step" if (off[BEYOND_FLANKS].model or 0.0) < GONE * backlash else "flanks"]
    if "impacts without their rebound" in off:
        return ["bounces"]
    names = {"deceleration in free flight": "drag", "backlash": "backlash"}
    named = sorted(off.values(), key=lambda one: -abs(one.difference or np.inf))
    return [*dict.fromkeys(names.get(one.quantity, "restitution") for one in named)]


def _sentence(verdict: str, causes: Sequence[str], findings: Sequence[Finding], tested: Recording) -> str:
    if verdict == "undecided":
        if "unexplained" in tested.meta:
            return f"undecided: no impacts are found, as the loose gear {tested.meta['unexplained']}"
        return "undecided: the motion has no free flight and no impact"
    if verdict == "equal":
        hidden = [one.quantity for one in findings if one.model is None]
        more = f"; not shown by this motion: {', '.join(hidden)}" if hidden else ""
        return f"equal to the rigid model within the error budget of the engine ({100.0 * BUDGET:g} %){more}"
    by = {one.quantity: one for one in findings if one.deviates}
    return "different: " + "; ".join(_cause(cause, by, tested) for cause in causes)


def _cause(cause: str, by: dict[str, Finding], tested: Recording) -> str:
    if cause in ("drive", "time"):
        apart = 100.0 * (by["drive angle, deviation over fluctuation"].difference or 0.0)
        what = "is shifted in time" if cause == "time" else "is not the stated one"
        return f"the motion of the drive {what} (by {apart:.3g} % of its fluctuation)"
    if cause == "sign":
        carried = by.get("drive acceleration carried over in flight")
        slowing = by.get("deceleration in free flight")
        if carried is None:
            return "sign error: the drag accelerates the loose gear"
        if slowing is not None and (slowing.difference or 0.0) < -1.0:
            return "sign error: the displacement has the opposite sign"
        return (
            "sign error or missing term: in free flight the loose gear takes over "
            f"{carried.model or 0.0:.3g} times the acceleration of the drive, which should be 0"
        )
    if cause == "flanks":
        way = 1e6 * (by[BEYOND_FLANKS].model or 0.0)
        return f"impacts are missed, or the rebound has the wrong sign: gears go {way:.3g} µm beyond a flank"
    if cause == "step":
        way = by[BEYOND_FLANKS].model or 0.0
        return f"time step too coarse, or compliant flanks: gears go {1e6 * way:.3g} µm beyond a flank at impacts"
    if cause == "bounces":
        return f"bounces are missing: {by['impacts without their rebound'].model:.0f} impacts have no rebound"
    names = {"drag": "deceleration in free flight", "backlash": "backlash"}
    shown = [one for name, one in by.items() if name == names.get(cause, "") or name.startswith(f"{cause},")]
    sizes = dict.fromkeys(
        "not shown" if one.difference is None else f"{100.0 * one.difference:+.3g} %" for one in shown
    )
    return f"{cause} {', '.join(sizes)}"


def rows_of(findings: Sequence[Finding]) -> list[tuple[str, str]]:
    """Return findings as text, (name, value)."""
    rows = []
    for one in findings:
        if one.model is None or one.reference is None:
            rows.append(
                (f"{one.channel}: {one.quantity}", "not shown by this motion" if not one.deviates else "DEVIATES")
            )
            continue
        scale, unit = (1e6, "µm") if one.unit == "m" else (1.0, one.unit)
        relative = one.difference is not None and abs(one.model - one.reference) != abs(one.difference)
        apart = f"{100.0 * (one.difference or 0.0):+.3g} %" if relative else ""
        word = "DEVIATES" if one.deviates else "equal"
        numbers = (
            f"{scale * one.model:.5g} {unit}".strip() + f", rigid model {scale * one.reference:.5g} {unit}".rstrip()
        )
        rows.append((f"{one.channel}: {one.quantity}", ", ".join(part for part in (numbers, apart, word) if part)))
    return rows

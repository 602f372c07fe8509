"""What an identification makes of dirty coast-downs, for ``tools/bench_identify dirty`` and ``halves``."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from gears3d.errors import GearsError
from gears3d.identify import Identified, identify_rundown
from tests.identify.dirty_coastdowns import CATALOGUE, Case, case

SPEEDS = (0.25, 0.5, 0.75)
"""Parts of the speed range of a result at which its torque is compared."""
GROSS = 3.0
"""Widths of the interval from which on an error without a warning is a gross one."""
DISAGREE = ("residual",)
"""What the first warning of a law that does not fit contains."""


def answered(one: Case, only: slice | None = None) -> Identified | str:
    """Return the law of a written record, or why there is none; a crash is an answer of its own."""
    with tempfile.TemporaryDirectory() as folder:
        chart = one.write(Path(folder), only)
        try:
            return identify_rundown([chart], one.inertia)
        except GearsError as error:
            return str(error).replace(folder, "")
        except Exception as error:  # a crash is to be counted
            return f"CRASH {type(error).__name__}: {error}"


def torque_at(found: Identified, speed: float) -> tuple[float, float, float]:
    """Return torque and interval of a result at a speed, or at the end of its range where the speed lies beyond."""
    from scipy.interpolate import CubicSpline  # straight lines would miss a curve by more than fine intervals

    curves = found.curves
    at = np.clip(speed, curves["speed_rad_s"][0], curves["speed_rad_s"][-1])
    return tuple(
        float(CubicSpline(curves["speed_rad_s"], curves[key])(at)) for key in ("torque_N_m", "low_N_m", "high_N_m")
    )  # type: ignore[return-value]


def errors_at(one: Case, found: Identified, speed: float) -> tuple[float, float]:
    """Return the interval of a torque's error over the true one, at the speed or at the end of the result's range."""
    low, high = found.curves["speed_rad_s"][[0, -1]]
    at = float(np.clip(speed, low, high))
    truth = one.torque(at)
    assert truth is not None
    _, least, most = torque_at(found, at)
    return least / truth - 1.0, most / truth - 1.0


def judged(one: Case, found: Identified) -> dict[str, Any]:
    """Return which torques and parameters lie within their intervals, and whether the answer is grossly wrong."""
    low, high = found.goodness["speed_rad_s"]
    points, errors = [], []
    for part in SPEEDS:
        truth = one.torque(low + part * (high - low))
        if truth is None:
            continue
        value, least, most = torque_at(found, low + part * (high - low))
        points.append(least <= truth <= most)
        errors.append((value - truth) / max(most - least, 1e-300))
    right = found.law == one.law and one.law in CATALOGUE
    numbers = [
        found.parameters[name].low <= truth <= found.parameters[name].high
        for name, truth in (one.parameters.items() if right else ())
    ]
    warned = bool(found.warnings) and any(word in found.warnings[0] for word in DISAGREE)
    worst = max((abs(e) for e in errors), default=np.inf)
    widths = [torque_at(found, low + 0.5 * (high - low))]
    return {
        "points": points, "numbers": numbers, "warned": warned, "gross": worst > GROSS and not warned,
        "worst": worst, "width": (widths[0][2] - widths[0][1]) / max(abs(widths[0][0]), 1e-300),
    }  # fmt: skip


def share(hits: list[bool]) -> str:
    """Return a share with its 95 % interval by Clopper and Pearson."""
    if not hits:
        return "none"
    reach = binomtest(sum(hits), len(hits)).proportion_ci(0.95)
    return f"{sum(hits)}/{len(hits)} = {np.mean(hits):.1%} ({reach.low:.1%} to {reach.high:.1%})"


def dirty(seeds: range, say: Callable[[str], object], verbose: bool = False) -> bool:
    """Print how dirty coast-downs come out; true when a bound is missed."""
    rows = []
    for seed in seeds:
        one = case(seed)
        found = answered(one)
        judge = None if isinstance(found, str) else judged(one, found)
        rows.append((one, found, judge))
        if verbose and (judge is None or not all(judge["points"]) or not all(judge["numbers"])):
            what = found if isinstance(found, str) else f"{found.law} {judge} {found.warnings[:1]}"
            say(f"{seed} {one.law} {one.sensor} {one.dirt} {what[:300]}")
    answers = [(one, found, judge) for one, found, judge in rows if judge is not None]
    refused = [judge is None for _, _, judge in rows]
    cases = [all(judge["points"]) for _, _, judge in answers]
    middle = [judge["points"][min(1, len(judge["points"]) - 1)] for _, _, judge in answers if judge["points"]]
    points = [hit for _, _, judge in answers for hit in judge["points"]]
    numbers = [hit for _, _, judge in answers for hit in judge["numbers"]]
    gross = [judge["gross"] for _, _, judge in answers]
    say(f"{len(rows)} coast-downs, seeds from {seeds.start}")
    say(f"accepted:                          {share([not one for one in refused])}")
    say(f"refused:                           {share(refused)}")
    say(f"crashed:                           {sum(isinstance(f, str) and f.startswith('CRASH') for _, f, _ in rows)}")
    say(f"torque at half speed within:       {share(middle)}")
    say(f"torques at all three within:       {share(cases)}")
    say(f"single torques within:             {share(points)}")
    say(f"parameters of the true law within: {share(numbers)}")
    say(f"gross errors without a warning:    {share(gross)}")
    say(f"first line warns of the residual:  {share([judge['warned'] for _, _, judge in answers])}")
    width = np.median([judge["width"] for *_, judge in answers] or [0])
    say(f"median width of the interval:      {width:.3g} of the torque")
    say("\n| kind | records | refused | half-speed torque within | all three within | gross | warned |")
    say("|---|---|---|---|---|---|---|")
    kinds: dict[str, list[Any]] = defaultdict(list)
    for row in rows:
        one = row[0]
        for name in (f"law {one.law}", f"sensor {one.sensor}", *(f"dirt {d}" for d in one.dirt or ("none",))):
            kinds[name].append(row)
    for name in sorted(kinds):
        good = [judge for *_, judge in kinds[name] if judge is not None]
        mid = share([j["points"][min(1, len(j["points"]) - 1)] for j in good if j["points"]])
        cells = (name, len(kinds[name]), len(kinds[name]) - len(good), mid, sum(all(j["points"]) for j in good),
                 sum(j["gross"] for j in good), sum(j["warned"] for j in good))  # fmt: skip
        say("| " + " | ".join(map(str, cells)) + " |")
    reasons: dict[str, int] = defaultdict(int)
    for _, found, _ in rows:
        if isinstance(found, str):
            reasons[found[:110]] += 1
    say("\n" + "\n".join(f"{count} x {why}" for why, count in sorted(reasons.items(), key=lambda r: -r[1])[:15]))
    return bool(np.mean(refused) > 0.1 or np.mean(middle or [0]) < 0.9 or any(gross))


def halves(seeds: range, say: Callable[[str], object], verbose: bool = False) -> bool:
    """Print whether intervals from both halves of a coast-down overlap; true when a bound is missed.

    The halves meet at one speed, and each states its torque for the speeds that it observed only: where its last or
    first reading lies some per cent away from where they meet (few counts), it states nothing there, and a spline
    carried on to there would be this score's statement and not that of the result. So each interval is taken at the
    observed speed that is nearest, over the true torque at that speed: intervals of the relative error are compared. It
    is the hardest place, as a law that does not hold deviates most, and a record shows the torque worst, at the ends.
    How far apart the halves are is printed.
    """
    overlap, same, missing, outside, apart = [], [], 0, [], []
    for seed in seeds:
        one = case(seed, clean=True, laws=("stribeck", "drift", "quadratic", "cogging", "coulomb+viscous"))
        if one.law == "coulomb+viscous":  # the catalogue holds this law: the misfit is the noise of the sensor
            one = _flickering(seed)
        coast = one.coasts[0]
        rows = len(one.time)
        middle = int(np.searchsorted(one.time, coast.start + 0.5 * (coast.end - coast.start)))
        speed = float(coast.speed(one.time[middle : middle + 1])[0])
        both = [answered(one, slice(0, middle)), answered(one, slice(middle, rows))]
        if any(isinstance(found, str) for found in both):
            missing += 1
            if verbose:
                say(f"{seed} {one.law} {one.sensor} {[f for f in both if isinstance(f, str)]}")
            continue
        early, late = both
        (low, high), (least, most) = (errors_at(one, found, speed) for found in both)  # type: ignore[arg-type]
        overlap.append(low <= most and least <= high)
        outside += [low <= 0.0 <= high, least <= 0.0 <= most]
        apart.append(abs(early.curves["speed_rad_s"][0] - late.curves["speed_rad_s"][-1]) / speed)  # type: ignore[union-attr]
        if early.law == late.law:  # type: ignore[union-attr]
            for name, p in early.parameters.items():  # type: ignore[union-attr]
                q = late.parameters[name]  # type: ignore[union-attr]
                same.append(p.low <= q.high and q.low <= p.high)
        if verbose and not overlap[-1]:
            laws = f"{early.law} and {late.law}"  # type: ignore[union-attr]
            errors = f"{low:.3g} to {high:.3g} and {least:.3g} to {most:.3g}"
            say(f"{seed} {one.law} {one.sensor} at {speed:.4g} rad/s, {laws}: errors of {errors}, over the true torque")
    say(f"{len(seeds)} coast-downs cut in two, seeds from {seeds.start}; {missing} with a half without an answer")
    say(f"speeds between the halves:             up to {max(apart or [0]):.2%} of where they meet")
    say(f"torques where the halves meet overlap: {share(overlap)}")
    say(f"parameters of the same law overlap:    {share(same)}")
    say(f"torques where they meet within:        {share(outside)}")
    return bool(np.mean(overlap or [0]) < 0.9)


def _flickering(seed: int) -> Case:
    """Return a record with 1/f noise only."""
    for more in range(1000):
        one = case(1_000_000 + 1000 * seed + more, laws=("coulomb+viscous",))
        if one.dirt == ("flicker",):
            return one
    raise AssertionError

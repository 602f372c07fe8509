"""Do angles and speeds agree with the teeth: units, signs, interchanged channels, wrong ratios.

Gears in mesh are never apart by more than the backlash, so over a way along the line of action much longer than it
the ratio of both angles is that of the base radii, with or without rattle.

Where it is not, the power of orders decides which encoder has a wrong count per revolution.
The ratio of both angles shows by which factor one count deviates, not which one. Run-out of a gear and eccentricity of
an encoder repeat once per true revolution of their shaft: at order 1 of an angle that is right, at another order of one
that is not. Where the record has enough revolutions to separate these orders, their power decides.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from gears3d.measured.checks.columns import speed_ratio
from gears3d.measured.checks.counts import otherwise
from gears3d.measured.checks.view import MESH, Declared, Finding, View
from gears3d.signals import robust_deviation

# Difference of chi-square that decides: e^-9 between two hypotheses, with a margin for noise that is not white.
DECIDED = 18.0
# Revolutions below which the orders around a line show its noise poorly; set by records of known cause.
SHORT = 6.0
# Part of a resolvable order below which a change of a line imitates another order; set likewise.
UNRESOLVED = 0.3
# Further factor, at gears that turn equally fast, for a cause that has two lines where others have one of these.
NESTED = 5.0
# Difference of the speeds below which gears turn equally fast, beyond any wrong count that is tested.
EQUAL = 0.1
# Windows per revolution of the faster shaft: orders up to 4 stay whole in them.
FINE = 20
# Blocks per window whose mean is free of most noise, and short against an impact.
MICRO = 16
# Windows at most, which bounds the time.
MOST = 30_000
# Windows below which no line can be compared with the orders around it.
FEW = 60
# Orders on which the decision is based.
LINES = (1, 2)
# Patterns per revolution that are removed, as another shaft's revolution may hide in them.
OTHERS = (3, 4)
# Multiples of half the frequency of the drive that are removed: rattle repeats with one or two of its periods.
MULTIPLES = 24
# Distance of the orders that show the noise, in resolvable orders.
BESIDE = np.concatenate([-np.arange(1.5, 10.0), np.arange(1.5, 10.0)])
# Part of the deviation to which the angle between index marks must agree with a right or a wrong count.
MARK = 0.25
CAUSES = (MESH[0], MESH[1], "teeth")
CALLED = {MESH[0]: "the drive encoder is", MESH[1]: "the loose encoder is", "teeth": "wrong teeth are"}
# Width of the band, in declared backlashes, within which the gears may part: the declared one may be wrong.
BANDS = 3.0
# How near a factor must be to that of a mistake.
CLOSE = 0.003
# The same for a mean speed, which the teeth do not constrain.
NEAR = 0.02
# Ratio of the drive's speed to the declared one that does not occur in tests.
FAR = 10.0
# Deviation of the inverse ratio from 1 below which interchanged channels and a wrong count of an encoder cannot be
# distinguished: twice the 5 % by which counts are wrong in practice.
SIMILAR = 0.1
POINTS = 20_000
TURN = 2 * np.pi
FACTORS = {
    "degrees": 360.0 / TURN,
    "revolutions": 1.0 / TURN,
    "gon": 400.0 / TURN,
    "twice the angle": 2.0,
    "four times the angle": 4.0,
    "half the angle": 0.5,
    "25 % of the angle": 0.25,
}


class Verdict(NamedTuple):
    """What is wrong where the ratio of both angles is not that of the teeth.

    Args:
        possible: causes that the record does not exclude: columns, or ``"teeth"``.
        margin: difference of chi-square to the next hypothesis.
        factor: by which the ratio of both angles deviates.
        bound: largest error of the factor that rattle can make.
        revolutions: of the slower shaft.
    """

    possible: tuple[str, ...]
    margin: float
    factor: float
    bound: float
    revolutions: float

    @property
    def cause(self) -> str:
        """The only cause that is possible, empty where there are several."""
        return self.possible[0] if len(self.possible) == 1 else ""


class _Series(NamedTuple):
    """Windows: their time, both angles and some displacement in them, each (n,)."""

    time: np.ndarray
    drive: np.ndarray
    loose: np.ndarray
    place: np.ndarray


def judge(view: View, value: float) -> Verdict | None:
    """Return which hypothesis explains the patterns per revolution, ``None`` with too few rows."""
    if view.declared.radii is None or len(view.time) < 2 * FEW:
        return None
    micro = _micro(view, value)
    if micro is None:
        return None
    factor, left = _refined(micro, abs(value), view.declared.radii[0])
    way = float(np.ptp(micro.drive)) * view.declared.radii[0]
    bound = 1.5 * float(np.ptp(left)) / way  # a step of a bounded displacement inclines a line by no more
    turns = min(float(np.ptp(angle)) for angle in (micro.drive, micro.loose)) / (2.0 * np.pi)
    # the displacement would else modulate the lines of the loose gear, and a hypothesis explain it by itself
    micro = micro._replace(place=left, loose=micro.loose - left / view.declared.radii[1])
    edges = _edges(micro)
    marked = _marked(view, factor)
    if len(marked) == 1 or len(edges) < FEW or turns < 1.0:
        return Verdict(marked, np.inf if len(marked) == 1 else 0.0, factor, bound, turns)
    orders = _orders(factor)
    hidden = _hidden(view, micro, edges, orders)
    explained = (_explained(one, orders, hidden) for one in _reduced(micro, edges))
    noise, rest = min(explained, key=lambda one: one[0])
    rest = {cause: rest[cause] for cause in marked}
    first, second = sorted(rest.values())[:2]
    scale = 1.0 / noise if 0.0 < noise < np.inf else 0.0
    apart = turns * abs(factor - 1.0)
    needed = DECIDED * (1.0 + (SHORT / turns) ** 2) * max(UNRESOLVED / apart, 1.0)
    best = min(rest, key=rest.__getitem__)
    limit = needed
    speeds = float(np.ptp(micro.loose) / np.ptp(micro.drive))
    own, other = orders[best]
    if abs(speeds - 1.0) < max(EQUAL, 1.0 / turns) and abs(own - other * speeds) > 0.5 * abs(factor - 1.0):
        limit *= NESTED if apart > 1.0 else np.inf
    possible = tuple(cause for cause in marked if cause == best or (rest[cause] - first) * scale <= limit)
    return Verdict(possible, (second - first) * scale, factor, bound, turns)


def scale_of(verdict: Verdict, name: str) -> tuple[float, float]:
    """Return by what an angle must be multiplied if its count is wrong, and the largest error of that."""
    if name == MESH[0]:
        return verdict.factor, verdict.bound
    return 1.0 / verdict.factor, verdict.bound / verdict.factor**2


def reason(verdict: Verdict) -> str:
    """Return the reason for a cause as text, or the data that would decide."""
    seen = f"{verdict.revolutions:.3g} revolutions"
    if not verdict.cause:
        enough = 1.0 / abs(verdict.factor - 1.0)
        told = f"{seen} do not decide which encoder is wrong, or whether the teeth are: "
        told += (
            f"it takes about {enough:.2g}"
            if verdict.revolutions < enough
            else "patterns that repeat once per revolution are too weak, record the index mark of both encoders"
        )
        out = [CALLED[cause] for cause in CAUSES if cause not in verdict.possible]
        return told + (f"; {out[0]} excluded" if out else "")
    if np.isinf(verdict.margin):
        what = (
            f"count of the {verdict.cause.split('_')[1]} encoder is" if verdict.cause in MESH else "tooth numbers are"
        )
        return f"the angles between index marks show that the {what} wrong"
    by = f"(chi-square smaller by {verdict.margin:.3g}, {seen})"
    if verdict.cause == "teeth":
        return f"patterns of both gears repeat at order 1 of their angles {by}: the tooth numbers are wrong"
    gear = verdict.cause.split("_")[1]
    times = scale_of(verdict, verdict.cause)[0]
    told = f"the {gear} encoder gives {1.0 / times:.6g} revolutions per revolution: "
    return f"{told}its pattern repeats at order {times:.6g} of the angle {by}"


def remedy_for(view: View, verdict: Verdict, name: str) -> str:
    """Return the corrected count of an encoder with its interval, or the factor where no count is declared."""
    times, error = scale_of(verdict, name)
    gear, counts = name.split("_")[1], view.declared.counts.get(name)
    if counts is None:
        low, high = times - error, times + error
        return f"multiply the {gear} angle by {times:.7g} ({low:.7g} to {high:.7g})"
    true, spread = counts / times, counts * error / times**2
    shown = f"{true:.{max(0, min(4, 1 - int(np.floor(np.log10(max(spread, 1e-4))))))}f}"
    low, high = (f"{true + side * spread:.{max(len(shown.partition('.')[2]), 0)}f}" for side in (-1.0, 1.0))
    return f"[{gear}] counts_per_revolution = {shown} instead of {counts:.0f} ({low} to {high})"


def _marked(view: View, factor: float) -> tuple[str, ...]:
    """Return the causes that index marks do not exclude: the angle between them is a true revolution."""
    left = list(CAUSES)
    for name, scale in ((MESH[0], 1.0 / factor), (MESH[1], factor)):
        seen = view.declared.marks.get(name)
        if seen is None:
            continue
        if abs(seen / scale - 1.0) < MARK * abs(factor - 1.0):
            left = [cause for cause in left if cause == name]
        elif abs(seen - 1.0) < MARK * abs(factor - 1.0):
            left = [cause for cause in left if cause != name]
    return tuple(left) or CAUSES


def _orders(factor: float) -> dict[str, tuple[float, float]]:
    """Return the orders of one true revolution of drive and loose gear in the declared angles, by hypothesis."""
    return {MESH[0]: (factor, 1.0), MESH[1]: (1.0, 1.0 / factor), "teeth": (1.0, 1.0)}


def _micro(view: View, value: float) -> _Series | None:
    """Return means over few rows, with the displacement that the ratio leaves [m]."""
    radii = view.declared.radii or (1.0, 1.0)
    turns = max(float(np.ptp(view.angles[name])) for name in MESH) / (2.0 * np.pi)
    rows = len(view.time)
    windows = min(turns * FINE, MOST)
    size = max(int(rows / max(windows * MICRO, 1.0)), 1)
    count = rows // size

    def mean(values: np.ndarray) -> np.ndarray:
        return (values[: count * size] - values[0]).reshape(count, size).mean(axis=1)

    if count < FEW:
        return None
    time, drive, loose = (mean(values) for values in (view.time, *(view.angles[name] for name in MESH)))
    loose = np.sign(value) * loose
    return _Series(time, drive, loose, radii[1] * loose - abs(value) * radii[0] * drive)


def _refined(micro: _Series, factor: float, radius: float) -> tuple[float, np.ndarray]:
    """Return the factor with the slope that the displacement has left, and the displacement without it."""
    row = micro.drive - micro.drive.mean()
    place = micro.place - micro.place.mean()
    slope = float(row @ place / (row @ row))
    return factor + slope / radius, place - slope * row


def _edges(micro: _Series) -> np.ndarray:
    """Return where windows begin; their lengths differ, so that no faster oscillation imitates a slow one."""
    turns = max(float(np.ptp(angle)) for angle in (micro.drive, micro.loose)) / (2.0 * np.pi)
    count = len(micro.time)
    windows = int(min(turns * FINE, MOST, count))
    if windows < 2:
        return np.zeros(1, int)
    step = count / windows
    random = np.random.default_rng(0)
    begins = np.arange(windows) * step + random.uniform(-0.3, 0.3, windows) * step
    return np.unique(np.clip(begins.astype(int), 0, count - 1))


def _reduced(micro: _Series, edges: np.ndarray) -> list[_Series]:
    """Return windows with the mean, the lower and the upper limit of the displacement."""
    sizes = np.diff(edges, append=len(micro.time))
    time, drive, loose, place = (np.add.reduceat(values, edges) / sizes for values in micro)
    found = [_Series(time, drive, loose, place)]
    if np.median(sizes) >= 4:
        found += [found[0]._replace(place=limit.reduceat(micro.place, edges)) for limit in (np.minimum, np.maximum)]
    return found


def _hidden(view: View, micro: _Series, edges: np.ndarray, orders: dict[str, tuple[float, float]]) -> float | None:
    """Return the frequency of the drive's fluctuation [rad/s], ``None`` where its encoder alone imitates one."""
    lasting = float(micro.time[-1] - micro.time[0])
    row = 2.0 * (micro.time - micro.time[0]) / lasting - 1.0
    base = np.polynomial.legendre.legvander(row, 3)
    left = micro.drive - base @ np.linalg.lstsq(base, micro.drive, rcond=None)[0]
    taper = np.hanning(len(left))
    power = np.abs(np.fft.rfft(left * taper)) * np.arange(len(left) // 2 + 1)
    if len(power) < 8:
        return None
    peak = int(np.argmax(power[3:])) + 3
    phase = micro.time - micro.time[0]

    def lack(bins: float) -> float:
        return -abs(np.exp(-2j * np.pi * bins / lasting * phase) @ (left * taper))

    sought: Any = minimize_scalar(lack, bounds=(peak - 1.0, peak + 1.0), method="bounded", options={"xatol": 1e-4})
    bins = float(sought.x)
    frequency = 2.0 * np.pi * bins / lasting
    amplitude = -lack(bins) * 2.0 / taper.sum()
    speed = abs(float(micro.drive[-1] - micro.drive[0])) / lasting
    if frequency * amplitude > 0.3 * view.declared.fluctuation > 0.0 or speed == 0.0:
        return frequency
    turns = float(np.ptp(micro.drive)) / (2.0 * np.pi)
    near = [times * one[0] for one in orders.values() for times in LINES]
    if all(abs(frequency / speed - one) > 0.7 / turns for one in near):
        return frequency
    table = np.exp(-1j * frequency * phase) * taper
    own, seen = table @ left, table @ micro.place
    radius = (view.declared.radii or (1.0, 1.0))[0]
    return None if abs(seen + radius * own) < 0.2 * radius * abs(own) else frequency


def _explained(
    series: _Series, orders: dict[str, tuple[float, float]], hidden: float | None
) -> tuple[float, dict[str, float]]:
    """Return the noise of a line and the residual sum of squares of each hypothesis."""
    lasting = float(series.time[-1] - series.time[0])
    row = 2.0 * (series.time - series.time[0]) / lasting - 1.0
    angles = (series.drive, series.loose)
    base = [*np.polynomial.legendre.legvander(row, 3).T]
    if hidden is not None:
        fastest = np.pi * len(row) / lasting
        for times in range(1, int(min(MULTIPLES, len(row) / 16.0, fastest / (0.5 * hidden))) + 1):
            base += _wave(0.5 * times * hidden * (series.time - series.time[0]))
        base += [row * one for times in (1, 2) for one in _wave(times * hidden * (series.time - series.time[0]))]
    for angle, own in zip(angles, zip(*orders.values(), strict=True), strict=True):
        base += [one for times in OTHERS for order in set(own) for one in _wave(times * order * angle)]
    place = _clipped(np.array(base).T, series.place)
    rest: dict[str, float] = {}
    tables: dict[str, np.ndarray] = {}
    for cause, own in orders.items():
        lines = [
            one
            for angle, order in zip(angles, own, strict=True)
            for times in LINES
            for one in _wave(times * order * angle)
        ]
        tables[cause] = np.array([*base, *lines]).T
        left = _without(tables[cause], place)
        rest[cause] = float(left @ left)
    table = tables[min(rest, key=rest.__getitem__)]
    return _noise(table, _without(table, place), angles, orders), rest


def _noise(
    table: np.ndarray, left: np.ndarray, angles: tuple[np.ndarray, ...], orders: dict[str, tuple[float, float]]
) -> float:
    """Return the power per degree of freedom of orders around those that decide, where it is largest."""
    found = []
    for angle, own in zip(angles, zip(*orders.values(), strict=True), strict=True):
        turns = float(np.ptp(angle)) / (2.0 * np.pi)
        for times in LINES:
            low, high = times * min(own), times * max(own)
            around = np.where(BESIDE < 0.0, low + BESIDE / turns, high + BESIDE / turns)
            around = around[around > 0.5 / turns]
            waves = np.array([one for order in around for one in _wave(order * angle)]).T
            waves = _without(table, waves)  # a fit has removed their part of the noise, too
            norm = np.einsum("ij,ij->j", waves, waves)
            free = norm > 0.1 * len(angle)
            if free.any():
                found.append(float(np.mean((waves.T @ left)[free] ** 2 / norm[free])))
    return max(found, default=np.inf)


def _wave(phase: np.ndarray) -> list[np.ndarray]:
    return [np.cos(phase), np.sin(phase)]


def _without(table: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the residual of a linear fit of values, (n,) or (n, k); columns that are nearly the same count once."""
    gram = table.T @ table
    return values - table @ (np.linalg.pinv(gram, rcond=1e-9, hermitian=True) @ (table.T @ values))


def _clipped(table: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values with outliers moved to the limit of what the others scatter."""
    left = _without(table, values)
    spread = robust_deviation(left - np.median(left))
    if spread == 0.0:
        return values
    return values - left + np.clip(left, -5.0 * spread, 5.0 * spread)


class Ratio(NamedTuple):
    """Ratio of the travels of loose gear and drive along the line of action.

    Args:
        value: 1 when it is what the teeth say.
        slack: by how much rattle within the band may put it off.
    """

    value: float
    slack: float


def examine_ratio(view: View) -> list[Finding]:
    """Find a ratio of both angles, or a speed of both, that is not what the rig declares."""
    ratio = ratio_of(view)
    if ratio is None:
        return []
    found = _swapped(view, ratio) or _unit(view, ratio)
    if found:
        return found
    found = _sense(view, ratio)
    if abs(abs(ratio.value) - 1.0) <= ratio.slack:
        return found or _both(view)
    return [*found, _wrong(view, ratio)]


def correct_ratio(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Correct a wrong unit or count, invert a sign, or interchange the channels."""
    drive, loose = (columns[name] for name in MESH)
    if findings[0].kind == "swapped":
        return {**columns, MESH[0]: loose, MESH[1]: drive}
    corrected = dict(columns)
    for finding in findings:
        by = -1.0 if finding.kind == "sense" else finding.size
        if finding.kind == "ratio":
            by = 1.0 / finding.parameters["factor"]
        for name in [finding.channel] if finding.channel else MESH:
            corrected[name] = corrected[name] / by
    return corrected


def recounted(declared: Declared, findings: list[Finding]) -> Declared:
    """Return what is declared with the counts of a channel whose wrong count is corrected."""
    counts, marks = dict(declared.counts), dict(declared.marks)
    for finding in findings:
        if finding.kind == "ratio" and finding.channel in counts:
            counts[finding.channel] /= finding.parameters["factor"]
        if finding.kind == "ratio":
            marks.pop(finding.channel, None)  # they were measured with the wrong count
    return replace(declared, counts=counts, marks=marks)


def ratio_of(view: View) -> Ratio | None:
    """Return the ratio, ``None`` when the drive does not turn far enough to determine it."""
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return None
    some = slice(None, None, max(len(view.time) // POINTS, 1))
    drive, loose = (view.angles[name][some] * radius for name, radius in zip(MESH, declared.radii, strict=True))
    way = float(np.ptp(drive))
    own, far = (view.noise[name] * radius for name, radius in zip(MESH, declared.radii, strict=True))
    noise = float(np.hypot(own, far))
    band = BANDS * declared.backlash + 6.0 * noise
    drive = drive - drive.mean()
    if way <= 3.0 * band or float(np.ptp(loose)) <= 3.0 * band / 100.0:
        return None
    loose = loose - loose.mean()
    value = float(drive @ loose / (drive @ drive))
    # a displacement within a range inclines the line by 1.5 times that range over the way at most, which a step does
    range_left = max(float(np.ptp(loose - value * drive)), declared.backlash + 6.0 * noise)
    return Ratio(value, 1.5 * min(band, range_left) / way)


def speed_of(view: View) -> float | None:
    """Return the drive's mean speed over the declared one, ``None`` when that is not declared or not conclusive."""
    mean = view.declared.mean_speed
    if mean is None or abs(mean) <= 0.2 * view.declared.fluctuation or mean == 0.0:
        return None
    angle = view.angles[MESH[0]]
    return float(angle[-1] - angle[0]) / float(view.time[-1] - view.time[0]) / mean


def _swapped(view: View, ratio: Ratio) -> list[Finding]:
    """Find channels whose names changed places: the ratio is that of the teeth upside down."""
    one, other = view.declared.radii or (1.0, 1.0)
    upside = (other / one) ** 2
    speed = speed_of(view)
    if abs(upside - 1.0) < max(2.0 * ratio.slack + CLOSE, SIMILAR) or not _is(ratio, upside):
        return []
    if speed is not None and abs(abs(speed) / (one / other) - 1.0) > 0.2 and abs(abs(speed) - 1.0) < 0.2:
        return []
    told = f"the speed of the loose gear is {ratio.value:.5g} times the value from the teeth, their inverse ratio "
    told += f"({upside:.5g})"
    return [Finding("swapped", "", ratio.value, "1", told + ": the channels are interchanged", "", True, True)]


def _unit(view: View, ratio: Ratio) -> list[Finding]:
    """Find one channel in a unit of its own."""
    counts = {f"counts of {one:.0f}": one / TURN for one in set(view.declared.counts.values())}
    speed = speed_of(view)
    for what, factor in {**FACTORS, **counts}.items():
        for name, expected in ((MESH[1], factor), (MESH[0], 1.0 / factor)):
            if not _is(ratio, expected) or abs(expected - 1.0) < 3.0 * ratio.slack + CLOSE:
                continue
            own = factor if name == MESH[0] else 1.0
            if speed is not None and not 0.6 < abs(speed) / own < 1.6:
                continue
            told = f"the speed of the loose gear is {ratio.value:.6g} times the value from the teeth, "
            told += f"as if {name} were {what}"
            return [Finding("angle-unit", name, factor, "1", told, "or give the unit in record.toml", True, True)]
    return []


def _sense(view: View, ratio: Ratio) -> list[Finding]:
    if ratio.value > 0.0:
        return []
    speed = speed_of(view)
    name = MESH[0] if speed is not None and speed < 0.0 else MESH[1]
    told = f"the gears have opposite signs (speed ratio {ratio.value:.5g} times that of the teeth): each angle must be "
    told += "positive in the direction of rotation of its own gear"
    return [Finding("sense", name, ratio.value, "1", told, "or give the sign in record.toml", True, True)]


def _both(view: View) -> list[Finding]:
    """Find both channels in a wrong unit or sense: their ratio is right, their speed is not."""
    speed = speed_of(view)
    if speed is None:
        return []
    mean = view.declared.mean_speed or 0.0
    counts = {f"counts of {one:.0f}": one / TURN for one in set(view.declared.counts.values())}
    seen = f"mean speed of the drive is {speed * mean:.5g} rad/s, the rig declares {mean:.5g} rad/s"
    aside = "or give the true speed as motion.mean under [condition]"
    for what, factor in {**FACTORS, **counts}.items():
        if "angle" not in what and abs(abs(speed) / factor - 1.0) < NEAR:
            return [Finding("angle-unit", "", factor, "1", f"{seen}: both angles are in {what}", aside, True, True)]
    ratio = speed_ratio(view)
    if ratio is not None and not 1.0 / FAR < ratio < FAR:
        told = f"{seen}: neither the unit of the time nor that of the angles can be right"
        return [Finding("time-unit", "time_s", 1.0 / ratio, "1", told, f"give them in record.toml, {aside}", True)]
    if abs(speed + 1.0) < 0.2:
        told = f"{seen}: both signs are inverted, which exchanges active and reverse flank"
        return [Finding("sense", "", speed, "1", told, aside, False, True)]
    return []


def _wrong(view: View, ratio: Ratio) -> Finding:
    """Return the finding of a ratio that no known mistake explains, and the fault where the record decides."""
    off = abs(ratio.value) - 1.0
    way = float(np.ptp(view.angles[MESH[0]])) * (view.declared.radii or (0.0, 0.0))[0]
    told = (
        f"the speed of the loose gear is {abs(ratio.value):.6g} times the value from the teeth (± {ratio.slack:.2g}): "
    )
    told += f"both gears deviate by {1e3 * abs(off) * way:.4g} mm, the declared backlash is "
    told += f"{1e3 * (view.declared.backlash or 0.0):.3g} mm"
    fits = _fitting(view, ratio)
    if fits:
        told += "; {} teeth would match, {}:{} are declared".format(fits, *(view.declared.teeth or ()))
    told += "".join(f"; {hint}" for name in MESH if (hint := otherwise(view, name)))
    verdict = judge(view, ratio.value)
    if verdict is None:
        remedy = "correct gears.*.teeth or the counts per revolution, or check for continuously lost counts"
        return Finding("ratio", "", off, "1", told, remedy, True)
    told += f"; {reason(verdict)}"
    if verdict.cause in MESH:
        times, error = scale_of(verdict, verdict.cause)
        own = remedy_for(view, verdict, verdict.cause)
        return Finding(
            "ratio", verdict.cause, off, "1", told, own, True, True, parameters={"factor": times, "uncertainty": error}
        )
    teeth = f"correct gears.*.teeth ({fits})" if fits else "correct gears.*.teeth"
    one, other = view.declared.radii or (1.0, 1.0)
    if abs(abs(ratio.value) * (one / other) ** 2 - 1.0) < ratio.slack:
        teeth += ", or exchange the channels"
        told += "; interchanged channels would have this ratio as well"
    if verdict.cause:
        return Finding("ratio", "", off, "1", told, teeth, True)
    ways = [remedy_for(view, verdict, name) if name in MESH else teeth for name in verdict.possible]
    return Finding("ratio", "", off, "1", told, "either " + ", or ".join(ways), True)


def _fitting(view: View, ratio: Ratio) -> str:
    """Return the nearest teeth that have the ratio, as text."""
    teeth = view.declared.teeth
    if teeth is None:
        return ""
    near = [
        (abs(teeth[0] + i) / (teeth[1] + j) / (teeth[0] / teeth[1]), teeth[0] + i, teeth[1] + j)
        for i in range(-3, 4)
        for j in range(-3, 4)
    ]
    near.sort(key=lambda one: abs(one[1] - teeth[0]) + abs(one[2] - teeth[1]))
    fits = [f"{i}:{j}" for value, i, j in near if abs(value / abs(ratio.value) - 1.0) < ratio.slack]
    return ", ".join(fits[:3])


def _is(ratio: Ratio, expected: float) -> bool:
    return abs(abs(ratio.value) / expected - 1.0) < ratio.slack + CLOSE


UNITS = {
    "rpm": 30.0 / np.pi,
    "deg/s": 180.0 / np.pi,
    "revolutions per second": 0.5 / np.pi,
    "revolutions per millisecond": 0.5e-3 / np.pi,
    "thousand rpm": 0.03 / np.pi,
    "rad/min": 60.0,
}
# Units that convert the speed of the rig's scenario, by factor.
HINTS = {
    "the angles are in degrees": 180.0 / np.pi,
    "the angles are in revolutions": 0.5 / np.pi,
    "time is in milliseconds": 1e-3,
    "time is in microseconds": 1e-6,
    "time is in minutes": 60.0,
}
# How near a factor must be to that of a unit for a hint: 1 in 600 of records of any speed from 1e-6 to 100 times.
EXACT = 0.005
PARTNERS = {
    "omega_drive_rad_s": ("theta_drive_rad",),
    "omega_loose_rad_s": ("theta_loose_rad",),
    "omega_rad_s": ("theta_rad", "theta_loose_rad", "theta_drive_rad"),
}
# Stretches whose mean speeds are compared.
BLOCKS = 2000
# Part of the mean square of a speed that the angle's must explain, for its factor to be reported.
ALIKE = 0.9
# Least deviation of a reported factor from 1, and its largest from that of a unit.
OFF = 0.02
# The same where the declared mean speed is the only evidence.
MEANT = 0.05


def examine_speeds(view: View) -> list[Finding]:
    """Find columns of speed in another unit, of another gear or in another sense than their angle."""
    found = []
    for name, partners in PARTNERS.items():
        speed = view.columns.get(name)
        if speed is None or speed.dtype.kind not in "fiu" or speed.shape != view.time.shape or len(speed) < 3:
            continue
        own = next((angle for angle in partners if angle in view.columns), None)
        new = _by_angle(view, name, own) if own else _by_mean(view, name)
        found += [] if new is None else [new]
    return found


def correct_speeds(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Put speeds into rad/s."""
    return columns | {one.channel: columns[one.channel] / one.size for one in findings}


def _by_angle(view: View, name: str, angle: str) -> Finding | None:
    """Find a speed that is not the rate of its angle."""
    edges = np.unique(np.linspace(0, len(view.time) - 1, BLOCKS + 1).astype(np.intp))
    speed, lasts = view.columns[name], np.diff(view.time[edges])
    if not np.isfinite(speed.sum()) or not np.isfinite(view.columns[angle].sum()) or np.any(lasts <= 0.0):
        return None
    rate = np.diff(view.columns[angle][edges]) / lasts
    pairs = pairwise(edges)
    middle = np.array([0.5 * (speed[a:b] + speed[a + 1 : b + 1]).mean() for a, b in pairs])
    square, power = float(rate @ rate), float(middle @ middle)
    if square <= 0.0 or power <= 0.0:
        return None
    factor = float(middle @ rate) / square
    if factor**2 * square < ALIKE * power or abs(factor - 1.0) < OFF:
        return None
    told = f"is {factor:.6g} times the rate of {angle}"
    remedy = "or give the unit in record.toml"
    for what, one in UNITS.items():
        if abs(abs(factor) / one - 1.0) < OFF:
            size = float(np.copysign(one, factor))
            told += f": it is in {what}" + (", with inverted sign" if factor < 0.0 else "")
            return Finding("speed-unit", name, size, "1", told, remedy, False, True)
    if abs(factor + 1.0) < OFF:
        return Finding("speed-unit", name, -1.0, "1", f"{told}: its sign is inverted", remedy, False, True)
    remedy = "check which shaft this speed belongs to: only the angles are used"
    return Finding("speed-unit", name, factor, "1", told, remedy)


def compare_with_usual(view: View) -> list[Finding]:
    """Report a drive whose speed is that of the rig's scenario in another unit, where no speed is stated.

    Records may be of any speed, so nothing is concluded from it.
    """
    usual, name = view.declared.usual_speed, MESH[0]
    lasts = float(view.time[-1] - view.time[0]) if len(view.time) > 1 else 0.0
    if view.declared.mean_speed is not None or not usual or name not in view.angles or not lasts > 0.0:
        return []
    seen = float(view.angles[name][-1] - view.angles[name][0]) / lasts
    for what, factor in HINTS.items():
        if abs(seen / usual / factor - 1.0) < EXACT:
            told = f"the drive turns at {seen:.6g} rad/s, {factor:.4g} times the mean speed of the rig: "
            told += f"if both are meant to be the same, {what}"
            remedy = "nothing to do if the record is of another speed"
            return [Finding("other-speed", name, seen / usual, "1", told, remedy)]
    return []


def _by_mean(view: View, name: str) -> Finding | None:
    """Find a speed that fits the declared mean speed in another unit only."""
    mean, teeth, speed = view.declared.mean_speed, view.declared.teeth, view.columns[name]
    if mean is None or abs(mean) <= 0.2 * view.declared.fluctuation or not np.isfinite(speed.sum()):
        return None
    ratio = 1.0 if "drive" in name or teeth is None else teeth[0] / teeth[1]
    seen = float(np.mean(speed)) if view.declared.meshed else float(speed[np.argmax(np.abs(speed))])
    for what, factor in UNITS.items():
        if abs(abs(seen / (mean * ratio)) / factor - 1.0) < MEANT:
            told = f"is {seen:.6g}, the mean speed of the rig gives {abs(mean * ratio):.6g} rad/s: "
            told += f"its unit is probably {what}"
            remedy = "or give the unit in record.toml, or the true speed as motion.mean under [condition]"
            return Finding("speed-unit", name, factor, "1", told, remedy, not view.declared.meshed, True)
    return None

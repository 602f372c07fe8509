"""Which encoder has a wrong count per revolution, where the ratio of both angles is not that of the teeth.

The ratio of both angles shows by which factor one count deviates, not which one. Run-out of a gear and eccentricity of
an encoder repeat once per true revolution of their shaft: at order 1 of an angle that is right, at another order of one
that is not. Where the record has enough revolutions to separate these orders, their power decides.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from gears3d.measured.checks.view import MESH, View
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
        told = f"{seen} do not decide which encoder is wrong, or whether the teeth are: it takes about {enough:.2g}"
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

"""Data of the plots of a measured record: displacement within its noise, one period close up, orders."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.measured.segmentation import contact_orders
from gears3d.measured.segmentation.orders import STRAY, resolved
from gears3d.measured.segmentation.results import ROWS, within
from gears3d.recording import FLANKS
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, each_alone, harmonics
from gears3d.views.pages.traces import MOST_POINTS, NANOMETRE, QUANTA, TICK, impact_table, knots, speed_histogram, whole

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement, Segments

HIGHEST = 400
"""Order up to which the noise floor is drawn."""
FINE = 32
"""Bins of the angle in a wave of the highest order, at least."""
RIDGE = 1e-4
"""Regularisation, relative to the number of readings, of orders that few contact angles determine poorly."""
FEWEST = 50
"""Points in contact below which no orders are reported."""


def orders_told(found: Measurement) -> dict[str, list[dict[str, Any]]]:
    """Return the orders of both gears by flank, as ``contact_orders`` of ``summary.json`` has them."""
    told = {}
    for flank, name in enumerate(FLANKS):
        if _enough(found, flank):
            table = contact_orders(found, flank)
            told[name] = [
                {
                    "gear": GEARS[int(table["gear"][k])],
                    "order": int(table["order"][k]),
                    **{key: float(table[key][k]) for key in ("amplitude_m", "sigma_m", "phase_rad", "share")},
                }
                for k in range(len(table["order"]))
            ]
        else:
            told[name] = []
    return told


def spectra(found: Measurement) -> dict[str, Any]:
    """Return the residual at every order without the significant orders."""
    left: dict[str, dict[str, list[float]]] = {}
    for flank, name in enumerate(FLANKS):
        if not _enough(found, flank):
            continue
        for gear, floor in _floors(found, flank, found.summary["contact_orders"][name]).items():
            left.setdefault(gear, {})[name] = [float(f"{value:.3g}") for value in floor]
    return left


def _enough(found: Measurement, flank: int) -> bool:
    return len(_near(found, flank)) >= FEWEST


def _near(found: Measurement, flank: int) -> np.ndarray:
    cut = found.segments
    return within(cut.path.time, cut.contacts, cut.path.width, flank)


def _floors(found: Measurement, flank: int, taken: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the amplitude of the residual at each order of each gear [m]."""
    path = found.segments.path
    near = _near(found, flank)
    some = near[:: max(len(near) // ROWS, 1)]
    angles = dict(zip(GEARS, (path.drive[some], path.loose[some]), strict=True))
    x = np.linspace(-0.5, 0.5, len(some))
    waves = [harmonics(angles[one["gear"]], [one["order"]]) for one in taken]
    columns = np.hstack([np.stack([np.ones_like(x), x, x * x], axis=1), *waves])
    rest = path.place[some] - columns @ np.linalg.lstsq(columns, path.place[some], rcond=None)[0]
    limit = STRAY * robust_deviation(rest)
    rest = np.clip(rest, -limit, limit)
    highest = dict(zip(GEARS, resolved(path.drive, path.loose), strict=True))
    return {
        gear: np.abs(each_alone(angles[gear], rest, min(top, HIGHEST), RIDGE, FINE)[0][1:])
        for gear, top in highest.items()
        if top > 1
    }


IMPACTS = {
    **QUANTA,
    "time_sigma_s": 1e-9,
    "velocity_sigma_m_s": 1e-8,
    "rebound_sigma_m_s": 1e-8,
    "duration_s": 1e-8,
    "duration_sigma_s": 1e-9,
    "duration_max_s": 1e-8,
    "testifies": 1.0,
}
"""Quantum of each column of impacts, at most 10 % of any measurement error."""
FLIGHTS = {
    "start_s": 1e-7,
    "end_s": 1e-7,
    "left": 1.0,
    "struck": 1.0,
    "velocity_m_s": 1e-7,
    "height_m": 1e-10,
    "deceleration_rad_s2": 1e-5,
    "deceleration_sigma_rad_s2": 1e-6,
    "omega_loose_rad_s": 1e-5,
    "chi2": 1e-4,
    "testifies": 1.0,
}
"""Quantum of each column of flights."""
DEVIATIONS = 3.0
"""Tolerance of the drawn line, in standard deviations of the noise."""
READINGS = 6000
"""Readings drawn in the period that is magnified."""
FLIGHTS_SHOWN = 6
"""Flights in it where the drive has no period."""


def blocks(found: Measurement) -> dict[str, Any]:
    """Return the blocks by name."""
    recording, cut = found.recording, found.segments
    lines = path_lines(cut)
    time = np.cumsum(lines["time"]) * TICK
    return {
        "traces": lines,
        "walls": _walls(cut, time),
        "impacts": impact_table(recording, {name: q for name, q in IMPACTS.items() if name in recording.impacts}),
        "twin_impacts": None,
        "errors": None,
        "histogram": speed_histogram(recording, None),
        "about": {
            "period": recording.meta.get("period_s"),
            "settle": recording.meta.get("settle_s"),
            "mode": None,
            "height": found.summary["quality"]["flight_height_min_m"],
            "model": "measured",
        },
        "close": close_up(found),
        "flights": {name: whole(cut.flights[name], quantum) for name, quantum in FLIGHTS.items()},
        "spectra": spectra(found),
        "orders": found.summary["contact_orders"],
    }


def path_lines(cut: Segments, most: int = MOST_POINTS) -> dict[str, Any]:
    """Return the measured path, simplified within its noise, with velocity jumps and states."""
    path, shift = cut.path, cut.flanks.active[0]
    at, place = _corners(cut)
    ticks, first = np.unique(np.rint(np.append(at, path.time) / TICK).astype(np.int64), return_index=True)
    place = np.append(place, path.place)[first] - shift
    corner = first < len(at)
    speed = cut.track.steady.curve.derivative()(np.clip(ticks * TICK, path.time[0], path.time[-1]))
    some = np.linspace(0, len(ticks) - 1, min(len(ticks), 1500)).astype(int)
    start = np.union1d(some, np.flatnonzero(corner))
    fine = max(DEVIATIONS * path.noise, 1e-4 * float(np.ptp(place)), NANOMETRE)
    scaled = np.array([place / fine, speed / max(2e-3 * float(np.ptp(speed)), 1e-6)])
    slack, kept = 1.0, np.arange(len(ticks))
    while len(ticks) > 2:
        kept = knots(ticks.astype(float), scaled, start, slack, max(most, len(start)))
        if len(kept) <= max(most, len(start)) or slack > 1e6:
            break
        slack *= 2.0
    ticks = ticks[kept]
    middles = 0.5 * TICK * (ticks + np.append(ticks[1:], ticks[-1]))
    return {
        "tick": TICK,
        "time": np.diff(ticks, prepend=0).tolist(),
        "run": {"displacement_m": _steps(place[kept], NANOMETRE), "omega_drive_rad_s": _steps(speed[kept], 1e-6)},
        "twin": None,
        "states": "".join(str(int(state)) for state in cut.states(middles)),
    }


def _corners(cut: Segments) -> tuple[np.ndarray, np.ndarray]:
    """Return moments at which the path touches or leaves a flank [s], and where that is [m]."""
    flights, impacts = cut.flights, cut.impacts
    time = np.concatenate([impacts["time_s"] + TICK, flights["start_s"], flights["end_s"]])
    flank = np.concatenate([impacts["flank"], flights["left"], flights["struck"]])
    inside = (time > cut.path.time[0]) & (time < cut.path.time[-1])
    low, high = _flanks_at(cut, time[inside])
    return time[inside], np.where(flank[inside] == 1, high, low)


def _flanks_at(cut: Segments, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    known = cut.track
    return cut.flanks.places(time, *known.angles(time))


def _steps(values: np.ndarray, quantum: float) -> dict[str, Any]:
    rounded = np.rint(values / quantum).astype(np.int64)
    return {"quantum": quantum, "steps": np.diff(rounded, prepend=0).tolist()}


def _walls(cut: Segments, time: np.ndarray) -> dict[str, Any]:
    low, high = (ends - cut.flanks.active[0] for ends in _flanks_at(cut, time))
    struck = bool(np.isfinite(high).all())
    return {
        "quantum": NANOMETRE,
        "moving": True,
        "complete": True,
        "active": _steps(low, NANOMETRE)["steps"],
        "reverse": _steps(high, NANOMETRE)["steps"] if struck else None,
    }


def close_up(found: Measurement) -> dict[str, Any]:
    """Return the readings of one period in the middle of the record, with flanks and states."""
    cut = found.segments
    known, shift = cut.track, cut.flanks.active[0]
    start, end = _window(found)
    all_of = np.flatnonzero((known.time >= start) & (known.time <= end))
    every = -(-len(all_of) // READINGS) or 1
    some = all_of[::every]
    time = known.time[some]
    drive, loose, place = known.part(some)
    low, high = cut.flanks.places(time, drive, loose)

    def micrometres(values: np.ndarray) -> list[float]:
        return (1e6 * (values - shift)).round(3).tolist()

    return {
        "start": start,
        "end": end,
        "time": (time - start).round(7).tolist(),
        "place": micrometres(place),
        "low": micrometres(low),
        "high": micrometres(high) if np.isfinite(high).all() else None,
        "state": "".join(str(int(state)) for state in cut.states(time)),
        "every": every,
        "sigma": 1e6 * known.noise,
    }


def _window(found: Measurement) -> tuple[float, float]:
    """Return begin and end of a period that shows what is typical [s]."""
    cut = found.segments
    begin, end = float(cut.track.time[0]), float(cut.track.time[-1])
    starts, ends = cut.flights["start_s"], cut.flights["end_s"]
    period = found.recording.meta.get("period_s")
    if not len(starts):
        width = min(period or 0.1 * (end - begin), end - begin)
        return 0.5 * (begin + end - width), 0.5 * (begin + end + width)
    near = slice(len(starts) // 3, max(2 * len(starts) // 3, len(starts) // 3 + 1))
    one = near.start + int(np.argmax(cut.flights["height_m"][near]))
    if not period:
        last = min(one + FLIGHTS_SHOWN - 1, len(starts) - 1)
        period = 1.1 * float(ends[last] - starts[one])
    width = min(1.05 * period, end - begin)
    first = float(np.clip(starts[one] - 0.05 * width, begin, end - width))
    return first, first + width

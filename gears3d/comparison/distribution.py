"""Impacts as samples of one distribution: distances, and resampled blocks that test them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gears3d.comparison.matching import Table
from gears3d.comparison.result import SampleTest

LEVEL = 0.01  # Probability that any of the tests rejects though nothing differs
PERMUTATIONS = 999  # P-values down to 0.001, 1/10 of LEVEL
RESAMPLES = 400  # Of the blocks, for 95 % limits
MEMORY = 5.0  # Length of a block in Lyapunov times, after which the motion has forgotten where it was
MEMORY_NEEDED = 2.0  # Shorter blocks, in Lyapunov times, are no basis for a test
BLOCKS_WANTED = 16  # Of a recording, if its memory allows so many
BLOCKS_NEEDED = 8  # 8 blocks of each of two recordings have 12870 permutations, more than are drawn
FEWEST = 8  # Samples smaller than this are not tested
# Relative changes whose discovery is tried out
LADDER = (0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7, 1.0)
POWER = 0.95  # Required of resamples, so that new records, which vary more, are accepted in 90 % of the cases
RESOLUTION = 1e-4  # Smaller differences, of the speed itself or in cycles of phase, are rounding
SEED = 20200701
Window = tuple[float, float]


def cut(times: np.ndarray, begin: float, length: float, count: int) -> np.ndarray:
    """Return the block of each impact, -1 outside of all.

    >>> cut(np.array([0.1, 0.9, 1.1, 7.0]), 0.0, 1.0, 2).tolist()
    [0, 0, 1, -1]
    """
    block = np.floor((times - begin) / length).astype(int)
    block[(block < 0) | (block >= count)] = -1
    return block


def distance(first: np.ndarray, second: np.ndarray, last: np.ndarray, circular: bool) -> np.ndarray:
    """Return how far two weighted samples are apart: Kolmogorov-Smirnov, or Kuiper on a circle.

    Source: Kuiper 1960 for the circle.

    >>> both = np.array([[1, 1, 0, 0]]), np.array([[0, 0, 1, 1]])
    >>> distance(*both, np.ones(4, dtype=bool), circular=False).tolist()
    [1.0]
    """
    apart = (_cumulative(first) - _cumulative(second))[:, last]
    above, below = np.maximum(apart.max(axis=1), 0.0), np.maximum(-apart.min(axis=1), 0.0)
    return above + below if circular else np.maximum(above, below)


def _cumulative(weights: np.ndarray) -> np.ndarray:
    summed = np.cumsum(weights, axis=1, dtype=float)
    return summed / np.maximum(summed[:, -1:], 1.0)


def permuted(count: tuple[int, int], times: int, rng: np.random.Generator) -> np.ndarray:
    """Return which blocks are dealt to the first recording, first as it was, then at random.

    >>> permuted((2, 1), 1, np.random.default_rng(0)).sum(axis=1).tolist()
    [2, 2]
    """
    dealt = np.arange(sum(count)) < count[0]
    return np.vstack([dealt, rng.permuted(np.tile(dealt, (times, 1)), axis=1)])


def drawn(count: int, size: int, times: int, rng: np.random.Generator) -> np.ndarray:
    """Return how often each block is drawn, with replacement.

    >>> drawn(3, 5, 2, np.random.default_rng(0)).sum(axis=1).tolist()
    [5, 5]
    """
    return rng.multinomial(size, np.full(count, 1.0 / count), size=times)


def compare_distributions(
    tables: tuple[Table, Table], windows: tuple[Window, Window], period: float, lyapunov: float
) -> dict[str, Any]:
    """Hold the speeds and phases of the impacts on each flank, and their rate, against the reference's.

    Impacts of one motion depend on each other, so the tests permute whole blocks of time, five Lyapunov times long
    or 1/16 of the record; their level is shared by Holm's rule. All chance comes from a fixed seed.

    Returns:
        Fields of :class:`gears3d.comparison.Comparison`.
    """
    rng = np.random.default_rng(SEED)
    length, count = _blocks(windows, period, lyapunov)
    parts = [cut(table["time_s"], w[0], length, n) for table, w, n in zip(tables, windows, count, strict=True)]
    tests: list[SampleTest] = []
    notes: list[str] = []
    doubt = _doubt(length, min(count), lyapunov)
    if doubt:
        notes.append(doubt)
    else:
        deals = permuted(count, PERMUTATIONS, rng)
        for code, flank in enumerate(("active", "reverse")):
            tests += _test_flank(flank, code, tables, parts, count, deals, period, rng)
    return {
        "impacts_compared": len(tables[1]["time_s"]),
        "impacts_matched": None,
        "impacts_missed": None,
        "impacts_invented": None,
        **_errors(tables, period),
        "tests": _holm(tests),
        "rate_ratio": _rate_ratio(parts, count, rng),
        "notes": tuple(notes),
    }


def _blocks(windows: tuple[Window, Window], period: float, lyapunov: float) -> tuple[float, tuple[int, int]]:
    """Return the length of a block [s] and how many each recording has."""
    spans = [max(w[1] - w[0], 0.0) for w in windows]
    wanted = MEMORY / lyapunov if lyapunov > 0.0 else 0.0
    longest = max(min(spans) / BLOCKS_WANTED, min(wanted, min(spans) / BLOCKS_NEEDED))
    length = period * max(1.0, np.floor(longest / period + 1e-9))
    counts = [int(span / length + 1e-9) for span in spans]
    return float(length), (counts[0], counts[1])


def _doubt(length: float, count: int, lyapunov: float) -> str:
    """Return why the recordings are too short to be tested, empty when they are not."""
    if count >= BLOCKS_NEEDED and lyapunov * length >= MEMORY_NEEDED * (lyapunov > 0.0):
        return ""
    needed = BLOCKS_NEEDED * max(length if lyapunov <= 0.0 else 0.0, MEMORY / lyapunov if lyapunov > 0.0 else 0.0)
    return f"too short to tell distributions apart: simulate {needed:.3g} s or more after settling"


def _test_flank(
    flank: str,
    code: int,
    tables: tuple[Table, Table],
    parts: list[np.ndarray],
    count: tuple[int, int],
    deals: np.ndarray,
    period: float,
    rng: np.random.Generator,
) -> list[SampleTest]:
    """Return the tests of speed and phase on one flank."""
    kept = [(table["flank"] == code) & (part >= 0) for table, part in zip(tables, parts, strict=True)]
    if min(k.sum() for k in kept) < FEWEST:
        return []
    block = np.concatenate([parts[0][kept[0]], parts[1][kept[1]] + count[0]])
    found = []
    for quantity in ("speed", "phase"):
        values = np.concatenate([_values(t, quantity, period)[k] for t, k in zip(tables, kept, strict=True)])
        order = np.argsort(values, kind="stable")
        mine = deals[:, block[order]]
        last = np.append(np.diff(_rounded(values[order], quantity)) > 0.0, True)
        distances = distance(mine, ~mine, last, quantity == "phase")
        p_value = float(np.mean(distances >= distances[0] - 1e-12))
        critical = float(np.quantile(distances[1:], 1.0 - LEVEL / 4))
        detectable = None
        if quantity == "speed":
            detectable = _detectable(values[order], block[order], count, critical, rng)
        found.append(SampleTest(f"{flank}.{quantity}", float(distances[0]), p_value, False, detectable))
    return found


def _values(table: Table, quantity: str, period: float) -> np.ndarray:
    if quantity == "speed":
        return np.abs(table["velocity_m_s"])
    phase = table["phase_rad"] / (2 * np.pi)
    return np.mod(np.where(np.isfinite(phase), phase, table["time_s"] / period), 1.0)


def _rounded(values: np.ndarray, quantity: str) -> np.ndarray:
    """Round speeds relatively and phases absolutely, so that the last digits of one orbit are no difference."""
    scale = np.log(np.maximum(values, 1e-12)) if quantity == "speed" else values
    return np.rint(scale / RESOLUTION)


def _detectable(
    speeds: np.ndarray, block: np.ndarray, count: tuple[int, int], critical: float, rng: np.random.Generator
) -> float | None:
    """Return the least relative change of the reference's speeds that would be found nine times in ten."""
    pool = block >= count[0]
    speeds, block = speeds[pool], block[pool] - count[0]
    shares = []
    for size in count:
        summed = np.cumsum(drawn(count[1], size, RESAMPLES // 2, rng)[:, block], axis=1, dtype=float)
        shares.append(np.pad(summed / np.maximum(summed[:, -1:], 1.0), ((0, 0), (1, 0))))
    for change in LADDER:
        below = np.searchsorted(speeds, speeds / (1.0 + change), "right")
        apart = np.abs(shares[0][:, below] - shares[1][:, 1:]).max(axis=1)
        if np.mean(apart > critical) >= POWER:
            return change
    return None


def _holm(tests: list[SampleTest]) -> tuple[SampleTest, ...]:
    """Mark the tests that reject at the level of all together (Holm 1979)."""
    ranked = sorted(range(len(tests)), key=lambda i: tests[i].p_value)
    struck = set()
    for rank, i in enumerate(ranked):
        if tests[i].p_value > LEVEL / (len(tests) - rank):
            break
        struck.add(i)
    return tuple(replace(test, different=i in struck) for i, test in enumerate(tests))


def _rate_ratio(
    parts: list[np.ndarray], count: tuple[int, int], rng: np.random.Generator
) -> tuple[float, float, float] | None:
    """Return the ratio of impacts per time and its 95 % interval, by drawing blocks."""
    if min(count) < 2:
        return None
    hits = [np.bincount(part[part >= 0], minlength=n) for part, n in zip(parts, count, strict=True)]
    if not hits[1].any():
        return None
    rates = [drawn(n, n, RESAMPLES, rng) @ h / n for h, n in zip(hits, count, strict=True)]
    low, high = np.quantile(rates[0] / np.maximum(rates[1], 1e-12), [0.025, 0.975])
    return float(hits[0].mean() / hits[1].mean()), float(low), float(high)


def _errors(tables: tuple[Table, Table], period: float) -> dict[str, float | None]:
    """Return the relative errors of median, 95th percentile and mean, and of the mean phase, on the worse flank."""
    found: dict[str, list[float]] = {}
    for code in (0, 1):
        one, other = (
            {q: _values(table, q, period)[table["flank"] == code] for q in ("speed", "phase")} for table in tables
        )
        if not one["speed"].size or not other["speed"].size:
            continue
        a, b = one["speed"], other["speed"]
        found.setdefault("velocity_error_median", []).append(abs(float(np.median(a) / np.median(b)) - 1.0))
        upper = float(np.quantile(a, 0.95) / np.quantile(b, 0.95))
        found.setdefault("velocity_error_p95", []).append(abs(upper - 1.0))
        found.setdefault("velocity_bias", []).append(float(a.mean() / b.mean()) - 1.0)
        turn = [np.angle(np.exp(2j * np.pi * x["phase"]).sum()) / (2 * np.pi) for x in (one, other)]
        found.setdefault("phase_error_median_cycles", []).append(abs(float((turn[0] - turn[1] + 0.5) % 1.0 - 0.5)))
    names = ("velocity_error_median", "velocity_error_p95", "velocity_bias", "phase_error_median_cycles")
    return {name: max(found[name], key=abs) if name in found else None for name in names}

"""Faults put into records; nothing here knows how they are found. Every function returns new columns."""

import numpy as np

DRIVE, LOOSE = "theta_drive_rad", "theta_loose_rad"


def without_rows(columns, rows):
    return {name: np.delete(values, rows) for name, values in columns.items()}


def left_out(columns, first, rows):
    """Rows are missing, but the time base was made up afterwards and goes on evenly."""
    short = without_rows(columns, np.arange(first, first + rows))
    return {**short, "time_s": columns["time_s"][: len(short["time_s"])]}


def twice(columns, row):
    return {name: np.insert(values, row, values[row]) for name, values in columns.items()}


def held(columns, row, rows):
    """The recorder gives the same angles for some rows, then catches up."""
    changed = {name: values.copy() for name, values in columns.items()}
    for name in (DRIVE, LOOSE):
        changed[name][row + 1 : row + 1 + rows] = changed[name][row]
    return changed


def holes(columns, name, rows, value=np.nan):
    changed = columns[name].copy()
    changed[rows] = value
    return {**columns, name: changed}


def jitter(columns, rms, seed):
    noise = np.random.default_rng(seed).normal(0.0, rms, len(columns["time_s"]))
    return {**columns, "time_s": columns["time_s"] + noise}


def clock_wrap(columns, tick, bits):
    return {**columns, "time_s": np.mod(columns["time_s"], tick * 2**bits)}


def shuffled(columns, row, rows):
    """Two blocks of rows changed places."""
    order = np.arange(len(columns["time_s"]))
    order[row : row + 2 * rows] = np.concatenate([order[row + rows : row + 2 * rows], order[row : row + rows]])
    return {name: values[order] for name, values in columns.items()}


def angle_wrap(columns, name, width):
    return {**columns, name: np.mod(columns[name], width)}


def lost(columns, name, row, size):
    """The counter is off by ``size`` from ``row`` on."""
    return {**columns, name: columns[name] + size * (np.arange(len(columns[name])) >= row)}


def spike(columns, name, row, size):
    return {**columns, name: columns[name] + size * (np.arange(len(columns[name])) == row)}


def scaled(columns, **factors):
    return {**columns, **{name: columns[name] * factor for name, factor in factors.items()}}


def clipped(columns, name, share):
    """The channel never passes the value that it has after ``share`` of the rows."""
    limit = columns[name][int(share * len(columns[name]))]
    return {**columns, name: np.minimum(columns[name], limit)}


def late(columns, name, delay):
    """The channel was sampled ``delay`` before the other one's time; counts stay counts only for whole rows."""
    time = columns["time_s"]
    rows = round(delay / (time[1] - time[0]))
    if abs(rows * (time[1] - time[0]) - delay) < 1e-12:
        kept = slice(max(rows, 0), len(time) + min(rows, 0))
        shifted = {other: values[kept] for other, values in columns.items()}
        source = columns[name]
        return {**shifted, name: source[max(-rows, 0) : len(source) - max(rows, 0)]}
    return {**columns, name: np.interp(time - delay, time, columns[name])}


def eccentric(columns, name, amplitude, phase=0.7, order=1):
    """The encoder sits off its shaft's centre: it reads the angle wrong once (or n times) a turn."""
    angle = columns[name]
    return {**columns, name: angle + amplitude * np.cos(order * angle + phase)}

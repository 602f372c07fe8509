"""Held-out error reduction of an extension: over whole records, or over stretches of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.cause import Cause, contribution, fit
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.prediction import CHANNELS, residuals, rms_of

Array = np.ndarray
# Number of stretches of each of one or two records.
STRETCHES = 4
# Fall of the held-out log-likelihood that refutes causes: the gain required to accept a cause, half of Δχ² = 30.
WORSE = 15.0
# Largest loss of a channel in a split, relative to the gain of the causes: torques move the back-extrapolated contact
# losses, which are less precise than flights.
AGAINST = 0.25
# Units of the channels, and of contact episodes.
UNITS = {"flight": "rad", "contact": "m", "impact": "m/s", "loss": "m/s", "drive": "rad", "visit": "m"}


class Split(NamedTuple):
    """One split into training and held-out data.

    Args:
        held: names of the held-out records or stretches.
        base: mean squared standardised error of the rig as it is, over the channels.
        extended: the same with the causes, fitted to the rest.
        noise: the same for noise alone.
        likelihood: gain in log-likelihood.
        sizes: root mean square errors by channel, of base and extended [its unit].
        gains: gain in log-likelihood by channel.
    """

    held: tuple[str, ...]
    base: float
    extended: float
    noise: float
    likelihood: float
    sizes: dict[str, tuple[float, float]]
    gains: dict[str, float] = {}  # noqa: RUF012 - of a tuple, never written to

    @property
    def gain(self) -> float:
        """Relative reduction of the held-out error beyond noise: (base - extended) / (base - noise)."""
        return 1.0 - (self.extended - self.noise) / max(self.base - self.noise, 1e-12)


def splits(records: Sequence[Evidence], causes: Sequence[Cause]) -> list[Split]:
    """Return the held-out error reduction of causes, refitted each time, by record or stretch."""
    parts = parts_of(records)
    found = []
    for k, held in enumerate(parts):
        train = [one for i, one in enumerate(parts) if i != k]
        base = np.concatenate([residuals(one)[name] for name in CHANNELS for one in train])
        effects = [c.effect for c in fit(train, base, causes).causes if c.effect is not None]
        found.append(_worth(held, effects))
    return found


def parts_of(records: Sequence[Evidence]) -> list[Evidence]:
    """Return the parts that are held out in turn: whole records, or stretches of one or two."""
    return list(records) if len(records) > 2 else [part for one in records for part in _stretches(one)]


def _worth(held: Evidence, effects: Sequence[object]) -> Split:
    before = residuals(held)
    after = {name: before[name] - contribution([held], effects, (name,)) for name in CHANNELS}
    return worth(held, before, after)


def worth(held: Evidence, before: dict[str, Array], after: dict[str, Array]) -> Split:
    """Return the error reduction of an extension in one held-out part."""
    seen = [name for name in CHANNELS if name in before and len(before[name])]
    level = {n: max(float(np.median(after[n] ** 2)) / 0.4549, 1e-6) for n in seen}
    base, extended = (float(np.mean([np.mean(rest[n] ** 2) for n in seen])) for rest in (before, after))
    gains = {n: 0.5 * float(before[n] @ before[n] - after[n] @ after[n]) / max(level[n], 1.0) for n in seen}
    sizes = {name: (rms_of(before[name], [held], name), rms_of(after[name], [held], name)) for name in seen}
    noise = float(np.mean([min(level[n], float(np.mean(after[n] ** 2))) for n in seen]))
    return Split((held.name,), base, extended, noise, sum(gains.values()), sizes, gains)


def refuted(found: Sequence[Split]) -> set[str]:
    """Return the channels that causes predict worse than the rig as it is, in any held-out split or in all.

    >>> one = Split(("a",), 3.0, 1.1, 1.0, 40.0, {}, {"flight": 60.0, "loss": -20.0})
    >>> refuted([one, one._replace(gains={"flight": 12.0, "loss": 25.0})])
    {'loss'}
    >>> refuted([one._replace(gains={"flight": -3.0})] * 2)
    {'flight'}
    """
    total = {name: sum(one.gains.get(name, 0.0) for one in found) for one in found for name in one.gains}
    none = {name for name, gain in total.items() if gain < 0.0} if sum(total.values()) < 0.0 else set()
    for one in found:
        least = max(WORSE, AGAINST * sum(max(gain, 0.0) for gain in one.gains.values()))
        none |= {name for name, gain in one.gains.items() if gain < -least}
    return none


def _stretches(one: Evidence) -> list[Evidence]:
    """Return a record as stretches of time."""
    time = one.channels.drive.time
    edges = np.linspace(time[0], time[-1], STRETCHES + 1)
    found = []
    for a, b in pairwise(edges):
        seen, cut = one.channels, {}
        for name in ("contacts", "impacts", "losses"):
            table = getattr(seen, name)
            keep = (table.time >= a) & (table.time < b)
            cut[name] = type(table)(*(column[keep] for column in table))
        middle = seen.flights.time.mean(axis=1) if len(seen.flights.time) else np.zeros(0)
        keep = (middle >= a) & (middle < b)
        cut["flights"] = type(seen.flights)(*(column[keep] for column in seen.flights))
        inside = (time >= a) & (time < b)
        cut["drive"] = seen.drive._replace(time=time[inside], angle=seen.drive.angle[inside])
        fine = tuple(column[keep] for column in one.fine)
        name = f"{one.name} {a:.4g} to {b:.4g} s"
        found.append(replace(one, name=name, channels=seen._replace(**cut), fine=fine, at=one.at[keep]))
    return found

"""One record as evidence: its channels, its rig, and the states at which predictions are made."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.diagnosis.channels import BINS, Channels, Drive, Losses, channels, nothing
from gears3d.measured.segmentation import doubtful

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Measurement
    from gears3d.measured.segmentation.flanks import Flanks
    from gears3d.measured.segmentation.segments import Segments
    from gears3d.scenario import Scenario

Array = np.ndarray
# Largest ratio of the jerk of a gap at contact loss to the largest jerk of the drive.
STEEP = 4.0
# Integration steps per bin of a flight.
FINE = 4


@dataclass(frozen=True, eq=False)
class Motion:
    """The drive's motion of a record: mean speed and harmonics, measured at the nominal frequencies.

    Args:
        mean: [rad/s].
        harmonics: cosine and sine part of the angle [rad], angular frequency [rad/s], each (h, 3).
    """

    mean: float
    harmonics: Array

    def acceleration(self, time: Array, extra: tuple[Row, ...] = ()) -> Array:
        """Return the drive's acceleration [rad/s²], with the motions of effects added.

        time: [s], (n,).
        """
        total = np.zeros_like(time)
        for cosine, sine, turn in self.harmonics:
            total -= turn**2 * (cosine * np.cos(turn * time) + sine * np.sin(turn * time))
        for row in extra:
            turn = 2.0 * pi * row.p[1]
            total += row.p[0] * turn * np.cos(turn * time + row.p[2])
        return total

    def speed(self, time: Array) -> Array:
        """Return the drive's speed [rad/s] at times (n,) [s]."""
        total = np.full_like(time, self.mean)
        for cosine, sine, turn in self.harmonics:
            total += turn * (sine * np.cos(turn * time) - cosine * np.sin(turn * time))
        return total


@dataclass(frozen=True, eq=False)
class Evidence:
    """One record, prepared for the comparison with predictions.

    Args:
        name: of the record.
        scenario: of the test rig under this record's conditions.
        rig: its constants.
        pair: its nominal gears.
        rows: rows of the effects that the rig has already.
        channels: of the record.
        motion: of the drive.
        fine: time [s], angle [rad] and speed [rad/s] of the loose gear in flight, each (f, FINE*(BINS-1)+1).
        at: indices of the points of flights among the fine ones, (f, BINS).
        spared: sensor effects that were removed from the readings before segmentation; predictions omit them.
        unmarked: gears whose encoders have an unknown angular datum in this record.
        turned: added to the angles of drive and loose gear as read [rad].
        flanks: used in its segmentation, over the angles as read.
        doubt: fraction of the record that its segmentation does not explain.
        stated: whether the harmonics of the drive's motion are specified for it, so that the drive can deviate from
            them.
        kept: cache of derived values; a record with other points starts with an empty one.
    """

    name: str
    scenario: Scenario
    rig: Rig
    pair: Pair
    rows: tuple[Row, ...]
    channels: Channels
    motion: Motion
    fine: tuple[Array, Array, Array]
    at: Array
    spared: tuple[Any, ...] = ()
    unmarked: tuple[str, ...] = ()
    turned: tuple[float, float] = (0.0, 0.0)
    flanks: Flanks | None = None
    doubt: float = 0.0
    stated: bool = True
    kept: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    @property
    def radii(self) -> tuple[float, float]:
        """Base radii of drive and loose gear [m]."""
        return self.rig.base_radius_drive, self.rig.base_radius_loose

    @property
    def drive(self) -> Drive:
        """Points of the drive's motion that are compared with a specified one; empty without one."""
        seen = self.channels.drive
        return seen if self.stated else seen._replace(time=seen.time[:0], angle=seen.angle[:0])


def evidence(
    found: Measurement, scenario: Scenario, name: str = "", spared: tuple[Any, ...] = (), *, stated: bool = True
) -> Evidence:
    """Return a measured record as evidence."""
    return of_cut(found.segments, scenario, name, spared, stated=stated)


def of_cut(
    cut: Segments, scenario: Scenario, name: str = "", spared: tuple[Any, ...] = (), *, stated: bool = True
) -> Evidence:
    """Return a segmented record as evidence."""
    seen = channels(cut)
    fine, at = _fine(seen)
    motion = _motion(seen, scenario)
    seen = _clear_losses(seen, motion, scenario.rig().base_radius_drive)
    return Evidence(name, scenario, scenario.rig(), scenario.pair(), scenario.rows(), seen, motion, fine, at,
                    spared, flanks=cut.flanks, doubt=doubtful(cut), stated=stated)  # fmt: skip


def _clear_losses(seen: Channels, motion: Motion, radius: float) -> Channels:
    """Return channels without losses whose gap opens faster than the drive's motion explains: peaks of bounces."""
    if not len(motion.harmonics):
        return seen
    cosine, sine, turn = motion.harmonics.T
    good = seen.losses.growth[:, 0] < STEEP * radius * float(np.sum(turn**3 * np.hypot(cosine, sine)))
    left_out = {**seen.left_out, "loss": seen.left_out["loss"] + int(np.sum(~good))}
    return seen._replace(losses=Losses(*(column[good] for column in seen.losses)), left_out=left_out)


def uncut(scenario: Scenario, name: str = "") -> Evidence:
    """Return a record that could not be segmented: no channel has a point.

    Args:
        scenario: of the test rig under this record's conditions.
        name: of the record.
    """
    seen = nothing()
    fine, at = _fine(seen)
    none = Motion(scenario.motion.mean, np.zeros((0, 3)))
    return Evidence(name, scenario, scenario.rig(), scenario.pair(), scenario.rows(), seen, none, fine, at)


def _motion(seen: Channels, scenario: Any) -> Motion:
    drive = seen.drive
    turns = sorted({2.0 * pi * one.frequency for one in scenario.motion.harmonics})
    middle = float(drive.time.mean()) if len(drive.time) else 0.0
    columns = [np.ones_like(drive.time), drive.time - middle]
    for turn in turns:
        shrunk = np.sinc(turn * drive.width / (2.0 * pi))  # a mean over time flattens a sine
        columns += [shrunk * np.cos(turn * drive.time), shrunk * np.sin(turn * drive.time)]
    found = np.linalg.lstsq(np.column_stack(columns), drive.angle, rcond=None)[0]
    pairs = found[2:].reshape(-1, 2)
    return Motion(float(found[1]), np.column_stack([pairs, turns]) if turns else np.zeros((0, 3)))


def _fine(seen: Channels) -> tuple[tuple[Array, Array, Array], Array]:
    """Return the paths of flights as parabolas on a fine grid."""
    flights, count = seen.flights, FINE * (BINS - 1) + 1
    if not len(flights.time):
        none = np.zeros((0, count))
        return (none, none, none), np.zeros((0, BINS))
    middle = flights.time.mean(axis=1, keepdims=True)
    half = np.abs(flights.time - middle).max(axis=1, keepdims=True)
    x = (flights.time - middle) / half
    powers = np.stack([np.ones_like(x), x, x * x], axis=-1)
    normal = np.einsum("fka,fkb->fab", powers, powers)
    numbers = np.linalg.solve(normal, np.einsum("fka,fk->fa", powers, flights.loose)[..., None])[..., 0]
    first, last = flights.time[:, :1], flights.time[:, -1:]
    time = first + np.linspace(0.0, 1.0, count) * (last - first)
    y = (time - middle) / half
    angle = numbers[:, :1] + y * (numbers[:, 1:2] + y * numbers[:, 2:])
    speed = (numbers[:, 1:2] + 2.0 * y * numbers[:, 2:]) / half
    return (time, angle, speed), (flights.time - first) / (last - first) * (count - 1)

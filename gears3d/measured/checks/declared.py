"""What a record is compared with: the rig as the scenario or the record's own metadata declare it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

# The columns of a record of two gears in mesh.
MESH = ("theta_drive_rad", "theta_loose_rad")


# Part of a revolution by which the angle between index marks may deviate: a wrong count, not another shaft.
NEAR = 0.2
# Revolutions between index marks that show a count.
FEW = 3


@dataclass(frozen=True)
class Declared:
    """What is declared of the bench; ``None`` where nothing is.

    Args:
        needs: columns that must be there besides time; alternatives as a tuple.
        radii: base radii of drive and loose gear [m].
        teeth: of drive and loose gear.
        backlash: along the line of action [m].
        mean_speed: of the drive gear where it is stated of this record [rad/s].
        fluctuation: sum of the amplitudes of the drive's harmonics where they are stated of this record [rad/s].
        harmonics: whether the harmonics are stated.
        usual_speed: mean speed of the drive gear in the rig's scenario, which this record may have or not [rad/s].
        sample_rate: [Hz].
        counts: per revolution, by column.
        stated_rate: that the file itself states and that its time was made of [Hz].
        marks: angle between index marks over a revolution, by column, where the record has marks.
        noise: standard deviation of a reading that an earlier check found, at least, by column [rad].
    """

    needs: tuple[str | tuple[str, ...], ...] = MESH
    radii: tuple[float, float] | None = None
    teeth: tuple[int, int] | None = None
    backlash: float | None = None
    mean_speed: float | None = None
    fluctuation: float = 0.0
    harmonics: bool = False
    usual_speed: float | None = None
    sample_rate: float | None = None
    counts: Mapping[str, float] = field(default_factory=dict)
    stated_rate: float | None = None
    marks: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def meshed(self) -> bool:
        """Whether both gears were in mesh, so that one angle shows the other."""
        return set(MESH) <= set(self.needs)


def stated_of(condition: Mapping[str, Any], rig: Scenario | None, stated_motion: bool = False) -> frozenset[str]:
    """Return which parts of the drive's motion are stated of a record: ``mean``, ``harmonics``, ``record``.

    Any key of ``motion.harmonics`` states all harmonics of the rig with that change; the mean speed alone states no
    harmonics, and the reverse. A recorded motion states everything.

    >>> sorted(stated_of({"motion.mean": "90 rpm", "drag.torque": "1 N m"}, None))
    ['mean']
    """
    parts = {key.split(".")[1].split("[")[0] for key in condition if key.startswith("motion.")}
    if stated_motion or "motion" in condition:
        parts |= {"mean", "harmonics"}
    if rig is not None and rig.motion.record is not None and (stated_motion or "record" in parts):
        parts |= {"mean", "harmonics", "record"}
    return frozenset(parts & {"mean", "harmonics", "record"})


def declared(
    rig: Scenario | None,
    meta: Mapping[str, Any],
    needs: Sequence[str | Sequence[str]] = MESH,
    stated: Collection[str] = (),
) -> Declared:
    """Return what rig and metadata declare.

    >>> declared(None, {"base_radius_drive_m": 0.1, "base_radius_loose_m": 0.2}).radii
    (0.1, 0.2)
    """
    asked = tuple(need if isinstance(need, str) else tuple(need) for need in needs)
    one, other = meta.get("base_radius_drive_m"), meta.get("base_radius_loose_m")
    radii = (one, other) if isinstance(one, float) and isinstance(other, float) else None
    marks = _marks(meta)
    if rig is None:
        return Declared(asked, radii, marks=marks)
    values = rig.rig()
    counts = {
        name: float(sensor.counts_per_revolution)
        for name, sensor in zip(MESH, (rig.sensors.drive, rig.sensors.loose), strict=True)
        if sensor.counts_per_revolution
    }
    return Declared(
        asked,
        (values.base_radius_drive, values.base_radius_loose),
        (values.teeth_drive, values.teeth_loose),
        values.backlash,
        rig.motion.mean if rig.motion.record is None and "mean" in stated else None,
        sum(abs(harmonic.amplitude) for harmonic in rig.motion.harmonics) if "harmonics" in stated else 0.0,
        "harmonics" in stated,
        rig.motion.mean if rig.motion.record is None else None,
        rig.sensors.sample_rate if rig.sensors.stated else None,
        counts,
        rate if isinstance(rate := meta.get("stated_rate_Hz"), float) else None,
        marks,
    )


def _marks(meta: Mapping[str, Any]) -> dict[str, float]:
    """Return the usual angle between neighbouring index marks over a revolution, where it can be one."""
    found, seen = {}, meta.get("index_rad", {})
    for name in MESH:
        passed = np.abs(np.diff(np.array(seen.get(name.split("_")[1], []), float))) / (2 * np.pi)
        passed = passed[np.abs(passed - 1.0) < NEAR]  # neither lost marks nor one seen twice, nor a geared encoder
        if len(passed) >= FEW:
            found[name] = float(np.mean(passed))
    return found

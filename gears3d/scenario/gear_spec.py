"""The gears of a scenario as they were asked for, and how they are mounted; SI."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.gears.deviation import Deviation, Misalignment, Mounting
    from gears3d.gears.gear import Gear, Relief


@dataclass(frozen=True)
class GearSpec:
    """One gear as asked for.

    Args:
        teeth: number of teeth.
        module: normal module, m.
        pressure_angle: normal, rad.
        helix_angle: rad.
        face_width: m.
        profile_shift: coefficient.
        addendum: in modules.
        dedendum: in modules.
        fillet_radius: tip radius of the cutting rack, in modules.
        tip_shortening: in modules.
        tip_diameter: m; ``None``: from addendum and tip shortening.
        lead_crowning: m.
        helix_slope: over the face width, m.
        bore: diameter of the hole, m; ``None``: none.
        rim: thickness of the rim, m; ``None``: a full body.
        web: thickness of the web, m.
        hub: diameter of the hub, m; ``None``: none.
        inertia: about its axis, kg·m²; of the loose gear that of its solid when not given, of the drive ``None`` then.
        density: kg/m³.
        tip_relief: taken off towards the tip.
        root_relief: taken off towards the root.
        deviations: of its profiles.
        mounting: how its teeth sit off its axis.
    """

    teeth: int
    module: float
    pressure_angle: float
    helix_angle: float
    face_width: float
    profile_shift: float
    addendum: float
    dedendum: float
    fillet_radius: float
    tip_shortening: float
    tip_diameter: float | None
    lead_crowning: float
    helix_slope: float
    bore: float | None
    rim: float | None
    web: float | None
    hub: float | None
    inertia: float | None
    density: float
    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    deviations: tuple[Deviation, ...] = ()
    mounting: tuple[Mounting, ...] = ()

    def gear(self) -> Gear:
        """Return its geometry."""
        return self._gear

    @cached_property
    def _gear(self) -> Gear:
        from gears3d.gears.gear import Gear

        return Gear(**{part.name: getattr(self, part.name) for part in fields(Gear)})


@dataclass(frozen=True)
class Gears:
    """Both gears."""

    drive: GearSpec
    loose: GearSpec


@dataclass(frozen=True)
class Mount:
    """How the gears are mounted; at least one of the two is given.

    Args:
        backlash: width of the dead band along the transverse line of action, m.
        centre_distance: m.
        misalignment: of the axes; ``None``: they are parallel.
    """

    backlash: float | None
    centre_distance: float | None
    misalignment: Misalignment | None = None

"""The field's closed forms, one function an equation."""

from __future__ import annotations

from typing import Any

from gears3d.laws import film as film
from gears3d.laws.drag import end_faces as end_faces
from gears3d.laws.drag import periphery as periphery
from gears3d.laws.drag import rolling_bearing as rolling_bearing
from gears3d.laws.error_function import Orders as Orders
from gears3d.laws.error_function import averaged as averaged
from gears3d.laws.error_function import strongest_orders as strongest_orders
from gears3d.laws.excitation import dimensionless_backlash as dimensionless_backlash
from gears3d.laws.excitation import riding as riding
from gears3d.laws.excitation import threshold_amplitude as threshold_amplitude
from gears3d.laws.excitation import threshold_omega as threshold_omega
from gears3d.laws.film import contact_length as contact_length
from gears3d.laws.film import dynamic_viscosity as dynamic_viscosity
from gears3d.laws.film import equivalent_radius as equivalent_radius
from gears3d.laws.film import squeeze as squeeze
from gears3d.laws.noise import WHINE_30_RPM as WHINE_30_RPM
from gears3d.laws.noise import impacts_per_second as impacts_per_second
from gears3d.laws.noise import power_level as power_level
from gears3d.laws.noise import pressure_level as pressure_level
from gears3d.laws.noise import rattle_drive as rattle_drive
from gears3d.laws.noise import rattle_level as rattle_level
from gears3d.laws.noise import total_level as total_level
from gears3d.laws.orbit import REGIMES as REGIMES
from gears3d.laws.orbit import Landing as Landing
from gears3d.laws.orbit import SineDrive as SineDrive
from gears3d.laws.orbit import border as border
from gears3d.laws.orbit import crossing as crossing
from gears3d.laws.orbit import drift as drift
from gears3d.laws.orbit import landing as landing
from gears3d.laws.orbit import loss_phases as loss_phases
from gears3d.laws.orbit import regions as regions
from gears3d.renamed import module_of, renamed_in

_RENAMED = {"cycle": "orbit", "immersion": "drag", "oil": "film", "plastic": "orbit", "restitution": "contact"}


def __getattr__(name: str) -> Any:
    """Load a module or a class by its old name, and warn."""
    return (
        renamed_in(__name__, {"Swing": "SineDrive"}, name) if name == "Swing" else module_of(__name__, _RENAMED, name)
    )

"""Laws from measured data: parameters with their intervals, and how well they predict what they were not fitted to.

Names are loaded on first use: a coast-down needs neither the statistics of restitution nor compiled kernels.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gears3d.identify.assemblies import Run as Run
    from gears3d.identify.assemblies import identify_assemblies as identify_assemblies
    from gears3d.identify.assemblies import identify_mesh_drag as identify_mesh_drag
    from gears3d.identify.campaign import Campaign as Campaign
    from gears3d.identify.campaign import is_campaign as is_campaign
    from gears3d.identify.campaign import read_campaign as read_campaign
    from gears3d.identify.coastdown import identify_coastdown as identify_coastdown
    from gears3d.identify.coastdown import identify_rundown as identify_rundown
    from gears3d.identify.coastdown_record import Track as Track
    from gears3d.identify.coastdown_record import make_track as make_track
    from gears3d.identify.coastdown_record import make_tracks as make_tracks
    from gears3d.identify.coastdown_record import read_track as read_track
    from gears3d.identify.coastdown_record import read_tracks as read_tracks
    from gears3d.identify.contact import read_contacts as read_contacts
    from gears3d.identify.law import Identified as Identified
    from gears3d.identify.law import Parameter as Parameter
    from gears3d.identify.orders import Line as Line
    from gears3d.identify.parts import Inertia as Inertia
    from gears3d.identify.parts import Share as Share
    from gears3d.identify.pictures import orders_picture as orders_picture
    from gears3d.identify.pictures import picture_of as picture_of
    from gears3d.identify.pictures import restitution_picture as restitution_picture
    from gears3d.identify.pictures import rundown_picture as rundown_picture
    from gears3d.identify.pictures import threshold_picture as threshold_picture
    from gears3d.identify.restitution import identify_restitution as identify_restitution
    from gears3d.identify.restitution_list import ImpactList as ImpactList
    from gears3d.identify.restitution_list import identify_restitution_list as identify_restitution_list
    from gears3d.identify.rolling import roll as roll
    from gears3d.identify.threshold import Sweep as Sweep
    from gears3d.identify.threshold import identify_threshold as identify_threshold
    from gears3d.identify.transmission import identify_backlash as identify_backlash
    from gears3d.identify.transmission import identify_transmission_error as identify_transmission_error
    from gears3d.identify.transmission import transmission_error as transmission_error
    from gears3d.identify.trend import Oil as Oil

_HOME = {
    "Campaign": "campaign",
    "Identified": "law",
    "ImpactList": "restitution_list",
    "Inertia": "parts",
    "Line": "orders",
    "Oil": "trend",
    "Parameter": "law",
    "Run": "assemblies",
    "Share": "parts",
    "Sweep": "threshold",
    "Track": "coastdown_record",
    "identify_assemblies": "assemblies",
    "identify_backlash": "transmission",
    "identify_mesh_drag": "assemblies",
    "identify_restitution": "restitution",
    "identify_coastdown": "coastdown",
    "identify_rundown": "coastdown",
    "identify_restitution_list": "restitution_list",
    "identify_threshold": "threshold",
    "identify_transmission_error": "transmission",
    "is_campaign": "campaign",
    "orders_picture": "pictures",
    "picture_of": "pictures",
    "read_campaign": "campaign",
    "read_contacts": "contact",
    "restitution_picture": "pictures",
    "make_track": "coastdown_record",
    "make_tracks": "coastdown_record",
    "read_track": "coastdown_record",
    "read_tracks": "coastdown_record",
    "roll": "rolling",
    "rundown_picture": "pictures",
    "threshold_picture": "pictures",
    "transmission_error": "transmission",
}


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)

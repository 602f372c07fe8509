"""Results of bare arrays of impacts and displacement: regime, period, section, energies, durations."""

from __future__ import annotations

from typing import Any

from gears3d.renamed import renamed_in
from gears3d.signals.impacts import FLIGHT_HEIGHT_MIN as FLIGHT_HEIGHT_MIN
from gears3d.signals.impacts import Flights as Flights
from gears3d.signals.impacts import contacts as contacts
from gears3d.signals.impacts import durations as durations
from gears3d.signals.impacts import flights as flights
from gears3d.signals.impacts import impact_values as impact_values
from gears3d.signals.impacts import impacts_per_period as impacts_per_period
from gears3d.signals.impacts import mass as mass
from gears3d.signals.impacts import powers as powers
from gears3d.signals.impacts import regime as regime
from gears3d.signals.impacts import shares as shares
from gears3d.signals.impacts import states as states
from gears3d.signals.impacts import stroke as stroke
from gears3d.signals.impacts import times_of as times_of
from gears3d.signals.motion import Exponent as Exponent
from gears3d.signals.motion import Motion as Motion
from gears3d.signals.motion import exponent as exponent
from gears3d.signals.motion import motion as motion
from gears3d.signals.motion import on_closed_curve as on_closed_curve
from gears3d.signals.motion import periodicity as periodicity
from gears3d.signals.motion import return_map as return_map
from gears3d.signals.motion import section as section
from gears3d.signals.motion import stroboscope as stroboscope
from gears3d.signals.motion import widest_phase as widest_phase
from gears3d.signals.noise import Edges as Edges
from gears3d.signals.noise import changes as changes
from gears3d.signals.noise import content as content
from gears3d.signals.noise import count_of as count_of
from gears3d.signals.noise import edges as edges
from gears3d.signals.noise import local_slope as local_slope
from gears3d.signals.noise import noise_of as noise_of
from gears3d.signals.noise import quantum as quantum
from gears3d.signals.noise import robust_deviation as robust_deviation
from gears3d.signals.noise import some_steps as some_steps
from gears3d.signals.outcome import contacts_of as contacts_of
from gears3d.signals.outcome import counted as counted
from gears3d.signals.outcome import describe as describe
from gears3d.signals.outcome import drive_speed as drive_speed
from gears3d.signals.outcome import equivalent_mass as equivalent_mass
from gears3d.signals.outcome import window as window
from gears3d.signals.sound import MODES as MODES
from gears3d.signals.sound import Mode as Mode
from gears3d.signals.sound import normalised as normalised
from gears3d.signals.sound import ring as ring
from gears3d.signals.spectra import Average as Average
from gears3d.signals.spectra import Spectrum as Spectrum
from gears3d.signals.spectra import frequency_spectrum as frequency_spectrum
from gears3d.signals.spectra import lines as lines
from gears3d.signals.spectra import order_spectrum as order_spectrum
from gears3d.signals.spectra import synchronous_average as synchronous_average


def __getattr__(name: str) -> Any:
    """Load a function by its old name, and warn."""
    return renamed_in(__name__, {"strikes": "impact_values"}, name)

"""What bare arrays of impacts and displacement say: regime, period, section, energies, durations."""

from gears3d.signals.flights import Flights as Flights
from gears3d.signals.flights import flights as flights
from gears3d.signals.flights import shares as shares
from gears3d.signals.flights import times_of as times_of
from gears3d.signals.motion import motion as motion
from gears3d.signals.outcome import contacts_of as contacts_of
from gears3d.signals.outcome import counted as counted
from gears3d.signals.outcome import describe as describe
from gears3d.signals.outcome import drive_speed as drive_speed
from gears3d.signals.outcome import equivalent_mass as equivalent_mass
from gears3d.signals.outcome import window as window
from gears3d.signals.pattern import FLIGHT_HEIGHT_MIN as FLIGHT_HEIGHT_MIN
from gears3d.signals.pattern import impacts_per_period as impacts_per_period
from gears3d.signals.pattern import regime as regime
from gears3d.signals.stays import contacts as contacts
from gears3d.signals.stays import durations as durations
from gears3d.signals.stays import states as states
from gears3d.signals.strikes import mass as mass
from gears3d.signals.strikes import powers as powers
from gears3d.signals.strikes import strikes as strikes
from gears3d.signals.strobe import periodicity as periodicity
from gears3d.signals.strobe import section as section
from gears3d.signals.stroke import stroke as stroke

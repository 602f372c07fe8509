"""What bare arrays of impacts and displacement say: regime, period, section, durations."""

from gears3d.signals.outcome import describe as describe
from gears3d.signals.outcome import window as window
from gears3d.signals.pattern import FLIGHT_HEIGHT_MIN as FLIGHT_HEIGHT_MIN
from gears3d.signals.pattern import impacts_per_period as impacts_per_period
from gears3d.signals.pattern import regime as regime
from gears3d.signals.stays import durations as durations
from gears3d.signals.stays import states as states
from gears3d.signals.strobe import periodicity as periodicity
from gears3d.signals.strobe import section as section

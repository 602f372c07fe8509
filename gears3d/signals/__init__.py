"""What bare arrays of impacts and displacement say: regime, period, section, durations."""

from gears3d.signals.describe import describe as describe
from gears3d.signals.describe import window as window
from gears3d.signals.durations import durations as durations
from gears3d.signals.durations import states as states
from gears3d.signals.periodicity import periodicity as periodicity
from gears3d.signals.periodicity import section as section
from gears3d.signals.regime import FLIGHT_HEIGHT_MIN as FLIGHT_HEIGHT_MIN
from gears3d.signals.regime import impacts_per_period as impacts_per_period
from gears3d.signals.regime import regime as regime

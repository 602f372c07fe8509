"""Recordings of any source: signals on a time axis, a table of impacts, and metadata."""

from gears3d.recording.columns import ACTIVE as ACTIVE
from gears3d.recording.columns import FLANKS as FLANKS
from gears3d.recording.columns import IMPACT_UNITS as IMPACT_UNITS
from gears3d.recording.columns import REVERSE as REVERSE
from gears3d.recording.columns import SIGNAL_UNITS as SIGNAL_UNITS
from gears3d.recording.columns import Derived as Derived
from gears3d.recording.columns import unit_of as unit_of
from gears3d.recording.files import columns_of as columns_of
from gears3d.recording.record import Recording as Recording
from gears3d.recording.record import describe as describe
from gears3d.recording.record import read as read
from gears3d.recording.record import refuse_unexplained as refuse_unexplained
from gears3d.recording.record import settled as settled
from gears3d.recording.record import spectra as spectra
from gears3d.recording.sound import levels as levels
from gears3d.recording.sound import write_wav as write_wav
from gears3d.recording.streaming import excerpt as excerpt
from gears3d.recording.text import read_csv as read_csv

"""Files as test benches write them, read into channels of the contract's names and units, unchecked."""

from gears3d.readers.channels import Channels as Channels
from gears3d.readers.channels import read as read
from gears3d.readers.formats import open_source as open_source
from gears3d.readers.guess import propose as propose
from gears3d.readers.maps import files_of as files_of
from gears3d.readers.plugged import Reader as Reader
from gears3d.readers.source import Signal as Signal
from gears3d.readers.source import Source as Source

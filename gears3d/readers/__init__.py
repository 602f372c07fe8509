"""Files as test benches write them, read into channels of the contract's names and units, unchecked."""

from gears3d.readers.channels import Channels as Channels
from gears3d.readers.channels import read as read

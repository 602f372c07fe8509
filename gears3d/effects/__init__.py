"""The causes that extend the base model, one file each; see :mod:`gears3d.effects.base`."""

from gears3d.effects.base import Effect as Effect
from gears3d.effects.base import Param as Param
from gears3d.effects.base import Rig as Rig
from gears3d.effects.base import SensorEffect as SensorEffect
from gears3d.effects.base import catalogue as catalogue
from gears3d.effects.base import register as register
from gears3d.effects.rows import Code as Code
from gears3d.effects.rows import Flank as Flank
from gears3d.effects.rows import Gate as Gate
from gears3d.effects.rows import Gear as Gear
from gears3d.effects.rows import Row as Row
from gears3d.effects.rows import Variable as Variable
from gears3d.effects.rows import torque_table as torque_table

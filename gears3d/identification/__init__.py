"""Laws from measured data: parameters with their intervals, and how well they predict what they were not fitted to."""

from gears3d.identification.drawing import write_picture as write_picture
from gears3d.identification.law import Identified as Identified
from gears3d.identification.law import Parameter as Parameter
from gears3d.identification.rundown import identify_rundown as identify_rundown

"""One recording held against another: impact by impact, or as samples of one distribution."""

from gears3d.comparison.against import compare as compare
from gears3d.comparison.drawing import picture as picture
from gears3d.comparison.drawing import write_picture as write_picture
from gears3d.comparison.result import KEYS as KEYS
from gears3d.comparison.result import Comparison as Comparison
from gears3d.comparison.result import SampleTest as SampleTest

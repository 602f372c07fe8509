"""The signals of a recording and their analysis in one picture."""

from gears3d.views.signals.drawing import picture as picture
from gears3d.views.signals.drawing import write_picture as write_picture

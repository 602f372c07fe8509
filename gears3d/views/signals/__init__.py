"""What a recording says of itself, as one picture."""

from gears3d.views.signals.drawing import picture as picture
from gears3d.views.signals.drawing import write_picture as write_picture

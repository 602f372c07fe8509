"""The law of restitution from measured impacts: e over the speed of approach, by flank, with scatter."""

from gears3d.identify.restitution.drawing import restitution_picture as restitution_picture
from gears3d.identify.restitution.identify import identify_restitution as identify_restitution

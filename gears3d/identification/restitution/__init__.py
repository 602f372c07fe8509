"""The law of restitution from measured impacts: e over the speed of approach, by flank, with scatter."""

from gears3d.identification.restitution.drawing import write_restitution as write_restitution
from gears3d.identification.restitution.identify import identify_restitution as identify_restitution

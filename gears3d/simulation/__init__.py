"""From a scenario to a recording: picks the model, then lets the sensors look."""

from gears3d.simulation.models import MODELS as MODELS
from gears3d.simulation.models import simulate as simulate

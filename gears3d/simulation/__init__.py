"""From a scenario to a recording: picks the model, then lets the sensors look; synthetic records of a test bench."""

from gears3d.simulation.excitation import assess as assess
from gears3d.simulation.models import ABOUT as ABOUT
from gears3d.simulation.models import MODELS as MODELS
from gears3d.simulation.models import refusals as refusals
from gears3d.simulation.models import simulate as simulate
from gears3d.simulation.models import stream as stream
from gears3d.simulation.recorder import record as record
from gears3d.simulation.recorder import synthesize as synthesize
from gears3d.simulation.sensors import encode as encode

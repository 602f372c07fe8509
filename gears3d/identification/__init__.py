"""Laws from measured data: parameters with their intervals, and how well they predict what they were not fitted to."""

from gears3d.identification.assemblies import Run as Run
from gears3d.identification.assemblies import identify_assemblies as identify_assemblies
from gears3d.identification.assemblies import identify_mesh_drag as identify_mesh_drag
from gears3d.identification.backlash import identify_backlash as identify_backlash
from gears3d.identification.campaign import Campaign as Campaign
from gears3d.identification.campaign import read_campaign as read_campaign
from gears3d.identification.drawing import rundown_picture as rundown_picture
from gears3d.identification.law import Identified as Identified
from gears3d.identification.law import Parameter as Parameter
from gears3d.identification.order_drawing import orders_picture as orders_picture
from gears3d.identification.parts import Inertia as Inertia
from gears3d.identification.restitution import identify_restitution as identify_restitution
from gears3d.identification.restitution import restitution_picture as restitution_picture
from gears3d.identification.rundown import identify_rundown as identify_rundown
from gears3d.identification.threshold import Sweep as Sweep
from gears3d.identification.threshold import identify_threshold as identify_threshold
from gears3d.identification.threshold_drawing import threshold_picture as threshold_picture
from gears3d.identification.track import read_track as read_track
from gears3d.identification.track import read_tracks as read_tracks
from gears3d.identification.transmission import identify_transmission_error as identify_transmission_error

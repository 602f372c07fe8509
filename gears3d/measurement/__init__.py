"""Measured records: displacement and its noise, flanks, flights and contacts, each known as well as it says."""

from gears3d.measurement.drive import steady as steady
from gears3d.measurement.flanks import Flanks as Flanks
from gears3d.measurement.measured import Measurement as Measurement
from gears3d.measurement.measured import measure as measure
from gears3d.measurement.measured import path_of as path_of
from gears3d.measurement.measured import segments_of as segments_of
from gears3d.measurement.parabolas import Parabolas as Parabolas
from gears3d.measurement.parabolas import common_law as common_law
from gears3d.measurement.readings import Reading as Reading
from gears3d.measurement.readings import read_encoder as read_encoder
from gears3d.measurement.segments import alike as alike
from gears3d.measurement.segments import doubtful as doubtful
from gears3d.measurement.segments import segment as segment
from gears3d.measurement.smoothing import Track as Track
from gears3d.measurement.smoothing import track as track
from gears3d.measurement.tables import Segments as Segments
from gears3d.measurement.terms import Terms as Terms
from gears3d.measurement.terms import make_terms as make_terms
from gears3d.measurement.touching import contact_orders as contact_orders

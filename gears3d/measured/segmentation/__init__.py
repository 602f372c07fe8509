"""Measured records: displacement and its noise, flanks, flights and contacts, each with its uncertainty."""

from gears3d.measured.drive_motion import steady as steady
from gears3d.measured.encoder import Reading as Reading
from gears3d.measured.encoder import read_encoder as read_encoder
from gears3d.measured.segmentation.displacement import Track as Track
from gears3d.measured.segmentation.displacement import track as track
from gears3d.measured.segmentation.flanks import Flanks as Flanks
from gears3d.measured.segmentation.flanks import Terms as Terms
from gears3d.measured.segmentation.flanks import make_terms as make_terms
from gears3d.measured.segmentation.measured import measure as measure
from gears3d.measured.segmentation.measured import path_of as path_of
from gears3d.measured.segmentation.measured import segments_of as segments_of
from gears3d.measured.segmentation.parabolas import Parabolas as Parabolas
from gears3d.measured.segmentation.parabolas import common_law as common_law
from gears3d.measured.segmentation.results import Explanation as Explanation
from gears3d.measured.segmentation.results import Measurement as Measurement
from gears3d.measured.segmentation.results import NotExplained as NotExplained
from gears3d.measured.segmentation.results import Segments as Segments
from gears3d.measured.segmentation.results import contact_orders as contact_orders
from gears3d.measured.segmentation.results import explain as explain
from gears3d.measured.segmentation.segments import alike as alike
from gears3d.measured.segmentation.segments import doubtful as doubtful
from gears3d.measured.segmentation.segments import segment as segment

"""Decoders of raw encoder and toothed-wheel channels into angles, with notes on the faults found."""

from gears3d.measured.readers.decode.encoders import Counted as Counted
from gears3d.measured.readers.decode.encoders import counted as counted
from gears3d.measured.readers.decode.encoders import counter as counter
from gears3d.measured.readers.decode.encoders import indexed as indexed
from gears3d.measured.readers.decode.encoders import quadrature as quadrature
from gears3d.measured.readers.decode.encoders import wrapped_angle as wrapped_angle
from gears3d.measured.readers.decode.pulses import Common as Common
from gears3d.measured.readers.decode.pulses import Spacing as Spacing
from gears3d.measured.readers.decode.pulses import common_axis as common_axis
from gears3d.measured.readers.decode.pulses import evened as evened
from gears3d.measured.readers.decode.pulses import integrated as integrated
from gears3d.measured.readers.decode.pulses import on_grid as on_grid
from gears3d.measured.readers.decode.pulses import pulses as pulses
from gears3d.measured.readers.decode.pulses import spacing as spacing
from gears3d.measured.readers.decode.pulses import stamped as stamped
from gears3d.measured.readers.decode.pulses import tacho as tacho
from gears3d.measured.readers.decode.switches import Angle as Angle
from gears3d.measured.readers.decode.switches import Edges as Edges
from gears3d.measured.readers.decode.switches import Even as Even
from gears3d.measured.readers.decode.switches import Levels as Levels
from gears3d.measured.readers.decode.switches import Note as Note
from gears3d.measured.readers.decode.switches import Switches as Switches
from gears3d.measured.readers.decode.switches import levels as levels
from gears3d.measured.readers.decode.switches import switches as switches

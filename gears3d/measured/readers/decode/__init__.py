"""Decoders of raw encoder and toothed-wheel channels into angles, with notes on the faults found."""

from gears3d.measured.readers.decode.counters import counter as counter
from gears3d.measured.readers.decode.counters import wrapped_angle as wrapped_angle
from gears3d.measured.readers.decode.index import indexed as indexed
from gears3d.measured.readers.decode.quadrature import Counted as Counted
from gears3d.measured.readers.decode.quadrature import counted as counted
from gears3d.measured.readers.decode.quadrature import quadrature as quadrature
from gears3d.measured.readers.decode.results import Angle as Angle
from gears3d.measured.readers.decode.results import Edges as Edges
from gears3d.measured.readers.decode.results import Even as Even
from gears3d.measured.readers.decode.results import Note as Note
from gears3d.measured.readers.decode.speed import integrated as integrated
from gears3d.measured.readers.decode.stamps import Common as Common
from gears3d.measured.readers.decode.stamps import common_axis as common_axis
from gears3d.measured.readers.decode.stamps import on_grid as on_grid
from gears3d.measured.readers.decode.stamps import stamped as stamped
from gears3d.measured.readers.decode.switches import Levels as Levels
from gears3d.measured.readers.decode.switches import Switches as Switches
from gears3d.measured.readers.decode.switches import levels as levels
from gears3d.measured.readers.decode.switches import switches as switches
from gears3d.measured.readers.decode.tacho import Spacing as Spacing
from gears3d.measured.readers.decode.tacho import evened as evened
from gears3d.measured.readers.decode.tacho import pulses as pulses
from gears3d.measured.readers.decode.tacho import spacing as spacing
from gears3d.measured.readers.decode.tacho import tacho as tacho

"""The virtual bench: tests that a rig is put through, run in the 3D engine and evaluated as on a bench."""

from gears3d.bench.coasting import Rundown as Rundown
from gears3d.bench.coasting import rundown as rundown
from gears3d.bench.drawing import drop_picture as drop_picture
from gears3d.bench.drawing import static_picture as static_picture
from gears3d.bench.drawing import threshold_picture as threshold_picture
from gears3d.bench.drop import Drops as Drops
from gears3d.bench.drop import drops as drops
from gears3d.bench.ste import StaticError as StaticError
from gears3d.bench.ste import static_error as static_error
from gears3d.bench.threshold import Sweep as Sweep
from gears3d.bench.threshold import Thresholds as Thresholds
from gears3d.bench.threshold import predicted as predicted
from gears3d.bench.threshold import thresholds as thresholds

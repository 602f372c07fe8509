"""The virtual bench: tests that a rig is put through, run in the 3D engine and evaluated as on a bench."""

from gears3d.bench.ste import StaticError as StaticError
from gears3d.bench.ste import static_error as static_error

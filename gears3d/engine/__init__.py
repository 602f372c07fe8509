"""Both gears as rigid bodies in PyBullet, with contact located on the true flanks or left to Bullet."""

from gears3d.engine.run import bodies as bodies
from gears3d.engine.run import prepared as prepared
from gears3d.engine.run import simulate as simulate
from gears3d.engine.single_steps import Bench as Bench
from gears3d.engine.streaming import stream as stream
from gears3d.engine.world import Body as Body

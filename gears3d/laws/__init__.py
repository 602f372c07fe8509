"""The field's closed forms, one function an equation."""

from gears3d.laws import film as film
from gears3d.laws.orbit import Landing as Landing
from gears3d.laws.orbit import Swing as Swing
from gears3d.laws.orbit import drift as drift
from gears3d.laws.orbit import landing as landing
from gears3d.laws.plastic import crossing as crossing
from gears3d.laws.plastic import loss_phases as loss_phases

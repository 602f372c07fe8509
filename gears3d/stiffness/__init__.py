"""Compliance of teeth: potential energy of tooth, body and contact, slices over the face, pairs in contact, harmonics.

Knows gears, no scenario and no effect. Everything is linear: a stiffness is that of teeth which already touch all along
their line of contact, as they do under a nominal load.
"""

from gears3d.stiffness.mesh import MeshStiffness as MeshStiffness
from gears3d.stiffness.mesh import contact_path as contact_path
from gears3d.stiffness.mesh import harmonics as harmonics
from gears3d.stiffness.mesh import iso_mesh_stiffness as iso_mesh_stiffness
from gears3d.stiffness.mesh import iso_single_stiffness as iso_single_stiffness
from gears3d.stiffness.mesh import mesh_stiffness as mesh_stiffness
from gears3d.stiffness.mesh import pair_stiffness as pair_stiffness
from gears3d.stiffness.tooth import STEEL as STEEL
from gears3d.stiffness.tooth import Beam as Beam
from gears3d.stiffness.tooth import Compliance as Compliance
from gears3d.stiffness.tooth import Material as Material
from gears3d.stiffness.tooth import bend as bend
from gears3d.stiffness.tooth import foundation as foundation
from gears3d.stiffness.tooth import tooth_compliance as tooth_compliance

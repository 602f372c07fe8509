"""The sensor gate: what is wrong with the encoders and the file, before anything is said of the gears."""

from gears3d.gate.admission import Admitted as Admitted
from gears3d.gate.admission import admit as admit
from gears3d.gate.finding import Finding as Finding

"""Diagnosis: what a simulation gets wrong of measured records, the cause, the extended rig, and the gain."""

from gears3d.diagnosis.candidates import Candidate as Candidate
from gears3d.diagnosis.cause import begin as begin
from gears3d.diagnosis.cause import contribution as contribution
from gears3d.diagnosis.channels import BINS as BINS
from gears3d.diagnosis.channels import Contacts as Contacts
from gears3d.diagnosis.channels import Corners as Corners
from gears3d.diagnosis.channels import Drive as Drive
from gears3d.diagnosis.channels import Partings as Partings
from gears3d.diagnosis.diagnosis import Diagnosis as Diagnosis
from gears3d.diagnosis.diagnosis import diagnose as diagnose
from gears3d.diagnosis.evidence import uncut as uncut
from gears3d.diagnosis.extending import extended_text as extended_text
from gears3d.diagnosis.freed import in_units as in_units
from gears3d.diagnosis.placing import pulled as pulled
from gears3d.diagnosis.prediction import CHANNELS as CHANNELS
from gears3d.diagnosis.prediction import added as added
from gears3d.diagnosis.prediction import bend as bend
from gears3d.diagnosis.prediction import impact_sigma as impact_sigma
from gears3d.diagnosis.prediction import loss_sigma as loss_sigma
from gears3d.diagnosis.prediction import residuals as residuals
from gears3d.diagnosis.prediction import rms_of as rms_of
from gears3d.diagnosis.prediction import without as without
from gears3d.diagnosis.readied import ready as ready
from gears3d.diagnosis.resonance import Resonance as Resonance
from gears3d.diagnosis.search import Search as Search
from gears3d.diagnosis.structure import Structure as Structure

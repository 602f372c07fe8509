"""Diagnosis: what a simulation gets wrong of measured records, the cause, the extended rig, and the gain."""

from gears3d.diagnosis.causes import Candidate as Candidate
from gears3d.diagnosis.causes import begin as begin
from gears3d.diagnosis.causes import contribution as contribution
from gears3d.diagnosis.channels import BINS as BINS
from gears3d.diagnosis.channels import ContactEnds as ContactEnds
from gears3d.diagnosis.channels import Contacts as Contacts
from gears3d.diagnosis.channels import Drive as Drive
from gears3d.diagnosis.channels import VelocityJumps as VelocityJumps
from gears3d.diagnosis.diagnosis import Diagnosis as Diagnosis
from gears3d.diagnosis.diagnosis import diagnose as diagnose
from gears3d.diagnosis.diagnosis import extended_text as extended_text
from gears3d.diagnosis.evidence import in_units as in_units
from gears3d.diagnosis.evidence import uncut as uncut
from gears3d.diagnosis.planner import MeasurementPlan as MeasurementPlan
from gears3d.diagnosis.planner import plan as plan
from gears3d.diagnosis.prediction import CHANNELS as CHANNELS
from gears3d.diagnosis.prediction import added as added
from gears3d.diagnosis.prediction import deceleration_response as deceleration_response
from gears3d.diagnosis.prediction import impact_sigma as impact_sigma
from gears3d.diagnosis.prediction import loss_sigma as loss_sigma
from gears3d.diagnosis.prediction import project_out as project_out
from gears3d.diagnosis.prediction import residuals as residuals
from gears3d.diagnosis.prediction import rms_of as rms_of
from gears3d.diagnosis.preprocessing import preprocess as preprocess
from gears3d.diagnosis.residual_patterns import Resonance as Resonance
from gears3d.diagnosis.residual_patterns import Structure as Structure
from gears3d.diagnosis.residual_patterns import gap_deceleration as gap_deceleration
from gears3d.diagnosis.search import Search as Search
from gears3d.renamed import renamed_in

_RENAMED = {
    "ready": "preprocess",
    "bend": "deceleration_response",
    "pulled": "gap_deceleration",
    "without": "project_out",
    "Corners": "VelocityJumps",
    "Partings": "ContactEnds",
}


def __getattr__(name: str) -> object:
    return renamed_in(__name__, _RENAMED, name)

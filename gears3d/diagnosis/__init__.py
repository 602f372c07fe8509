"""Diagnosis: what a simulation gets wrong of measured records, the cause, the extended rig, and the gain."""

from gears3d.diagnosis.diagnosis import Diagnosis as Diagnosis
from gears3d.diagnosis.diagnosis import diagnose as diagnose

"""Checks of gears3d against closed forms and independent codes, in chapters; a command prints them."""

from gears3d.verification.validation.agreement import SHAPES as SHAPES
from gears3d.verification.validation.agreement import along_action as along_action
from gears3d.verification.validation.check import CHAPTERS as CHAPTERS
from gears3d.verification.validation.check import Check as Check
from gears3d.verification.validation.check import chapters as chapters
from gears3d.verification.validation.check import fig5 as fig5
from gears3d.verification.validation.check import swing as swing
from gears3d.verification.validation.faults import closed_form as closed_form

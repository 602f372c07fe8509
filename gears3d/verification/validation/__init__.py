"""What gears3d claims of itself, measured: each claim is a function that a command prints and a test holds."""

from gears3d.verification.validation.agreement import SHAPES as SHAPES
from gears3d.verification.validation.agreement import along_action as along_action
from gears3d.verification.validation.bench import fig5 as fig5
from gears3d.verification.validation.bench import swing as swing
from gears3d.verification.validation.claim import CHAPTERS as CHAPTERS
from gears3d.verification.validation.claim import Claim as Claim
from gears3d.verification.validation.claim import chapters as chapters
from gears3d.verification.validation.faults import closed_form as closed_form

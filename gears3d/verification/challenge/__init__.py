"""Hidden effects: records of machines that differ from their rig, and the sealed answer."""

from gears3d.verification.challenge.causes import ASKED as ASKED
from gears3d.verification.challenge.causes import KINDS as KINDS
from gears3d.verification.challenge.causes import UNKNOWN as UNKNOWN
from gears3d.verification.challenge.hiding import Plan as Plan
from gears3d.verification.challenge.hiding import hide as hide
from gears3d.verification.challenge.hiding import observe as observe
from gears3d.verification.challenge.hiding import plan as plan
from gears3d.verification.challenge.motion import happen as happen
from gears3d.verification.challenge.scoring import reveal as reveal
from gears3d.verification.challenge.scoring import score as score

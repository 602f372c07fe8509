"""What gears3d claims of itself, measured: each claim is a function that a command prints and a test holds."""

from gears3d.validation.claim import Claim as Claim
from gears3d.validation.claim import chapters as chapters

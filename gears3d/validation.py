"""Old name of ``gears3d.verification.validation``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.verification.validation", __name__, {"Claim": "Check"})

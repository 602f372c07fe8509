"""Old name of ``gears3d.verification.challenge``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.verification.challenge", __name__)

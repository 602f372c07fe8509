"""Old name of ``gears3d.verification.papers``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.verification.papers", __name__)

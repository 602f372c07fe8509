"""Old name of ``gears3d.measured.checks``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.measured.checks", __name__)

"""Old name of ``gears3d.identify``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.identify", __name__)

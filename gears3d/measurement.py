"""Old name of ``gears3d.measured.segmentation``."""

from gears3d.renamed import names_of

__getattr__ = names_of("gears3d.measured.segmentation", __name__)

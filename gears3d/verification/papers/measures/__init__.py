"""The measures that published rows share, by subject; a row names one and reduces its values."""

from gears3d.verification.papers.measures import geometry as geometry
from gears3d.verification.papers.measures import oil as oil
from gears3d.verification.papers.measures import responses as responses
from gears3d.verification.papers.measures import tooth_errors as tooth_errors
from gears3d.verification.papers.measures.registry import MEASURES as MEASURES
from gears3d.verification.papers.measures.registry import REDUCTIONS as REDUCTIONS

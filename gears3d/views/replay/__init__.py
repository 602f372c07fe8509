"""A recording as an animation for the rerun viewer; the only package that imports rerun."""

from gears3d.views.replay.document import replay as replay

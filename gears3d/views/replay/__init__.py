"""A recording as a film for the rerun viewer; the only room that knows rerun."""

from gears3d.views.replay.document import replay as replay

"""The report of a run: one self-contained, interactive HTML page."""

from gears3d.views.report.page import Picture as Picture
from gears3d.views.report.page import render as render
from gears3d.views.report.page import write as write

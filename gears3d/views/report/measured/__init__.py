"""The report of a measured record: sensors first, then path, impacts, flights, flanks, and what was not seen."""

from gears3d.views.report.measured.page import render as render
from gears3d.views.report.measured.page import write as write
from gears3d.views.report.measured.spectrum import orders_told as orders_told
from gears3d.views.report.measured.story import durations as durations

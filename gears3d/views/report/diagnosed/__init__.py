"""The report of a diagnosis: what a rig gets wrong of measured records, why, and what mending it is worth."""

from gears3d.views.report.diagnosed.page import render as render
from gears3d.views.report.diagnosed.page import write as write

"""The report of a diagnosis: deviations of records from the nominal model, causes, held-out error reduction."""

from gears3d.views.report.diagnosed.page import render as render
from gears3d.views.report.diagnosed.page import write as write

"""The data sheet of a pair as rows for people and programs, and the mesh as a drawing."""

from __future__ import annotations

from gears3d.views.sheet.data import DataSheet as DataSheet
from gears3d.views.sheet.data import data_sheet_of as data_sheet_of
from gears3d.views.sheet.drawing import drawing as drawing
from gears3d.views.sheet.drawing import write_drawing as write_drawing
from gears3d.views.sheet.rows import rows as rows
from gears3d.views.sheet.rows import tables as tables

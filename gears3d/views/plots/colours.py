"""The palette as the replay takes it: red, green, blue, and what stands on its dark ground."""

from __future__ import annotations

from gears3d import palette

FLANKS = tuple(palette.rgb(colour) for colour in palette.FLANKS)
"""By the code of the flank in a recording."""
FLIGHT, TWIN, EXTENDED, FOURTH = map(palette.rgb, (palette.FLIGHT, palette.TWIN, palette.EXTENDED, palette.FOURTH))
DRIVE, LOOSE, MARK = (0x8A, 0x94, 0xA0), (0xCF, 0xC6, 0xB2), (0x30, 0x34, 0x3A)
"""Solids in the light of a scene, and the mark on them."""
LINE = (0xF0, 0xF0, 0xF0)
"""Measured quantities on the dark plots."""

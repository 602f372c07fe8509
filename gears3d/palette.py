"""Colours of every picture and page, safe for colour-blind readers."""

from __future__ import annotations

# Active flank: blue; reverse flank: vermilion.
ACTIVE, REVERSE = "#0072B2", "#D55E00"
# By the code of the flank in a recording.
FLANKS = (ACTIVE, REVERSE)
# Neither flank: grey.
FLIGHT = "#999999"
# Rigid model, and a nominal model that is compared with a record: pink.
TWIN = "#CC79A7"
# The rig with the reported causes, and what a paper printed: bluish green.
EXTENDED = "#009E73"
# A fourth line, in addition to white, pink and green: yellow.
FOURTH = "#F0E442"
# Marks that are no data, lines of data, and text of less weight.
NEUTRAL, INK, SOFT = "#777777", "#1c1f24", "#555555"
# 95 % band of a law.
BAND = "#9ecae1"
# Parts of a law.
PARTS = (REVERSE, EXTENDED, TWIN, "#E69F00", "#56B4E9")
# Contact, single-sided, double-sided impacts, and no closed form.
REGIMES = ("#dddddd", "#56B4E9", "#E69F00", "#bdbdbd")
# Bodies of both gears in section, and their outlines.
DRIVE, LOOSE, EDGE = "#B9C7D6", "#E3DAC6", "#2f3338"


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour as three numbers from 0 to 255.

    Args:
        colour: as ``#rrggbb``.

    >>> rgb(ACTIVE)
    (0, 114, 178)
    """
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue

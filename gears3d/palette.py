"""Colours of every picture and page, safe for colour-blind readers."""

from __future__ import annotations

ACTIVE, REVERSE = "#0072B2", "#D55E00"
"""Active flank: blue; reverse flank: vermilion."""
FLANKS = (ACTIVE, REVERSE)
"""By the code of the flank in a recording."""
FLIGHT = "#999999"
"""Neither flank: grey."""
TWIN = "#CC79A7"
"""Rigid model, and a nominal model that is compared with a record: pink."""
EXTENDED = "#009E73"
"""The rig with the reported causes, and what a paper printed: bluish green."""
FOURTH = "#F0E442"
"""A fourth line, in addition to white, pink and green: yellow."""
NEUTRAL, INK, SOFT = "#777777", "#1c1f24", "#555555"
"""Marks that are no data, lines of data, and text of less weight."""
BAND = "#9ecae1"
"""95 % band of a law."""
PARTS = (REVERSE, EXTENDED, TWIN, "#E69F00", "#56B4E9")
"""Parts of a law."""
REGIMES = ("#dddddd", "#56B4E9", "#E69F00", "#bdbdbd")
"""Contact, single-sided, double-sided impacts, and no closed form."""
DRIVE, LOOSE, EDGE = "#B9C7D6", "#E3DAC6", "#2f3338"
"""Bodies of both gears in section, and their outlines."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return a colour as three numbers from 0 to 255.

    Args:
        colour: as ``#rrggbb``.

    >>> rgb(ACTIVE)
    (0, 114, 178)
    """
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue

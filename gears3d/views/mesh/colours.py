"""The colours of the replay: one code for the flanks everywhere, safe for colour-blind readers."""

from __future__ import annotations

ACTIVE = (0x00, 0x72, 0xB2)
"""Active flank: blue."""
REVERSE = (0xD5, 0x5E, 0x00)
"""Reverse flank: vermilion."""
FLIGHT = (0x99, 0x99, 0x99)
"""Neither: grey."""
TWIN = (0xCC, 0x79, 0xA7)
"""Line of the rigid model, and of a nominal model that is compared with a record."""
EXTENDED = (0x00, 0x9E, 0x73)
"""The rig with the causes that were found: bluish green."""
FOURTH = (0xF0, 0xE4, 0x42)
"""A fourth line, in addition to white, pink and green: yellow."""
DRIVE = (0x8A, 0x94, 0xA0)
LOOSE = (0xCF, 0xC6, 0xB2)
MARK = (0x30, 0x34, 0x3A)
LINE = (0xF0, 0xF0, 0xF0)
"""Measured quantities on the dark plots."""

FLANKS = (ACTIVE, REVERSE)
"""By the code of the flank in a recording."""

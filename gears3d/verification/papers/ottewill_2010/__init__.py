"""Ottewill, Neild & Wilson 2010: tooth errors that decide whether an idling pair rattles."""

from gears3d.verification.papers.ottewill_2010 import drawings, measured, rattle

CITATION = (
    "J. R. Ottewill, S. A. Neild, R. E. Wilson: An investigation into the effect of tooth profile errors on gear "
    "rattle. Journal of Sound and Vibration 329 (2010) 3495-3506"
)
CONTENTS = (
    "section 2", "eq. (12)", "fig. 1", "fig. 2", "fig. 3", "fig. 4", "fig. 5", "fig. 6", "fig. 7", "fig. 8", "fig. 9",
    "fig. 10", "section 6",
)  # fmt: skip
CLAIMS = (*measured.CLAIMS, *rattle.CLAIMS)
FIGURES = drawings.FIGURES
EXCUSED = {"fig. 1": "photograph of the rig", "fig. 2": "drawing of the model"}

"""Kadmiri, Rigaud, Perret-Liaudet & Vary 2012: an automotive gearbox with encoders inside."""

from gears3d.verification.papers.kadmiri_2012 import drawings, impacts, rattle, rundowns, table1

CITATION = (
    "Y. Kadmiri, E. Rigaud, J. Perret-Liaudet, L. Vary: Experimental and numerical analysis of automotive gearbox "
    "rattle noise. Journal of Sound and Vibration 331 (2012) 3144-3157"
)
CONTENTS = (
    "table 1", "section 3.1", "fig. 1", "fig. 2", "fig. 3", "fig. 4", "fig. 5", "fig. 6", "fig. 7", "fig. 8", "fig. 9",
    "fig. 10", "fig. 11", "fig. 12", "fig. 13", "fig. 14", "fig. 15", "fig. 16",
)  # fmt: skip
CLAIMS = (*table1.CLAIMS, *impacts.CLAIMS, *rundowns.CLAIMS, *rattle.CLAIMS)
FIGURES = drawings.FIGURES
EXCUSED = {
    "fig. 1": "drawing of the gearbox",
    "fig. 2": "drawing of the bench",
    "fig. 3": "drawing of the pin-on-disc device; what it measured stands under section 3.1",
    "fig. 4": "trace of the pin without numbers in the text",
    "fig. 5": "trace that shows how impacts are told apart by the sign of their velocity; the same as in fig. 13",
    "fig. 11": "drawing of the model",
}

"""Rigaud & Perret-Liaudet 2020: a reverse pair that rattles before a high-speed camera."""

from gears3d.papers.rigaud_2020 import table1

CITATION = (
    "E. Rigaud, J. Perret-Liaudet: Investigation of gear rattle noise including visualization of vibro-impact regimes. "
    "Journal of Sound and Vibration 467 (2020) 115026"
)
CONTENTS = ("table 1", "fig. 1")
CLAIMS = (*table1.CLAIMS,)
FIGURES = ()
EXCUSED = {"fig. 1": "photograph of the bench"}

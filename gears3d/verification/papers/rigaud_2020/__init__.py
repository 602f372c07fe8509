"""Rigaud & Perret-Liaudet 2020: a reverse pair that rattles before a high-speed camera."""

from gears3d.verification.papers.rigaud_2020 import camera, energy, flanks, regimes, table1, theory, threshold
from gears3d.verification.papers.rigaud_2020.figures import FIGURES as FIGURES

CITATION = (
    "E. Rigaud, J. Perret-Liaudet: Investigation of gear rattle noise including visualization of vibro-impact regimes. "
    "Journal of Sound and Vibration 467 (2020) 115026"
)
CONTENTS = ("table 1", *(f"fig. {number}" for number in range(1, 14)))
CLAIMS = (
    *table1.CLAIMS,
    *flanks.CLAIMS,
    *threshold.CLAIMS,
    *regimes.CLAIMS,
    *energy.CLAIMS,
    *camera.CLAIMS,
    *theory.CLAIMS,
    *energy.SOUND,
)
EXCUSED = {
    "fig. 1": "photograph of the bench",
    "fig. 9": "sketch of the model, which is the rigid model that every row above runs",
}

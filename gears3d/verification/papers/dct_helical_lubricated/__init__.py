"""Nonlinear rattle of a lubricated helical pair of a dual-clutch transmission."""

from gears3d.verification.papers.dct_helical_lubricated import drawings, regimes, trends

CITATION = (
    "Nonlinear gear rattle of a lubricated helical pair of a dual-clutch transmission: oil film, time-varying mesh "
    "stiffness, drag and friction (a paper whose copy at hand names no authors; geometry and inertia are not printed)"
)
CONTENTS = (
    *(f"fig. {number}" for number in range(1, 33)),
    "table 1", "table 2",
)  # fmt: skip
CLAIMS = (*regimes.CLAIMS, *trends.CLAIMS)
FIGURES = drawings.FIGURES
EXCUSED = {
    "fig. 1": "drawing of the model",
    "fig. 2": "drawing of the contact",
    "fig. 3": "drawing of the slices",
    "fig. 4": "mesh stiffness of a pair whose geometry is not printed",
    "fig. 5": "churning laws of others, without numbers in the text",
    "fig. 6": "drawing of the gear in oil",
    "fig. 7": "drawing of the squeezed areas",
    "fig. 9": "photograph of the bench",
    "fig. 10": "bench test of a whole gearbox, without numbers in the text",
    "table 1": "names of churning laws",
    "table 2": "data of the bench's motors",
}

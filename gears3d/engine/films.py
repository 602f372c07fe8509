"""Oil between the flanks: the force of a film over its thickness, in the engine's own code.

Source: the lubricated dual-clutch transmission, eqs (11)-(14); the flanks touch where the film is as thin as their
roughness permits.
"""

from __future__ import annotations

from collections.abc import Sequence

from gears3d.effects.rows import Code, Row
from gears3d.engine.compile import entry
from gears3d.errors import Fault, InputError
from gears3d.records import Record

WIDEST = 0.25  # largest height at which the film begins to act, as a part of the backlash
THINNEST = 1e-3  # smallest such height, in smallest thicknesses


class Film(Record):
    """A film of oil on both flanks; a smallest thickness of 0 stands for no film.

    Args:
        wedge: [N·s].
        squeeze: [N·s·√m].
        rolling_drive: radius at which the drive's flanks draw oil in [m].
        rolling_loose: the same of the loose gear [m].
        minimum: thickness at which the flanks touch [m].
        felt: gap over that below which the film counts as contact [m].
    """

    wedge: float
    squeeze: float
    rolling_drive: float
    rolling_loose: float
    minimum: float
    felt: float


NO_FILM = Film(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def film_of(rows: Sequence[Row], backlash: float) -> Film:
    """Return the film among the effects' rows; more than one, or one that fills the backlash [m], is an InputError.

    >>> from gears3d.effects.rows import gap_film
    >>> film_of([gap_film(1e-6, 1e-6, 0.01, 0.02, 2e-6, 12e-6)], 98e-6).felt
    1e-05
    >>> film_of([], 98e-6) is NO_FILM
    True
    """
    films = [row.p for row in rows if row.code == Code.GAP_FILM]
    if not films:
        return NO_FILM
    if len(films) > 1:
        raise InputError(Fault("effect", f"there are {len(films)} oil films between the flanks", "give one oil_film"))
    wedge, squeeze, drive, loose, minimum, felt = films[0]
    waves = sum(abs(row.p[3]) for row in rows if row.code == Code.FLANK_HARMONIC)
    if backlash <= 2.0 * minimum:
        text = f"the oil's smallest thickness of {minimum:.4g} m on both flanks fills the backlash"
        raise InputError(Fault("effect", text, "give more backlash or a smaller minimum_thickness"))
    felt = max(min(felt - minimum, WIDEST * (backlash - 2.0 * minimum - waves)), THINNEST * minimum)
    return Film(wedge, squeeze, drive, loose, minimum, felt)


@entry
def film_push(film: Film, gap: float, rate: float, squeezed: bool, speeds: tuple[float, float]) -> float:
    """Return the force with which a film separates two flanks [N].

    ``gap`` [m] is over the film's smallest thickness, ``rate`` [m/s] its rate; ``squeezed`` states whether the flanks
    approach; ``speeds`` [rad/s] are those of drive and loose gear.
    """
    thickness = max(gap, 0.0) + film.minimum
    rolling = film.rolling_drive * speeds[0] + film.rolling_loose * speeds[1]
    force = film.wedge * abs(rolling) / thickness
    if squeezed:
        force -= film.squeeze * rate / thickness**1.5
    return force

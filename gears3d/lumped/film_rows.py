"""The oil film as the kernel takes it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gears3d.effects import Code, Row
from gears3d.errors import Fault, InputError


def numbers(rows: Sequence[Row], backlash: float, waves: np.ndarray) -> np.ndarray:
    """Return wedge, squeeze, both rolling radii, smallest thickness and the height over it from which a film is felt.

    Args:
        rows: normal forms of the effects.
        backlash: without what is constant on the reverse flanks [m].
        waves: of the flanks, as :class:`gears3d.lumped.model.Model` has them; (n, 5).

    Returns:
        [N·s, N·s·√m, m, m, m, m], zeros without a film; (6,).

    Raises:
        InputError: there is more than one film, or it fills the backlash.

    >>> from gears3d.effects.rows import gap_film
    >>> numbers([gap_film(1e-6, 1e-6, 0.01, 0.02, 2e-6, 12e-6)], 98e-6, np.zeros((0, 5)))[5]
    np.float64(1e-05)
    """
    films = [row.p for row in rows if row.code == Code.GAP_FILM]
    if not films:
        return np.zeros(6)
    if len(films) > 1:
        raise InputError(Fault("effect", f"there are {len(films)} oil films between the flanks", "give one oil_film"))
    wedge, squeeze, drive, loose, minimum, felt = films[0]
    backlash -= minimum  # on the reverse flanks
    if backlash <= minimum:
        raise InputError(
            Fault(
                "effect",
                f"the oil's smallest thickness of {minimum:.4g} m on both flanks fills the backlash",
                "give more backlash or a smaller minimum_thickness",
            )
        )
    smallest = backlash - minimum - np.abs(waves[:, 3] + waves[:, 4]).sum()
    return np.array([wedge, squeeze, drive, loose, minimum, max(min(felt - minimum, 0.25 * smallest), 1e-3 * minimum)])

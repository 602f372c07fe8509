"""Drag from coast-downs: the law that decelerates the gear, its parameters and their intervals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gears3d.errors import Fault, InputError
from gears3d.identify.assemblies import Run, identify_assemblies
from gears3d.identify.coastdown_fit import guess_inertia
from gears3d.identify.coastdown_law import choose, report
from gears3d.identify.coastdown_record import Track, read_tracks
from gears3d.identify.law import Identified
from gears3d.identify.parts import ALONE, CANDIDATES, Inertia, Share, plain, terms_of


def identify_coastdown(
    files: Sequence[str | Path | Track],
    inertia: float | None,
    inertia_uncertainty: float = 0.0,
    law: str | None = None,
    torque: float = 0.0,
    torque_uncertainty: float = 0.0,
) -> Identified:
    """Identify the drag on a gear from records of its coast-down.

    The measured quantity is fitted, angle, speed or times of pulses, not a differenced speed nor an integrated angle.
    Among the laws, one with more terms is taken only where it predicts held-out blocks of the record better. The
    intervals include the scatter between blocks of the record.

    Args:
        files: records of the same drag, each with one or several free coast-downs; columns ``time_s`` and
            ``theta_loose_rad`` or ``omega_rad_s``; or tracks.
        inertia: of what coasts down [kg·m²]; ``None``: identified from spin-ups under a known torque in addition.
        inertia_uncertainty: its standard deviation [kg·m²]; a coast-down gives the ratio of drag and inertia only.
        law: such as ``"coulomb+viscous"``, fitted whether it is the best or not.
        torque: known, under which the gear spins up where its speed rises [N·m]; 0: rises are excluded as driven.
        torque_uncertainty: its standard deviation [N·m].

    Returns:
        ``coulomb`` [N·m], ``viscous`` [N·m·s/rad], ``coefficient`` [N·m at 1 rad/s] and ``exponent`` of the law found,
        with spin-ups ``inertia`` [kg·m²], too, unless it is known exactly.
        Records at several temperatures have numbers at each, ``drag@40.coulomb``, and a trend.

    Raises:
        InputError: a record cannot be used, or no law fits.
        UsageError: the law is unknown.

    Source: Kadmiri et al. 2012, eqs (4)-(7); Rigaud & Perret-Liaudet 2020, section 3; Ottewill et al. 2010, (14)-(16).
    Theory: docs/theory/identification.md, equation (1).

    >>> import numpy as np
    >>> from gears3d.identify import make_track
    >>> t = np.linspace(0.0, 0.9, 9001)
    >>> found = identify_coastdown([make_track(t, 3.0 * t - 1.5 * t**2)], inertia=0.0695)
    >>> found.law, round(found.parameters["coulomb"].value, 6)
    ('coulomb', 0.2085)
    """
    tracks = [file for file in files if isinstance(file, Track)]
    tracks += read_tracks([file for file in files if not isinstance(file, Track)], torque=torque)
    spread = torque_uncertainty / torque if torque else 0.0
    inertia, inertia_uncertainty = _inertia(tracks, inertia, inertia_uncertainty, spread)
    warm = [None if track.temperature is None else round(track.temperature) for track in tracks]
    torques = [track.torque for track in tracks]
    if None not in warm and len(set(warm)) > 1 and not any(torques):
        made = (Share(ALONE),), (("inertia", 1.0),)
        runs = [Run(track, *made, temperature=at) for track, at in zip(tracks, warm, strict=True)]
        known = {"inertia": Inertia(inertia, inertia_uncertainty)}
        return identify_assemblies(runs, known, None if law is None else {ALONE: law})
    laws = CANDIDATES if law is None else (terms_of(law),)
    models = [plain(terms, inertia, len(tracks), inertia_uncertainty, torques) for terms in laws]
    return report(choose(tracks, models), tracks, spread)


# Relative standard deviation of an unknown inertia about its first guess: it does not constrain a fit.
UNKNOWN = 10.0


def _inertia(tracks: list[Track], inertia: float | None, sigma: float, spread: float) -> tuple[float, float]:
    """Return the inertia to begin with, and what is known of it."""
    spins = sum(track.torque > 0.0 for track in tracks)
    if inertia is not None:
        if spins and spread:
            what = "is uncertain, but the inertia is known: the records then say what the torque is"
            raise InputError(Fault("torque", what, "omit the inertia, or the uncertainty of the torque"))
        return inertia, sigma
    if not spins or spins == len(tracks):
        what = f"is not known: {len(tracks) - spins} coast-downs and {spins} spin-ups under a known torque are there"
        remedy = "record both: either alone gives a ratio of torque and inertia only; or give the inertia"
        raise InputError(Fault("inertia", what, remedy))
    found = guess_inertia(tracks)
    if not found > 0.0:
        remedy = "check the torque, and that rises of the speed are spin-ups under it"
        raise InputError(Fault("inertia", "comes out negative: spin-ups and coast-downs contradict", remedy))
    return found, UNKNOWN * found


identify_rundown = identify_coastdown

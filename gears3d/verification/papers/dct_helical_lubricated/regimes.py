"""Rows on regimes: contact, one flank, both flanks, repeating and chaotic motion (figs 11 to 14, 16 to 20, 22 to 25, 27
to 30).
"""  # noqa: D205

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.dct_helical_lubricated.points import (
    CASE,
    GEOMETRY,
    all_repeat,
    claim,
    motion,
    point,
    seen,
)

HALF = (
    "at 50 Hz a period holds 8.5 meshes of 425 Hz: stiffness and friction alone make every response repeat after two "
    "periods at best, without any bifurcation"
)
MESHES = (
    "85 meshes of 425 Hz fall on twelve periods of 60 Hz, so that nothing repeats sooner, but disturbances die out: "
    "the exponent is clearly negative"
)
WINDOWS = (
    "where windows of repeating motion begin and end goes by geometry, inertia and stiffness, which are not printed"
)
SLOW = "it repeats here every two periods, to 0.01 nm after 150, and disturbances die out: the exponent is -10 1/s"
WIDE = (
    "it reaches the reverse flank here; with twice the backlash, where the printed 0.12 mm is cb and not 2·cb, it does "
    "not"
)
LIFTS = (
    "0.44 N m is where rigid teeth would stop parting: the inertia was chosen so. Here the mesh stiffness throws the "
    "gear 36 µm off its film, and at 0.6 N m still by a micrometre"
)
TWICE = "the same point is published as period-2 in figs 13 and 23"


QUIET = {"lubricated.tolerance": 1e-9}
"""The gear moves by a few tenths of a nanometre on 7 µm of oil; what steps of 1e-7 leave out sways it as much."""


def line(bench: Bench) -> float:
    """Return the strongest line of the displacement while the drive turns evenly [Hz].

    Args:
        bench: of the papers.
    """
    run = bench.run(CASE, point(acceleration=0.0) | QUIET, "lubricated").between(1.0, 3.0)
    place = run.signals["displacement_m"]
    amplitude = np.abs(np.fft.rfft((place - place.mean()) * np.hanning(len(place))))
    return float(np.fft.rfftfreq(len(place), run.time[1] - run.time[0])[int(np.argmax(amplitude))])


def _pair(figure: str, words: str, regime: str, moves: str, red: tuple[bool, bool] = (False, False),
          notes: tuple[str, str] = ("", ""), **where: Any) -> tuple:  # fmt: skip
    """Two rows of one figure: on which flanks it rattles, and how the motion repeats."""
    return (
        claim(
            figure=figure,
            quantity=f"regime at {words}",
            published=regime,
            compute=lambda bench: str(seen(bench, "regime", **where)),
            recorded="disagrees" if red[0] else "agrees",
            note=notes[0] or GEOMETRY,
        ),
        claim(
            figure=figure,
            quantity=f"motion at {words}",
            published=moves,
            compute=lambda bench: motion(bench, **where) if moves in ("chaotic", "repeats") else _name(bench, **where),
            recorded="disagrees" if red[1] else "agrees",
            note=notes[1] or GEOMETRY,
        ),
    )


def _name(bench: Bench, **where: Any) -> str:
    return str(seen(bench, "motion", **where))


def _window(figure: str, words: str, key: str, values: tuple[float, ...], red: bool = False, note: str = "") -> tuple:
    return (
        claim(
            figure=figure,
            quantity=f"motion at {words}",
            published="repeats",
            compute=lambda bench: all_repeat(bench, *({key: value} for value in values)),
            recorded="disagrees" if red else "agrees",
            note=note or GEOMETRY,
        ),
    )


CLAIMS = (
    *_pair("fig. 11", "10 Hz", "double_sided", "chaotic", (False, True), ("", SLOW), frequency=10.0),
    *_pair("fig. 12", "25 Hz", "double_sided", "chaotic", frequency=25.0),
    *_pair("fig. 13", "50 Hz", "double_sided", "2T", notes=("", HALF)),
    *_pair("fig. 14", "60 Hz", "double_sided", "chaotic", (False, True), ("", MESHES), frequency=60.0),
    *_window("fig. 16", "218 to 300 rad/s²", "acceleration", (220.0, 240.0, 260.0, 280.0, 300.0), True, WINDOWS),
    claim(
        figure="fig. 17",
        quantity="regime with an even drive",
        published="contact",
        compute=lambda bench: str(seen(bench, "regime", acceleration=0.0)),
        note=GEOMETRY,
    ),
    claim(
        figure="fig. 17",
        quantity="strongest line with an even drive",
        published=425.0,
        tolerance=1.0,
        unit="Hz",
        compute=line,
        basis="the line as printed; the rest of the spectrum has no numbers",
        note="17 teeth at 1500 rpm: the number of teeth was chosen by this line, so what is tested is that stiffness "
        "and friction move the gear on its film at their first harmonic",
    ),
    *_pair("fig. 18", "100 rad/s²", "single_sided", "chaotic", (True, False), (WIDE, ""), acceleration=100.0),
    claim(
        figure="fig. 18",
        quantity="regime at 100 rad/s² with 0.24 mm of backlash",
        published="single_sided",
        compute=lambda bench: str(seen(bench, "regime", acceleration=100.0, backlash=267.44)),
        note="a variant of the row above: 0.12 mm taken as cb, half of the backlash",
    ),
    *_pair("fig. 19", "250 rad/s²", "double_sided", "repeats", acceleration=250.0),
    *_pair("fig. 20", "320 rad/s²", "double_sided", "chaotic", (False, True), ("", WINDOWS), acceleration=320.0),
    *_window("fig. 22", "0.08 to 0.16 N m", "drag", (0.08, 0.1, 0.12, 0.14, 0.16)),
    *_pair("fig. 23", "0.1 N m", "double_sided", "2T", notes=("", HALF)),
    *_pair("fig. 24", "0.3 N m", "double_sided", "chaotic", drag=0.3),
    *_pair("fig. 25", "0.44 N m", "contact", "repeats", (True, True), (LIFTS, LIFTS), drag=0.44),
    *_window("fig. 27", "0.011 to 0.0219 Pa s", "viscosity", (0.011, 0.014, 0.017, 0.0205, 0.0219)),
    *_window("fig. 27", "0.034 to 0.04 Pa s", "viscosity", (0.034, 0.036, 0.038, 0.04)),
    *_pair("fig. 28", "0.01 Pa s", "double_sided", "chaotic", (False, True), ("", TWICE)),
    *_pair("fig. 29", "0.024 Pa s", "double_sided", "6T", (False, True), ("", WINDOWS), viscosity=0.024),
    *_pair("fig. 30", "0.03 Pa s", "double_sided", "chaotic", (False, True), ("", WINDOWS), viscosity=0.03),
)
"""Rows of section 4."""

"""Figure 8 of Rigaud & Perret-Liaudet 2020: nine pictures of the teeth in one period.

Backlash and phase of the pictures are not printed. "T = 0.333 ms" is 0.333 s.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from gears3d.verification.papers.rigaud_2020.points import PLASTIC, row

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

FILE = "rigaud-2020/fig8.toml"
FRAMES = ("active", "active", "flight", "flight", "reverse", "reverse", "flight", "flight", "active")
"""What the pictures at 0, T/8 ... T show."""
PAIRS = (1.0, 6.5, 12.0, 18.0, 24.0, 29.5, 35.0, 40.5, 46.0)
"""Tooth pairs in the pictures; "6-7" is between both."""
BACKLASHES = range(50, 2001, 50)
"""[µm], the range of the bench."""
ORIGINS = np.arange(0.0, 1.0, 0.005)
"""Phases of the first picture in the period [cycles]."""


def states(bench: Bench, backlash: int, origin: float) -> list[str]:
    """Return what the nine pictures would show.

    Args:
        bench: of the papers.
        backlash: [µm].
        origin: phase of the first picture [cycles].
    """
    contacts, period = _contacts(bench, backlash)
    shown = []
    for frame in range(9):
        time = period * (4 + origin + frame / 8)
        there = contacts[(contacts[:, 1] <= time) & (time <= contacts[:, 2]), 0]
        shown.append(("active", "reverse")[int(there[0])] if there.size else "flight")
    return shown


def _contacts(bench: Bench, backlash: int, model: str = "rigid") -> tuple[np.ndarray, float]:
    more = {**PLASTIC, "mount.backlash": f"{backlash} um", "run.duration": "7 periods", "run.output_rate": "1 kHz"}
    meta = bench.run(FILE, more, model).meta
    return np.array(meta["contacts"]).reshape(-1, 3), meta["period_s"]


def best(bench: Bench) -> tuple[int, int, float]:
    """Return the largest number of pictures that agree, and at which backlash [µm] and origin [cycles].

    Args:
        bench: of the papers.
    """
    return bench.once("rigaud-2020 fig. 8 best", lambda: _best(bench))


def _best(bench: Bench) -> tuple[int, int, float]:
    found = [
        (
            sum(one == two for one, two in zip(states(bench, backlash, float(origin)), FRAMES, strict=True)),
            backlash,
            origin,
        )
        for backlash in BACKLASHES
        for origin in ORIGINS
    ]
    most = max(count for count, _, _ in found)
    _, backlash, origin = next(each for each in found if each[0] == most)
    return most, backlash, float(origin)


def pair(bench: Bench, frame: int) -> float:
    """Return the number of the tooth pair at the pitch point in a picture, fractions between two.

    Args:
        bench: of the papers.
        frame: 0 to 8.
    """
    scenario = bench.scenario(FILE)
    run = bench.run(FILE, PLASTIC)
    origin = best(bench)[2] * scenario.period
    angle = np.interp([origin, origin + frame / 8 * scenario.period], run.time, run.signals["theta_drive_rad"])
    return float(1 + np.diff(angle)[0] * scenario.gears.drive.teeth / (2 * np.pi))


def order(bench: Bench, model: str = "rigid") -> str:
    """Return the order of the states over a period, from the active flank.

    Args:
        bench: of the papers.
        model: of the simulation.
    """
    contacts, period = _contacts(bench, 250, model)
    inside = contacts[(contacts[:, 2] > 3 * period) & (contacts[:, 1] < 4.9 * period)]
    names = [("active", "reverse")[int(flank)] for flank in inside[:, 0]]
    first = names.index("active")
    return ", flight, ".join(names[first : first + 2]) + ", flight"


def flights(bench: Bench) -> tuple[float, float]:
    """Return the mean flight across the backlash and the mean contact, in meshes.

    Args:
        bench: of the papers.
    """
    found, scenario = bench.outcome(FILE, PLASTIC), bench.scenario(FILE)
    mesh = 2 * np.pi / scenario.motion.mean / scenario.gears.drive.teeth
    lasted = [
        np.mean([found[f"{flank}_{what}_mean_s"] for flank in ("active", "reverse")]) / mesh
        for what in ("crossing", "contact")
    ]
    return float(lasted[0]), float(lasted[1])


def longer(bench: Bench) -> str:
    """Return whether flights and contacts last longer than two meshes.

    Args:
        bench: of the papers.
    """
    return "longer" if min(flights(bench)) > 2 else "not longer"


_fig8 = partial(row, figure="fig. 8")
_EIGHTHS = ("0", "T/8", "T/4", "3T/8", "T/2", "5T/8", "3T/4", "7T/8", "T")

CLAIMS = (
    *(
        _fig8(
            quantity=f"order of the states in a period{words}",
            published="active, flight, reverse, flight",
            model=model,
            compute=partial(order, model=model),
        )
        for model, words in (("rigid", ""), ("bullet", ", as rigid bodies"))
    ),
    _fig8(
        quantity="pictures whose state is that of the paper, best backlash up to 2 mm and best origin",
        published=9.0,
        tolerance=0.5,
        compute=lambda bench: float(best(bench)[0]),
        basis="a count",
        recorded="disagrees",
        note="the ninth is 7T/8: the flight back must last past it while the flight forth ends before T/2, and with "
        "0.22 N·m and 0.0695 kg m² no backlash does both. All nine come out when drag over inertia is 5 % smaller "
        "(0.073 to 0.076 kg m², within what the thresholds allow) and the backlash is 1.8 to 2 mm, the bench's largest",
    ),
    *(
        _fig8(
            quantity=f"tooth pair at {_EIGHTHS[frame]}",
            published=PAIRS[frame],
            tolerance=0.8,
            compute=partial(pair, frame=frame),
            basis="half the contact ratio: within it two pairs are in the picture",
        )
        for frame in range(1, 9)
    ),
    _fig8(quantity="flights and contacts against the meshing period", published="longer", compute=longer),
    _fig8(
        quantity="response at 90 rpm",
        published="1T",
        compute=lambda bench: str(bench.outcome(FILE, PLASTIC)["motion"]),
        note="the response follows the excitation whatever the mean speed",
    ),
)
"""Rows of figure 8."""

"""Table 1 of Rigaud & Perret-Liaudet 2020: what follows from the data of the pair."""

from __future__ import annotations

from functools import partial
from math import pi

from gears3d.gears import Pair
from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.claim import Claim

BASE = "base/rigaud-2020.toml"
table1 = partial(Claim, paper="rigaud-2020", figure="table 1", model="gears")


def speed_on_the_line_of_action(bench: Bench) -> float:
    """Return what 20 rpm are along the line of action [mm/s].

    Args:
        bench: of the papers.
    """
    return 1e3 * bench.scenario(BASE).pair().drive.base_radius * 20 * pi / 30


def contact_ratio(bench: Bench, centre_distance: str) -> float:
    """Return the transverse contact ratio at a centre distance.

    Args:
        bench: of the papers.
        centre_distance: with its unit.
    """
    return at(bench, centre_distance).contact_ratio


def at(bench: Bench, centre_distance: str) -> Pair:
    """Return the pair at a centre distance.

    Args:
        bench: of the papers.
        centre_distance: with its unit.
    """
    from gears3d.units import parse

    pair = bench.scenario(BASE).pair()
    return Pair.from_centre_distance(pair.drive, pair.loose, parse(centre_distance, "length"))


PRINTED = "last printed digit"

CLAIMS = (
    table1(
        quantity="speed along the line of action of 20 rpm",
        published=310.0,
        tolerance=0.5,
        unit="mm/s",
        compute=speed_on_the_line_of_action,
        basis=PRINTED,
        note="from the base radius; printed in section 5",
    ),
    table1(
        quantity="contact ratio at 315 mm",
        published=1.84,
        tolerance=0.005,
        compute=partial(contact_ratio, centre_distance="315 mm"),
        basis=PRINTED,
    ),
    table1(
        quantity="contact ratio at 318 mm",
        published=1.02,
        tolerance=0.005,
        compute=partial(contact_ratio, centre_distance="318 mm"),
        basis=PRINTED,
    ),
    table1(
        quantity="backlash at 315 mm",
        published=0.0,
        tolerance=0.005,
        unit="mm",
        compute=lambda bench: 1e3 * at(bench, "315 mm").backlash,
        basis=PRINTED,
    ),
    table1(
        quantity="backlash at 318 mm",
        published=2.0,
        tolerance=0.5,
        unit="mm",
        compute=lambda bench: 1e3 * at(bench, "318 mm").backlash,
        basis=PRINTED,
    ),
)
"""Rows of table 1."""

"""A check: a number that was measured, the bound it must keep; and the bench that checks are measured on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from math import pi
from typing import Any

from gears3d.laws import SineDrive
from gears3d.scenario import Scenario, load

# Chapters in the order of the table: module and title; the function `check_<chapter>` of the module measures it
CHAPTERS = {
    "solids": ("engine", "The solids: watertight, flanks on the involute, the backlash that was asked"),
    "twin": ("twin", "The rigid twin against closed forms"),
    "agreement": ("agreement", "Located engine against the rigid twin, at full rotation"),
    "native": (
        "engine",
        "Bullet's own contact with the exact-impact settings, and what it does wrong once the pair turns",
    ),
    "faults": ("faults", "Faults that nobody told: the engine finds them, the twin cannot"),
    "effects": (
        "agreement",
        "Effects: the change that each makes in the engine is the change that it makes in the twin",
    ),
    "film": ("film", "Oil films in the twin and in the engine against their laws"),
    "eccentric": (
        "faults",
        "Eccentric teeth: the engine turns real ones, the twin has their first order, both stand against closed forms",
    ),
    "helical": (
        "engine",
        "Helical gears in the engine: lines of contact, ratio and thrust are those of geometry, "
        "impacts those of the twin",
    ),
    "published": (
        "agreement",
        "Published cases in the engine against the twin: figures of Rigaud & Perret-Liaudet, "
        "and the helical pair of Kadmiri",
    ),
    "ste": (
        "virtual_tests",
        "The virtual test of the transmission error recovers what was imposed: waves, pitch errors, eccentric teeth",
    ),
    "threshold": (
        "virtual_tests",
        "Slow sweeps in the engine lose contact where the master curve says; "
        "waves of the flanks lower that as riding does",
    ),
    "convergence": (
        "engine",
        "The step of the engine: the order of its error, the error that half the step tells, and the books of work",
    ),
    "oracles": (
        "twin",
        "Independent ways to the rigid twin's motion: events, time stepping, springs and dampers, closed forms",
    ),
}


@dataclass(frozen=True)
class Check:
    """One line of the validation table.

    Args:
        name: what was measured.
        value: the measured number.
        bound: what it must not exceed.
        unit: of both; empty for ratios and counts.
        at_least: the bound is a lower one.
    """

    name: str
    value: float
    bound: float
    unit: str = ""
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the value keeps its bound; a value that is not a number does not.

        >>> Check("gap", 2e-9, 1e-9, "m").holds
        False
        """
        return bool(self.value >= self.bound if self.at_least else self.value <= self.bound)


def chapters(quick: bool = False, only: str = "") -> Iterator[tuple[str, Callable[[], Iterator[Check]]]]:
    """Give each chapter's title and the function that measures its checks.

    Args:
        quick: a part of the cases, in about a minute.
        only: the name of one chapter; all when empty.

    Raises:
        UsageError: the name is unknown.
    """
    from gears3d.errors import UsageError, did_you_mean

    if only and only not in CHAPTERS:
        raise UsageError(f"there is no chapter {only!r}; {did_you_mean(only, list(CHAPTERS))}")
    for name in [only] if only else CHAPTERS:
        module, title = CHAPTERS[name]
        checks = getattr(import_module(f"gears3d.verification.validation.{module}"), f"check_{name}")
        yield title, partial(checks, quick)


FIG5 = """
format = 1
title = "Rigaud & Perret-Liaudet 2020, fig. 5, 20 rpm"
[gears]
module = "3.5 mm"
pressure_angle = "20 deg"
face_width = "7.5 mm"
drive = { teeth = 90 }
loose = { teeth = 90, inertia = "0.0695 kg m^2" }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
harmonics = [ { amplitude = "20 rpm", frequency = "3 Hz" } ]
[drag]
torque = "0.22 N m"
[impact]
restitution = 0.3
[run]
duration = "2 s"
settle = "0 s"
"""


def fig5(**overrides: Any) -> Scenario:
    """Return figure 5 at 20 rpm, changed.

    Args:
        overrides: dotted keys with ``__`` for the dot, e.g. ``impact__restitution=0.5``.

    >>> fig5(impact__restitution=0.5).impact.restitution
    0.5
    """
    return load(FIG5, overrides=[(key.replace("__", "."), value) for key, value in overrides.items()])


def swing(scenario: Scenario) -> SineDrive:
    """Return speed, frequency and pull of a scenario with one harmonic and Coulomb drag.

    Args:
        scenario: the scenario.

    >>> round(swing(fig5()).excitation, 2)
    12.47
    """
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    pull = rig.drag_torque * rig.base_radius_loose / rig.inertia
    return SineDrive(rig.base_radius_drive * harmonic.amplitude, 2 * pi * harmonic.frequency, pull)

"""What is kept of a point: groups of variables, from the counts of its impacts and its sections."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.lumped import tally as at
from gears3d.signals.impacts import REGIMES, SHARE

Array = np.ndarray
MISSING = -9  # A whole number that is not known
_FLANKS = ("active", "reverse")
ONLY = {"ri": ("lubricated",)}  # Groups that not every model has


@dataclass(frozen=True)
class Variable:
    """One variable of the dataset."""

    name: str  # as the dataset names it
    unit: str  # SI
    about: str  # what it is
    whole: bool = False  # whether it is a small whole number, with a place for ``missing``
    sections: bool = False  # whether there is one value a kept period


class Setting(NamedTuple):
    """Reference values of points; (n,) each."""

    period: Array  # of the excitation [s]
    mass: Array  # of the loose gear on the line of action [kg]
    amplitude: Array  # amplitude of the drive's speed in the first harmonic [rad/s]
    radius: Array  # base radius of the drive gear [m]
    force: Array  # base drag on the line of action [N]
    inertia: Array  # of the loose gear [kg·m²]
    tilt: Array  # cosine of the base helix angle


def _both(name: str, unit: str, about: str, **more: bool) -> tuple[Variable, ...]:
    return tuple(Variable(f"{flank}_{name}", unit, f"{about} {flank} flank", **more) for flank in _FLANKS)


# Variables by the word that ``--measure`` takes
GROUPS: dict[str, tuple[Variable, ...]] = {
    "threshold": (
        Variable("excitation", "1", "Λ of the first harmonic and the base drag"),
        Variable("opening_m", "m", "highest flight after settling; 0: contact holds"),
    ),
    "regime": (
        Variable("regime", "1", "flanks that have impacts: 0 contact, 1 single_sided, 2 double_sided", whole=True),
        Variable("repetition", "1", "periods after which impacts repeat; 0 no impacts, -1 beyond 8", whole=True),
        Variable("impacts_per_period", "1", "mean number of impacts in a period"),
    ),
    "velocities": (
        *_both("velocity_mean_m_s", "m/s", "mean velocity before impacts on the"),
        *_both("velocity_std_m_s", "m/s", "standard deviation of the velocity before impacts on the"),
        *_both("velocity_largest_m_s", "m/s", "largest speed before an impact on the"),
        *_both("impacts_per_period", "1", "mean number of impacts in a period on the"),
    ),
    "impulses": _both("impulse_dimensionless", "1", "mean of I/(m·H·ω) over impacts on the"),
    "poincare": (
        Variable("section_displacement_m", "m", "displacement once a period", sections=True),
        Variable("section_velocity_m_s", "m/s", "relative velocity once a period", sections=True),
        *_both("section_impact_m_s", "m/s", "velocity of the first impact of a period on the", sections=True),
    ),
    "ri": (
        Variable("rattle_index", "N/(s kg m^2)", "effective rate of the mesh force over the loose gear's inertia"),
    ),
    "level": (
        Variable("energy_J_s", "W", "energy lost in impacts, a second"),
        Variable("energy_level_dB", "dB", "the same re 1 pW"),
        Variable("rattle_drive_rad3_s3", "rad^3/s^3", "ω²·ΔΩ of the first harmonic"),
        Variable("rattle_drive_level_dB", "dB", "the same re 1 rad³/s³"),
    ),
}  # fmt: skip


def chosen(words: tuple[str, ...], model: str) -> tuple[str, ...]:
    """Return groups in the order of the catalogue; all that the model has when no group is named.

    >>> chosen(("velocities", "regime"), "rigid")
    ('regime', 'velocities')
    """
    faults = []
    for word in words:
        if word not in GROUPS:
            faults.append(Fault("--measure", f"there is no measure {word!r}", did_you_mean(word, list(GROUPS))))
        elif model not in ONLY.get(word, (model,)):
            remedy = f"leave it out, or --model {ONLY[word][0]}"
            faults.append(Fault("--measure", f"the {model} model has no {word!r}: its flanks have no force", remedy))
    if faults:
        raise InputError(faults)
    return tuple(name for name in GROUPS if (name in words if words else model in ONLY.get(name, (model,))))


def variables(groups: tuple[str, ...]) -> list[Variable]:
    """Return the variables of some groups."""
    return [variable for group in groups for variable in GROUPS[group]]


def reduce(
    groups: tuple[str, ...], numbers: Array, sections: Array, setting: Setting, periods: int
) -> dict[str, Array]:
    """Return the variables of points."""
    made = {
        "threshold": _threshold,
        "regime": _regime,
        "velocities": _velocities,
        "impulses": _impulses,
        "ri": lambda n, s, p: {"rattle_index": np.sqrt(n[:, at.JERK]) / s.tilt / s.inertia},
        "level": _level,
    }
    found: dict[str, Array] = {}
    with np.errstate(invalid="ignore", divide="ignore"):
        for group in groups:
            if group == "poincare":
                places = (at.PLACE, at.RATE, at.FIRST, at.FIRST + 1)
                found |= {v.name: sections[:, :, i] for v, i in zip(GROUPS[group], places, strict=True)}
            else:
                found |= made[group](numbers, setting, periods)
    return found


def _threshold(numbers: Array, setting: Setting, periods: int) -> Mapping[str, Array]:
    push = setting.mass * setting.radius * setting.amplitude * 2.0 * np.pi / setting.period
    excitation = np.where(push == 0.0, 0.0, np.divide(push, setting.force))
    return {"excitation": excitation, "opening_m": numbers[:, at.OPENING]}


def _regime(numbers: Array, setting: Setting, periods: int) -> Mapping[str, Array]:
    bad = np.isnan(numbers[:, at.COUNT])
    struck = sum((numbers[:, at.CYCLES + flank] > SHARE * periods).astype(int) for flank in (0, 1))
    assert len(REGIMES) == 3
    whole = {"regime": struck, "repetition": np.where(bad, MISSING, numbers[:, at.REPETITION])}
    total = (numbers[:, at.COUNT] + numbers[:, at.COUNT + 1]) / periods
    return {name: np.where(bad, MISSING, value).astype(np.int8) for name, value in whole.items()} | {
        "impacts_per_period": total
    }


def _velocities(numbers: Array, setting: Setting, periods: int) -> Mapping[str, Array]:
    found = {}
    for flank, name in enumerate(_FLANKS):
        count = numbers[:, at.COUNT + flank]
        some = count > 0
        found[f"{name}_velocity_mean_m_s"] = np.where(some, numbers[:, at.MEAN + flank], np.nan)
        found[f"{name}_velocity_std_m_s"] = np.where(some, np.sqrt(numbers[:, at.SPREAD + flank] / count), np.nan)
        found[f"{name}_velocity_largest_m_s"] = np.where(some, numbers[:, at.LARGEST + flank], np.nan)
        found[f"{name}_impacts_per_period"] = count / periods
    return found


def _impulses(numbers: Array, setting: Setting, periods: int) -> Mapping[str, Array]:
    scale, found = setting.mass * setting.radius * setting.amplitude, {}
    for flank, name in enumerate(_FLANKS):
        count = numbers[:, at.COUNT + flank]
        mean = numbers[:, at.IMPULSE + flank] / count / scale
        found[f"{name}_impulse_dimensionless"] = np.where(count > 0, mean, np.nan)
    return found


def _level(numbers: Array, setting: Setting, periods: int) -> Mapping[str, Array]:
    rate = numbers[:, at.ENERGY] / (periods * setting.period)
    driven = (2.0 * np.pi / setting.period) ** 2 * setting.amplitude
    return {
        "energy_J_s": rate,
        "energy_level_dB": np.where(rate > 0.0, 10.0 * np.log10(rate / 1e-12), np.nan),
        "rattle_drive_rad3_s3": driven,
        "rattle_drive_level_dB": np.where(driven > 0.0, 10.0 * np.log10(driven), np.nan),
    }

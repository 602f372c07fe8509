"""Causes that stand in no catalogue, for diagnoses that must say so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING, Any

from gears3d.verification.challenge.physics import (
    ADHESION,
    BEARING,
    COGGING,
    DRIVE_ANGLE,
    IMPACT_ANGLE,
    STICK_SLIP,
    WARMING,
)

if TYPE_CHECKING:
    import numpy as np

    from gears3d.scenario import Scenario


@dataclass(frozen=True)
class Foreign:
    """One cause outside the catalogue."""

    name: str  # of the cause
    parameters: dict[str, float]  # SI, for the answer
    coordinates: tuple[str, ...]  # where a diagnosis may see it
    rows: tuple[tuple[float, ...], ...] = ()  # of ``foreign`` in ``MACHINE``
    second: tuple[float, ...] = ()  # a body behind a coupling with play
    mount: tuple[float, ...] = field(default=())  # frequency [Hz] and damping of an encoder's disc on its mount


def _torque(code: int, name: str, where: tuple[str, ...], orders: tuple[float, ...]) -> Callable[..., Foreign]:
    def draw(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
        order, phase = float(random.choice(orders)), float(random.uniform(0.0, 2.0 * pi))
        torque = size * _drag(scenario)
        if code == STICK_SLIP:
            phase /= 2.0 * pi
        row = (float(code), torque, order, phase, _speed(scenario))
        return Foreign(name, {"torque": torque, "order": order, "phase": phase}, where, (row,))

    return draw


def _speed(scenario: Scenario) -> float:
    return abs(scenario.motion.mean) * scenario.gears.drive.teeth / scenario.gears.loose.teeth


def _drag(scenario: Scenario) -> float:
    return scenario.drag.torque or 0.1 * float(scenario.gears.loose.inertia or 0.0)


def _adhesion(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    reach = float(random.uniform(0.05, 0.15)) * scenario.pair().backlash
    force = 2.0 * size * _drag(scenario) / scenario.pair().loose.base_radius
    values = {"force": force, "reach": reach}
    return Foreign("adhesion to a flank", values, ("flight.gap",), ((float(ADHESION), force, reach, 0.0, 0.0),))


def _impact_angle(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    order, phase = float(random.choice((1.0, 2.0, 3.0))), float(random.uniform(0.0, 2.0 * pi))
    swing = size * max(scenario.impact.restitution, 0.1)
    row = (float(IMPACT_ANGLE), swing, order, phase, 0.0)
    return Foreign("restitution over the angle", {"swing": swing, "order": order}, ("impact.tooth",), (row,))


def _warming(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    change = size * scenario.pair().backlash * float(random.choice((-1.0, 1.0)))
    time = float(random.uniform(0.2, 0.6)) * scenario.run.duration
    where = ("contact.time", "flight.gap")
    row = (float(WARMING), change, time, 0.0, 0.0)
    return Foreign("backlash that drifts", {"change": change, "time_constant": time}, where, (row,))


def _coupling(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    inertia = size * float(scenario.gears.loose.inertia or 0.0)
    play = float(random.uniform(0.1, 0.3)) * scenario.pair().backlash / scenario.pair().loose.base_radius
    stiff = inertia * (2.0 * pi * float(random.uniform(80.0, 160.0))) ** 2
    damping = 0.1 * (stiff * inertia) ** 0.5
    values = {"inertia": inertia, "half_play": play, "stiffness": stiff}
    where = ("flight.time", "flight.speed", "impact.speed", "impact.duration")
    return Foreign("a body behind a coupling with play", values, where, (), (inertia, stiff, damping, play))


def _mount(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    frequency = float(random.uniform(60.0, 120.0)) / max(size / 0.3, 0.3)
    damping = float(random.uniform(0.01, 0.04))
    where = ("flight.time", "impact.duration", "sensor.delay")
    values = {"frequency": frequency, "damping": damping}
    return Foreign("an encoder that sways on its mount", values, where, (), (), (frequency, damping))


# How each cause outside the catalogue is drawn: scenario, size and random numbers -> cause
UNKNOWN: dict[str, Callable[..., Foreign]] = {
    "bearing_defect": _torque(BEARING, "a bearing's balls", ("flight.angle_loose",), (3.57, 5.43, 2.38)),
    "cogging_speed": _torque(COGGING, "cogging over speed", ("flight.angle_loose", "flight.speed"), (6.5, 9.5)),
    "stick_slip": _torque(STICK_SLIP, "stick-slip", ("flight.angle_loose", "flight.time"), (7.3, 11.7)),
    "drive_angle": _torque(DRIVE_ANGLE, "a torque over the drive's angle", ("flight.angle_drive",), (2.41, 3.33)),
    "adhesion": _adhesion,
    "restitution_angle": _impact_angle,
    "backlash_drift": _warming,
    "coupling_play": _coupling,
    "encoder_mount": _mount,
}


def draw(name: str, scenario: Scenario, size: float, random: Any) -> Foreign:
    """Draw a cause outside the catalogue."""
    return UNKNOWN[name](scenario, size, random)

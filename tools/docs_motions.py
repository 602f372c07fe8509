"""Curves of the laws of contact, flight and excitation, one for each function; see docs_laws.py."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from docs_drawing import POINTS, Plot, over

from gears3d.laws import contact, error_function, excitation, orbit, ottewill

RPM = np.pi / 30.0
SWING = orbit.SineDrive(0.148 * 20 * RPM, 6 * np.pi, 0.468489)
"""Rigaud & Perret-Liaudet 2020 at 20 rpm and 3 Hz."""
GAP = 250e-6
TURNS = "revolutions τ"


def _riding() -> Plot:
    turn = np.linspace(0.0, 1.0, POINTS)
    steady = (2 * np.pi * turn, np.full(POINTS, np.pi), np.zeros(POINTS))
    lines = {}
    for order, size in ((1, 50e-6), (5, 10e-6)):
        found = excitation.riding((0.148, 0.148), steady, [(0, order, size, 0.0)])[2]
        lines[f"{1e6 * size:g} µm of order {order} at 30 rpm"] = (turn, found)
    return Plot("turns of the drive", "acceleration [rad/s²]", lines)


def _regions() -> Plot:
    size = np.geomspace(1.02, 30.0, 60)
    lanes = np.geomspace(1e-3, 30.0, 120)
    codes = orbit.regions(size, lanes)
    lines = {}
    for name in ("single_sided", "double_sided", "unknown"):
        row, column = np.nonzero(codes == orbit.REGIMES.index(name))
        lines[name.replace("_", "-")] = (size[row], lanes[column])
    return Plot("excitation Λ", "dimensionless backlash j̄", lines, log="xy", dots=True)


def _cycle() -> Plot:
    lines = {}
    for give in (0.0, 0.3):
        found = orbit.cycle(SWING, GAP, lambda flank, speed, e=give: e, stick_velocity=1e-4)
        x, y, begin = [], [], found.flights[0].lost / SWING.omega
        for one in found.flights:
            start = begin + ((one.lost / SWING.omega - begin) % (2 * np.pi / SWING.omega))
            time = np.linspace(0.0, one.duration, 60)
            way = orbit.drift(SWING, one.lost, time, one.launch)[0]
            x += [*(start + time), np.nan]
            y += [*(GAP * one.left + way), np.nan]
        lines[f"e = {give}"] = (np.array(x), 1e6 * np.array(y))
    return Plot("time in the period [s]", "displacement in flight [µm]", lines)


def _averaged() -> Plot:
    draws = np.random.default_rng(0)
    angle = np.linspace(0.0, 1.0, 200, endpoint=False)
    truth = 1e-4 * np.cos(2 * np.pi * angle) + 2e-5 * np.cos(2 * np.pi * 18 * angle)
    read = np.round((np.tile(truth, 25) + draws.normal(0.0, 3e-5, 5000)) / 6e-5) * 6e-5
    lines = {"one revolution": (angle, 1e6 * read[:200])}
    lines["mean of 25"] = (angle, 1e6 * error_function.averaged(read, 25))
    lines["true"] = (angle, 1e6 * truth)
    return Plot("revolution", "transmission error [µrad]", lines)


def _orders() -> Plot:
    angle = np.linspace(0.0, 1.0, 400, endpoint=False)
    jagged = 1e-4 * (np.abs((2 * angle) % 2 - 1) - 0.5) + 1e-5 * np.cos(2 * np.pi * 18 * angle)
    lines = {"error": (angle, 1e6 * jagged)}
    for keep in (2, 21):
        found = error_function.strongest_orders(jagged, keep)
        lines[f"its {keep} strongest orders"] = (angle, 1e6 * found.at(2 * np.pi * angle))
    return Plot("revolution", "transmission error [µrad]", lines)


def _forcing() -> Plot:
    turn = np.linspace(0.0, 1.0, POINTS)
    lines = {f"ε = {size}, δ = 2.3": (turn, ottewill.forcing(turn, size, 0.0, 2.3)) for size in (0.2, 0.34, 0.5)}
    return Plot(TURNS, "push of the flank [rad]", lines)


def _damping() -> Plot:
    turn = np.linspace(0.0, 1.5, POINTS)
    angle = ottewill.rundown_angle(2.0, 2.3, turn)
    bent = 2.0 * (1 - np.exp(-2.3 * turn - 0.4 * turn**2))
    found = {"viscous alone, δ = 2.3": angle, "damping that grows": bent}
    return Plot(TURNS, "damping δ", {name: (turn, ottewill.rundown_damping(turn, y, 2.0)) for name, y in found.items()})


def _loss(flank: int) -> Callable[[float], float]:
    return lambda size: np.degrees(orbit.loss_phases(size)[flank])


def _landing(give: float) -> Callable[[float], float]:
    def speed(gap: float) -> float:
        found = orbit.landing(SWING, SWING.loss[0], 0.0, gap, give)
        return found.velocity if found else np.nan

    return speed


def _crossing(gap: float) -> float:
    return orbit.crossing(*SWING, SWING.loss[0], gap)[1]


CONTACT: dict[str, Callable[[], Plot]] = {
    "contact.drive_amplitude": lambda: over(
        "frequency ω/2π [Hz]",
        (2 * np.pi, 2 * np.pi * 50),
        "amplitude H [mm]",
        {f"A' = {a} rad/s": lambda w, a=a: contact.drive_amplitude(a, 0.0254, w) for a in (4.19, 1.0)},
        log="xy",
        units=(2 * np.pi, 1e-3),
    ),
    "contact.drag_force": lambda: over(
        "torque C [N m]",
        (0, 1),
        "force [N]",
        {f"Rb2 = {r} m": lambda c, r=r: contact.drag_force(c, r) for r in (0.051, 0.148)},
    ),
    "contact.equivalent_mass": lambda: over(
        "base radius Rb2 [mm]",
        (0.02, 0.15),
        "mass [kg]",
        {"Ig = 9.884e-4 kg m²": lambda r: contact.equivalent_mass(9.884e-4, r)},
        units=(1e-3, 1.0),
        log="y",
    ),
    "contact.reaction": lambda: over(
        "acceleration of the flank ÿ [m/s²]",
        (-100, 100),
        "force R [N]",
        {f"F = {f} N": lambda a, f=f: contact.reaction(f, 0.38, a) for f in (17.5, 5.0)},
    ),
    "contact.impulse": lambda: over(
        "velocity ṡ⁻ [mm/s]",
        (-0.1, 0.1),
        "impulse [N s]",
        {f"e = {e}": lambda v, e=e: contact.impulse(0.38, v, e) for e in (0.0, 0.3, 0.7)},
        units=(1e-3, 1.0),
    ),
    "contact.dimensionless_impulse": lambda: over(
        "amplitude H [mm]",
        (1e-4, 5e-3),
        "Ī",
        {f"I = {i} N s": lambda h, i=i: contact.dimensionless_impulse(i, 0.38, h, 156.9) for i in (0.05, 0.01)},
        log="y",
        units=(1e-3, 1.0),
    ),
    "excitation.excitation": lambda: over(
        "frequency ω/2π [Hz]",
        (2 * np.pi, 2 * np.pi * 100),
        "Λ",
        {f"H = {1e3 * h:g} mm": lambda w, h=h: excitation.excitation(0.38, h, w, 17.5) for h in (0.68e-3, 5e-3)},
        log="xy",
        units=(2 * np.pi, 1.0),
    ),
    "excitation.dimensionless_backlash": lambda: over(
        "amplitude H [mm]",
        (1e-4, 5e-3),
        "j̄",
        {f"j = {1e6 * j:g} µm": lambda h, j=j: excitation.dimensionless_backlash(j, h) for j in (100e-6, 250e-6)},
        log="xy",
        units=(1e-3, 1.0),
    ),
    "excitation.threshold_amplitude": lambda: over(
        "frequency ω/2π [Hz]",
        (2 * np.pi * 0.5, 2 * np.pi * 20),
        "amplitude ΔΩ* [rpm]",
        {f"{t} N m": lambda w, t=t: excitation.threshold_amplitude(0.0695, t, w) for t in (0.22, 0.46, 0.75)},
        log="xy",
        units=(2 * np.pi, RPM),
    ),
    "excitation.threshold_omega": lambda: over(
        "amplitude ΔΩ [rpm]",
        (0.5 * RPM, 20 * RPM),
        "frequency ω*/2π [Hz]",
        {f"{t} N m": lambda a, t=t: excitation.threshold_omega(0.0695, t, a) for t in (0.22, 0.46, 0.75)},
        log="xy",
        units=(RPM, 2 * np.pi),
    ),
    "excitation.riding": _riding,
}
"""Curves by ``module.function``."""
FLIGHTS: dict[str, Callable[[], Plot]] = {
    "orbit.plastic": lambda: over("impact speed [m/s]", (0, 0.1), "restitution e", {"": lambda v: orbit.plastic(0, v)}),
    "orbit.cycle": _cycle,
    "orbit.regions": _regions,
    "orbit.border": lambda: over(
        "excitation Λ",
        (1.001, 30),
        "dimensionless backlash j̄",
        {"": lambda x: orbit.border(np.array([x]))[0]},
        log="xy",
    ),
    "orbit.drift": lambda: over(
        "time since contact was lost [s]",
        (0, 0.03),
        "relative displacement [µm]",
        {
            f"launched at {1e3 * v:g} mm/s": lambda t, v=v: orbit.drift(SWING, SWING.loss[0], t, v)[0]
            for v in (0.0, 5e-3)
        },
        units=(1.0, 1e-6),
    ),
    "orbit.landing": lambda: over(
        "way to the reverse flank [µm]",
        (1e-6, 600e-6),
        "velocity at the impact [mm/s]",
        {f"launched at {1e3 * v:g} mm/s": _landing(v) for v in (0.0, 5e-3)},
        units=(1e-6, 1e-3),
    ),
    "orbit.loss_phases": lambda: over(
        "excitation Λ",
        (1.0, 30.0),
        "phase ωt of the loss [°]",
        {"active flank": _loss(0), "reverse flank": _loss(1)},
        log="x",
    ),
    "orbit.crossing": lambda: over(
        "backlash [µm]",
        (1e-6, 600e-6),
        "velocity at the impact [mm/s]",
        {"20 rpm at 3 Hz": _crossing},
        units=(1e-6, 1e-3),
    ),
    "error_function.averaged": _averaged,
    "error_function.strongest_orders": _orders,
    "ottewill.dimensional": lambda: over(
        "damping δ",
        (0.5, 5),
        "drag of the bearings [mN m s/rad]",
        {
            f"{w} rev/s": lambda d, w=w: ottewill.dimensional(d, 5.0, 1.63e-2, 0.01, w, 0.050743).drag_viscous
            for w in (1.0, 2.0)
        },
        units=(1.0, 1e-3),
    ),
    "ottewill.displacement": lambda: over(
        "x [mrad]",
        (-0.0163, 0.0163),
        "displacement [mm]",
        {"β = 16.3 mrad, Rb = 50.7 mm": lambda x: ottewill.displacement(x, 0.0163, 0.050743)},
        units=(1e-3, 1e-3),
    ),
    "ottewill.drive": lambda: over(
        TURNS,
        (0, 2),
        "angle θ1 - 2πτ [rad]",
        {f"ε = {e}": lambda t, e=e: ottewill.drive(t, e, 0.0) - 2 * np.pi * t for e in (0.2, 0.5)},
    ),
    "ottewill.forcing": _forcing,
    "ottewill.loss_amplitude": lambda: over(
        "damping δcontact", (0, 10), "amplitude ε* [rad]", {"": ottewill.loss_amplitude}
    ),
    "ottewill.rundown_angle": lambda: over(
        TURNS, (0, 2), "angle [rad]", {f"δ = {d}": lambda t, d=d: ottewill.rundown_angle(2.0, d, t) for d in (2.3, 4.2)}
    ),
    "ottewill.rundown_damping": _damping,
}
"""Curves by ``module.function``."""
MOTIONS = CONTACT | FLIGHTS

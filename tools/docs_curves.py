"""Curves of the laws of torque, oil and restitution, one for each function; see docs_laws.py."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from docs_drawing import Plot, over

from gears3d.laws import churning, contact, drag, film, noise

SPEED = "speed Ω [rad/s]"
TORQUE = "torque [N m]"
OIL = ((40.0, 34e-6), (100.0, 7e-6))
GEAR = {"radius": 0.05, "face_width": 0.02}
FILM = {"length": 24.5e-3, "radius": 8.06e-3}
THIN, COLD, WARM = 1e-6, 0.03, 0.01
RESTITUTION = "restitution e"


def _churned(depth: float) -> Callable[[float], object]:
    return lambda w: churning.churning(**GEAR, depth=depth, volume=2e-3, density=850.0, viscosity=0.03, speed=w)


def _coefficient(depth: float) -> Callable[[float], object]:
    return lambda w: churning.torque_coefficient(**GEAR, depth=depth, volume=2e-3, kinematic_viscosity=35e-6, speed=w)


def _scatter() -> Plot:
    numbers = np.array([contact.scatter(0, k) for k in range(300)])
    return Plot("impact", "standard normal number z", {"seed 0": (np.arange(300), numbers)}, dots=True)


TORQUES: dict[str, Callable[[], Plot]] = {
    "drag.coulomb": lambda: over(SPEED, (-10, 10), TORQUE, {"0.22 N m": lambda w: drag.coulomb(0.22, w)}),
    "drag.viscous": lambda: over(
        SPEED,
        (-100, 100),
        TORQUE,
        {f"cv = {c * 1e3:g} mN m s/rad": lambda w, c=c: drag.viscous(c, w) for c in (0.2e-3, 1e-3)},
    ),
    "drag.power": lambda: over(
        SPEED, (0, 100), TORQUE, {f"K = 1 mN m, β = {b}": lambda w, b=b: drag.power(1e-3, b, w) for b in (0.59, 1, 1.5)}
    ),
    "drag.bearing": lambda: over(
        SPEED,
        (-100, 100),
        TORQUE,
        {
            "a = -20 rad/s, λ = 0.5 /s, Is = 0.01 kg m²": lambda w: drag.bearing(-20.0, 0.5, 0.01, w),
            "no solid friction, a = 0": lambda w: drag.bearing(0.0, 0.5, 0.01, w),
        },
    ),
    "drag.rundown": lambda: over(
        "time [s]",
        (0, 8),
        SPEED,
        {f"a = {a} rad/s, λ = 0.5 /s": lambda t, a=a: drag.rundown(a, 75.0, 0.5, t) for a in (-25.0, -5.0, 0.0)},
    ),
    "drag.couette": lambda: over(
        "speed against the shaft ΔΩ [rad/s]",
        (-100, 100),
        TORQUE,
        {f"{mu} Pa s": lambda w, mu=mu: drag.couette(mu, 0.02, 0.02, 50e-6, w) for mu in (COLD, WARM)},
    ),
    "drag.seetharaman_sides": lambda: over(
        SPEED,
        (0, 100),
        TORQUE,
        {f"{mu} Pa s": lambda w, mu=mu: drag.seetharaman_sides(0.1, 850.0, mu, w) for mu in (COLD, WARM)},
    ),
    "drag.assembly": lambda: over(
        SPEED,
        (0, 100),
        TORQUE,
        {
            "sum": lambda w: drag.assembly(
                [drag.bearing(-20.0, 0.5, 0.01, w), drag.couette(COLD, 0.02, 0.02, 50e-6, w)]
            ),
            "bearings": lambda w: drag.bearing(-20.0, 0.5, 0.01, w),
            "shear at the shaft": lambda w: drag.couette(COLD, 0.02, 0.02, 50e-6, w),
        },
    ),
    "churning.wetted_surface": lambda: over(
        "depth h [mm]",
        (0, 0.1),
        "surface [cm²]",
        {"R = 50 mm, B = 20 mm": lambda h: churning.wetted_surface(**GEAR, depth=h)},
        units=(1e-3, 1e-4),
    ),
    "churning.torque_coefficient": lambda: over(
        SPEED, (10, 1000), "coefficient Cm", {f"h = {1e3 * h:g} mm": _coefficient(h) for h in (0.02, 0.05)}, log="xy"
    ),
    "churning.churning": lambda: over(
        SPEED, (0, 400), TORQUE, {f"h = {1e3 * h:g} mm": _churned(h) for h in (0.02, 0.05)}
    ),
    "drag.end_faces": lambda: over(
        SPEED,
        (0, 200),
        TORQUE,
        {
            f"axis {1e3 * h:g} mm above the oil": lambda w, h=h: drag.end_faces(0.065, h, 816.0, 12e-6, w)
            for h in (0.045, 0.0)
        },
    ),
    "drag.periphery": lambda: over(
        SPEED,
        (0, 200),
        TORQUE,
        {
            f"axis {1e3 * h:g} mm above the oil": lambda w, h=h: drag.periphery(0.065, 16e-3, h, 816.0, 12e-6, w)
            for h in (0.045, 0.0)
        },
    ),
    "drag.rolling_bearing": lambda: over(
        SPEED,
        (0, 200),
        TORQUE,
        {f"{1e6 * v:g} mm²/s": lambda w, v=v: drag.rolling_bearing(12.0, 0.045, v, w) for v in (34e-6, 12e-6)},
    ),
}
"""Curves by ``module.function``."""
IN_OIL: dict[str, Callable[[], Plot]] = {
    "film.kinematic_viscosity": lambda: over(
        "temperature [°C]",
        (0, 120),
        "kinematic viscosity [mm²/s]",
        {"34 mm²/s at 40 °C, 7 mm²/s at 100 °C": lambda t: film.kinematic_viscosity(OIL, t)},
        log="y",
        units=(1.0, 1e-6),
    ),
    "film.density": lambda: over(
        "temperature [°C]", (0, 120), "density [kg/m³]", {"850 kg/m³ at 15 °C": lambda t: film.density(850.0, t)}
    ),
    "film.dynamic_viscosity": lambda: over(
        "temperature [°C]",
        (0, 120),
        "viscosity [Pa s]",
        {"the same oil": lambda t: film.dynamic_viscosity(OIL, 850.0, t)},
        log="y",
    ),
    "film.equivalent_radius": lambda: over(
        "working pressure angle [°]",
        (np.radians(15), np.radians(30)),
        "radius [mm]",
        {
            f"base helix angle {b}°": lambda a, b=b: film.equivalent_radius(24.476e-3, 61.909e-3, a, np.radians(b))
            for b in (0, 26)
        },
        units=(np.pi / 180, 1e-3),
    ),
    "film.contact_length": lambda: over(
        "base helix angle [°]",
        (0.0, np.radians(35)),
        "length [mm]",
        {f"contact ratio {e}": lambda b, e=e: film.contact_length(16e-3, e, b) for e in (1.372, 1.7)},
        units=(np.pi / 180, 1e-3),
    ),
    "film.rolling_radius": lambda: over(
        "working pressure angle [°]",
        (np.radians(15), np.radians(30)),
        "rolling radius [mm]",
        {f"base helix angle {b}°": lambda a, b=b: film.rolling_radius(24.476e-3, a, np.radians(b)) for b in (0, 26)},
        units=(np.pi / 180, 1e-3),
    ),
    "film.entraining_speed": lambda: over(
        "rolling speed of either flank [m/s]",
        (0, 5),
        "entraining speed [m/s]",
        {
            "helix angle 28°": lambda v: film.entraining_speed(v, v, 0.488692, 0.456892),
            "spur": lambda v: film.entraining_speed(v, v, 0.0, 0.0),
        },
    ),
    "film.wedge": lambda: over(
        "film thickness h [µm]",
        (THIN, 1e-4),
        "Cw [N s/m]",
        {f"{mu} Pa s": lambda h, mu=mu: film.wedge(h, viscosity=mu, **FILM) for mu in (COLD, WARM)},
        log="xy",
        units=(1e-6, 1.0),
    ),
    "film.squeeze": lambda: over(
        "film thickness h [µm]",
        (THIN, 1e-4),
        "Cs [N s/m]",
        {f"{mu} Pa s": lambda h, mu=mu: film.squeeze(h, viscosity=mu, **FILM) for mu in (COLD, WARM)},
        log="xy",
        units=(1e-6, 1.0),
    ),
    "film.film_force": lambda: over(
        "film thickness h [µm]",
        (THIN, 1e-4),
        "force [N]",
        {
            f"{way}, u = 3.1 m/s": lambda h, v=v: film.film_force(h, v, 3.1, viscosity=WARM, **FILM)
            for way, v in (("approach at 10 mm/s", -0.01), ("rest or leaving", 0.0))
        },
        log="xy",
        units=(1e-6, 1.0),
    ),
    "film.mesh_film_force": lambda: over(
        "displacement xn from the middle [µm]",
        (-62e-6, 62e-6),
        "force of both films [N]",
        {
            f"ẋn = {1e3 * v:g} mm/s": lambda x, v=v: film.mesh_film_force(
                x, v, 62.5e-6, 3.1, viscosity=WARM, minimum=THIN, **FILM
            )
            for v in (0.0, 10e-3)
        },
        units=(1e-6, 1.0),
    ),
    "film.resting_thickness": lambda: over(
        "load on the flank [N]",
        (0.1, 100),
        "film thickness [µm]",
        {
            f"{mu} Pa s, u = 3.1 m/s": lambda f, mu=mu: film.resting_thickness(f, 3.1, viscosity=mu, **FILM)
            for mu in (COLD, WARM)
        },
        log="xy",
        units=(1.0, 1e-6),
    ),
    "film.squeezed_speed": lambda: over(
        "film thickness h [µm]",
        (THIN, 60e-6),
        "speed of approach [mm/s]",
        {
            f"{1e3 * v:g} mm/s at 60 µm": lambda h, v=v: film.squeezed_speed(h, 60e-6, v, 1.2, viscosity=WARM, **FILM)
            for v in (20e-3, 10e-3)
        },
        log="x",
        units=(1e-6, 1e-3),
    ),
}
"""Curves by ``module.function``."""
OTHERS: dict[str, Callable[[], Plot]] = {
    "contact.restitution": lambda: over(
        "velocity ṡ⁻ [mm/s]",
        (-0.1, 0.1),
        RESTITUTION,
        {
            "e0 = 0.5": lambda v: contact.restitution(0.5, v),
            "slope -5 s/m": lambda v: contact.restitution(0.5, v, slope=-5.0),
            "asymmetry 0.1": lambda v: contact.restitution(0.5, v, asymmetry=0.1),
        },
        units=(1e-3, 1.0),
    ),
    "contact.damping_ratio": lambda: over(RESTITUTION, (0, 1), "damping ratio ζ", {"": contact.damping_ratio}),
    "contact.restitution_of": lambda: over("damping ratio ζ", (0, 1), RESTITUTION, {"": contact.restitution_of}),
    "contact.scatter": _scatter,
    "noise.pressure_level": lambda: over(
        "sound pressure [Pa]", (2e-5, 2), "level [dB]", {"re 20 µPa": noise.pressure_level}, log="x"
    ),
    "noise.power_level": lambda: over(
        "power [W]", (1e-12, 1e-2), "level [dB]", {"re 1 pW": noise.power_level}, log="x"
    ),
    "noise.impacts_per_second": lambda: over(
        "frequency ω/2π [Hz]",
        (0, 2 * np.pi * 10),
        "impacts a second",
        {"two in each period": noise.impacts_per_second},
        units=(2 * np.pi, 1.0),
    ),
    "noise.rattle_drive": lambda: over(
        "amplitude ΔΩ [rpm]",
        (0, 20 * np.pi / 30),
        "ω²·ΔΩ [rad³/s³]",
        {f"{f} Hz": lambda a, f=f: noise.rattle_drive(2 * np.pi * f, a) for f in (3, 5, 10)},
        units=(np.pi / 30, 1.0),
    ),
    "noise.rattle_level": lambda: over(
        "frequency ω/2π [Hz]",
        (2 * np.pi, 2 * np.pi * 20),
        "level of rattle [dB]",
        {f"ΔΩ = {a} rpm, A = 10⁴ s³/rad³": lambda w, a=a: noise.rattle_level(w, a * np.pi / 30, 1e4) for a in (5, 20)},
        log="x",
        units=(2 * np.pi, 1.0),
    ),
    "noise.total_level": lambda: over(
        "level of rattle [dB]",
        (60, 100),
        "both together [dB]",
        {f"whine of {w} dB": lambda r, w=w: noise.total_level(w, r) for w in (78, 90)},
    ),
}
"""Curves by ``module.function``."""
CURVES = TORQUES | IN_OIL | OTHERS

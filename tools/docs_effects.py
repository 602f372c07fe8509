"""The documentation's page of the effects, with a picture of each: its law, and what it does to a rattling gear."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
from docs_drawing import BLUE, GREY, ORANGE, POINTS, canvas, legend, save
from docs_reference import arguments, cell, prose
from matplotlib.axes import Axes

from gears3d import load
from gears3d.effects import Code, Flank, Row, catalogue
from gears3d.effects.rows import torque_constant
from gears3d.effects.support import TAKEN, models_of
from gears3d.engine.impact import ImpactLaw
from gears3d.engine.torques import FREE, ON_ACTIVE, friction, resisting, torque_table
from gears3d.gears import quasi_static
from gears3d.recording import Recording
from gears3d.scenario import Scenario
from gears3d.scenario.models import eccentricities, flank_deviations
from gears3d.simulation import simulate
from gears3d.units import FAMILIES, show

BASE = Path(__file__).resolve().parents[1] / "scenarios" / "rigaud-2020" / "fig5-20rpm.toml"
MILD = {"run.duration": "2 s", "motion.harmonics[0].amplitude": "5 rpm", "impact.restitution": 0.5}
"""What of it is otherwise: a swing that takes the gear across slowly enough for small causes to show."""
PERIODS = (3.0, 4.3)
"""What is shown, in periods of the fluctuation."""
SPRING = {"kind": "tooth_compliance", "stiffness": "2.6e6 N/m", "damping": "557 N s/m"}
EXAMPLES: dict[str, dict[str, Any]] = {
    "backlash_offset": {"offset": "100 um"},
    "backlash_variation": {"amplitude": "80 um", "order": 2},
    "carried_inertia": {"inertia": "0.03 kg m^2", "stiffness": "40 N m/rad", "damping": "0.05 N m s/rad"},
    "drag_coulomb": {"torque": "0.2 N m"},
    "drag_differential": {"coefficient": "50 mN m s/rad", "shaft_speed": "0 rpm"},
    "drag_drift": {"relative_change": 1.0, "time_constant": "1 s"},
    "drag_position": {"amplitude": "0.15 N m", "order": 2},
    "drag_power": {"coefficient": "30 mN m", "exponent": 1.5},
    "drag_stick_slip": {"amplitude": "0.15 N m", "angle": "40 deg"},
    "drag_viscous": {"coefficient": "50 mN m s/rad"},
    "drive_motion": {"amplitude": "2 rpm", "frequency": "9 Hz"},
    "eccentricity": {"offset": "60 um", "gear": "drive"},
    "encoder_eccentricity": {"amplitude": "0.4 mrad", "gear": "loose"},
    "encoder_skew": {"delay": "0.2 ms", "gear": "loose"},
    "mesh_drag": {"coefficient": "50 mN m s/rad"},
    "mesh_friction": {"coefficient": 0.1},
    "oil_film": {"viscosity": "0.5 Pa s"},
    "pitch_error": {"offset": "60 um", "tooth": 50},
    "restitution_asymmetry": {"asymmetry": 0.4},
    "restitution_offset": {"offset": 0.3},
    "restitution_scatter": {"standard_deviation": 0.15},
    "restitution_speed": {"slope": "10 s/m"},
    "tooth_compliance": {"stiffness": "2e5 N/m", "damping": "60 N s/m"},
    "transmission_error": {"amplitude": "50 um", "order": 3},
}
"""Parameters of each effect in its picture, by kind."""
BESIDE = {"mesh_friction": [SPRING]}
"""What else is in the scenario, with and without the effect."""


def support() -> str:
    """Return the table of the models in which each effect acts; `native` is Bullet's own contact."""
    base = load(BASE, MILD)
    rig = base.rig()
    lines = [f"| effect | {' | '.join(TAKEN)} |", "|---|" + "---|" * len(TAKEN)]
    for kind in sorted(catalogue()):
        effect = base.with_({"effect": [{"kind": kind, **EXAMPLES[kind]}]}).effects[-1]
        acts = models_of(effect, rig)
        lines.append(f"| `{kind}` | {' | '.join('yes' if model in acts else 'no' for model in TAKEN)} |")
    return "\n".join(lines)


def effects() -> str:
    """Return the page of all effects: what each is, where it acts, its source and its parameters."""
    page = [
        "# Effects",
        "Made from `gears3d.effects`. An effect is one physical cause; it is appended to a scenario as `[[effect]]` "
        "and acts in the models of the table. Parameters without a default are required. Each picture shows the law "
        "and its consequence for the same gear: `rigaud-2020/fig5-20rpm` with a speed fluctuation of 5 rpm and a "
        "restitution of 0.5, with and without the lines above the picture; drawn by the rigid model when this site is "
        "built (`tools/docs`).",
    ]
    page.append(f"## models\n\n{support()}")
    known = sorted(catalogue().items(), key=lambda one: (one[1].place, one[0]))
    place = ""
    for kind, effect in known:
        if effect.place != place:
            place = effect.place
            page.append(f"## {place.replace('_', ' ')}")
        page.append(f"### {kind}")
        page.append(prose(inspect.getdoc(effect) or ""))
        rows, told = [], arguments(inspect.getdoc(effect) or "")
        for name, one in effect.params.items():
            family = FAMILIES.get(one.family)
            if one.choices:
                kind_of = ", ".join(f"`{word}`" for word in one.choices)
            else:
                kind_of = f'{family.words}, e.g. `"{family.example}"`' if family else one.family
            default = "" if one.default is None else f"`{given(one.default, one.family)}`"
            rows.append(f"| `{name}` | {cell(told.get(name, ''))} | {cell(kind_of)} | {default} |")
        page.append(f"```toml\n{toml(kind)}\n```")
        if kind in BESIDE:
            others = " and ".join(f"`{one['kind']}`" for one in BESIDE[kind])
            page.append(f"In the picture {others} acts in both curves.")
        page.append(f"![Law of {kind.replace('_', ' ')}, and the displacement with it and without]({picture(kind)})")
        page.append("| parameter | what it is | given as | default |\n|---|---|---|---|\n" + "\n".join(rows))
    return "\n\n".join(page) + "\n"


def given(value: Any, family: str) -> str:
    """Return a default as a scenario would give it."""
    return (
        show(value, family) if isinstance(value, float) and family in FAMILIES and FAMILIES[family].si else str(value)
    )


def toml(kind: str) -> str:
    """Return the example of an effect as a scenario has it."""
    values = (f'{key} = "{one}"' if isinstance(one, str) else f"{key} = {one}" for key, one in EXAMPLES[kind].items())
    return "\n".join(["[[effect]]", f'kind = "{kind}"', *values])


def picture(kind: str) -> str:
    """Return where an effect's picture lies beside the page."""
    return f"effects/{kind.replace('_', '-')}.png"


def draw_effects(folder: Path) -> None:
    """Draw the picture of every effect.

    Args:
        folder: of the page.
    """
    base = load(BASE, MILD)
    for kind in EXAMPLES:
        print(f"effects.md: {kind}", flush=True)
        draw(kind, base, folder / picture(kind))


def draw(kind: str, base: Scenario, path: Path) -> None:
    """Draw one effect: its law, and the displacement with it and without.

    Args:
        kind: of the effect.
        base: the scenario that it is added to.
        path: of the picture.
    """
    before = base.with_({"effect": BESIDE.get(kind, [])})
    after = base.with_({"effect": [*BESIDE.get(kind, []), {"kind": kind, **EXAMPLES[kind]}]})
    without, with_it = simulate(before, "rigid"), simulate(after, "rigid")
    figure = canvas(9.2, 3.0)
    law, motion = figure.subplots(1, 2)
    effect = after.effects[-1]
    LAWS[effect.place](law, effect, before, after, (without, with_it))
    begin, end = (one / base.motion.harmonics[0].frequency for one in PERIODS)
    for name, one, style in (
        ("without", without, {"color": GREY}),
        (f"with {kind}", with_it, {"color": "black", "linestyle": "--"}),
    ):
        part = one.between(begin, end)
        motion.plot(part.time, 1e6 * part.signals["displacement_m"], label=name, linewidth=1.1, **style)
    motion.set(xlabel="time [s]", ylabel="displacement [µm]")
    for axes in (law, motion):
        legend(axes)
    save(figure, path)


def geometry(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw where both flanks touch over a turn of the drive, or over the teeth beside a single one."""
    turn = 2.0 * np.pi
    theta = np.linspace(0.0, turn, 4 * POINTS)
    if tooth := getattr(effect, "tooth", 0):
        theta = np.linspace(tooth - 4.0, tooth + 2.0, 2 * POINTS) * turn / before.gears.drive.teeth
    for one, style in ((before, {"color": GREY}), (after, {})):
        rows = one.rows()
        pair = one.pair().with_deviations(*flank_deviations(rows)).with_mounting(*eccentricities(rows))
        found = quasi_static(pair, theta)
        for flank, place, colour in (
            ("active", found.phi_active, BLUE),
            ("reverse", found.phi_active + found.backlash, ORANGE),
        ):
            named = {"color": colour, "label": f"{flank} flank"} if one is after else {}
            axes.plot(np.degrees(theta), 1e6 * place, **{**style, **named})
    axes.set(xlabel="angle of the drive [°]", ylabel="place of the flanks [µm]")


def torque(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw the torque over what it depends on, with the base drag."""
    rows = after.rows()
    if friction(rows):
        force = np.linspace(0.0, 50.0, POINTS)
        lever = friction(rows) * after.rig().base_radius_loose
        axes.plot(force, lever * force, color=BLUE)
        axes.set(xlabel="force between the flanks [N]", ylabel="torque [N m]")
        return
    table = torque_table([torque_constant(after.drag.torque), *rows])
    omega = after.rig().mean_speed_loose
    codes = {row.code for row in rows}
    if Code.TORQUE_HARMONIC in codes:
        x, label = np.linspace(0.0, 360.0, POINTS), "angle of the loose gear [°]"
        states = [(0.0, np.radians(one), omega) for one in x]
    elif Code.TORQUE_RELAX in codes:
        x, label = np.linspace(0.0, 5.0, POINTS), "time [s]"
        states = [(one, 0.0, omega) for one in x]
    else:
        x, label = np.linspace(0.0, 60.0, POINTS), "speed of the loose gear [rpm]"
        states = [(0.0, 0.0, one * np.pi / 30.0) for one in x]
    for name, place, style in (("in contact", ON_ACTIVE, "-"), ("in flight", FREE, "--")):
        values = [sum(resisting(table, place, *state)) for state in states]
        axes.plot(x, values, color=BLUE if place else ORANGE, linestyle=style, label=name)
    axes.axhline(after.drag.torque, color=GREY, label="base drag")
    axes.set(xlabel=label, ylabel="torque [N m]", ylim=(0, None))


def impact(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw the restitution over the impact speed on both flanks; what scatters as dots."""
    rows = after.rows()
    scattered = any(row.code == Code.IMPACT_SCATTER for row in rows)
    speed = np.linspace(0.0, 0.06, 100)
    law = ImpactLaw(after.impact.restitution, rows, seed=0)
    for flank, colour, style in ((Flank.ACTIVE, BLUE, "-"), (Flank.REVERSE, ORANGE, "--")):
        values = [law.coefficient(flank, one) for one in speed]
        named: dict[str, Any] = (
            {"linestyle": "", "marker": "os"[flank], "markersize": 3} if scattered else {"linestyle": style}
        )
        axes.plot(1e3 * speed, values, color=colour, label=f"{flank.name.lower()} flank", **named)
    axes.axhline(after.impact.restitution, color=GREY, label="without")
    axes.set(xlabel="impact speed [mm/s]", ylabel="restitution e", ylim=(0, 1))


def gap_force(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw the force of a flank over the gap."""
    row = after.rows()[-1]
    film = row.code == Code.GAP_FILM
    gap = np.geomspace(1e-6, 1e-4, POINTS) if film else np.linspace(-3e-4, 1e-4, POINTS)
    for colour, style, rate in ((BLUE, "-", 0.0), (ORANGE, "--", -0.01)):
        force = _film(row, gap, rate, after) if film else _spring(row, gap, rate)
        axes.plot(1e6 * gap, force, color=colour, linestyle=style, label=f"approach at {1e3 * abs(rate):g} mm/s")
    axes.set(xlabel="gap [µm]", ylabel="force [N]")
    if film:
        axes.set(xscale="log", yscale="log")


def _spring(row: Row, gap: np.ndarray, rate: float) -> np.ndarray:
    stiffness, damping = row.p
    return np.where(gap < 0.0, np.maximum(0.0, -stiffness * gap - damping * rate), 0.0)


def _film(row: Row, gap: np.ndarray, rate: float, scenario: Scenario) -> np.ndarray:
    wedge, squeeze, drive, loose, minimum, _ = row.p
    height = np.maximum(gap, minimum)
    rolling = drive * scenario.rig().mean_speed + loose * scenario.rig().mean_speed_loose
    return wedge * abs(rolling) / height - squeeze * min(rate, 0.0) / height**1.5


def motion(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw the speed of the drive."""
    begin, end = (one / before.motion.harmonics[0].frequency for one in PERIODS)
    for name, one, style in (("without", runs[0], {"color": GREY}), ("with it", runs[1], {"color": BLUE})):
        part = one.between(begin, end)
        axes.plot(part.time, part.signals["omega_drive_rad_s"] * 30.0 / np.pi, label=name, **style)
    axes.set(xlabel="time [s]", ylabel="speed of the drive [rpm]")


def sensor(axes: Axes, effect: Any, before: Scenario, after: Scenario, runs: tuple[Recording, Recording]) -> None:
    """Draw what is read less what is true."""
    time = runs[0].time
    true = {gear: runs[0].signals[f"theta_{gear}_rad"] for gear in ("drive", "loose")}
    off = effect.observe(true, time)[effect.gear] - true[effect.gear]
    shown = time <= PERIODS[1] / before.motion.harmonics[0].frequency
    axes.plot(time[shown], 1e3 * off[shown], color=BLUE)
    axes.set(xlabel="time [s]", ylabel=f"reading less truth, {effect.gear} [mrad]")


LAWS = {
    "geometry": geometry,
    "torque": torque,
    "impact": impact,
    "gap_force": gap_force,
    "motion": motion,
    "sensor": sensor,
}
"""Who draws the law, by the effect's place."""

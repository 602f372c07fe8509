"""The mesh in its transverse section: at true scale, and again with the backlash exaggerated."""

from __future__ import annotations

from dataclasses import replace
from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from gears3d.gears.involute import inv
from gears3d.gears.rack import fillet_points, form
from gears3d.views.plots.numbers import figure, plain

if TYPE_CHECKING:
    from gears3d.gears import Gear, Pair

FACTORS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
WIDTH, HEIGHT = 300.0, 380.0
"""Of one panel, in units of the drawing."""


def mesh_drawing(pair: Pair) -> Markup:
    """Return the mesh around the pitch point as an SVG drawing of two panels."""
    factor = exaggeration(pair)
    wide = replace(pair, thinning=pair.thinning + 0.5 * (factor - 1) * pair.backlash, deviations=())
    gap = figure(pair.backlash, "length").text
    left = _panel(pair, 0.0, 2.6 * _pitch(pair), 0.0, "true scale, active flanks in contact")
    right = _panel(wide, 0.5 * wide.backlash, 1.5 * _pitch(pair), WIDTH + 20.0, f"backlash drawn × {factor}, mid-gap")
    label = f"Transverse section of the mesh at true scale, and with the backlash of {gap} drawn {factor} times as wide"
    caption = (
        f"Transverse section at the pitch point: drive gear on the left, turning upwards, loose gear on the right. "
        f"Solid: path of contact on the active line of action (blue); dashed: the reverse one (orange). "
        f"Working pressure angle {plain(np.degrees(pair.working_pressure_angle))}°, "
        f"contact ratio {plain(pair.contact_ratio)}, backlash {gap}: on the left at true scale, "
        f"on the right with teeth thinned until it is {factor} times as wide."
    )
    return Markup(
        f'<svg viewBox="0 0 {2 * WIDTH + 20:g} {HEIGHT + 24:g}" role="img" aria-label="{label}">{left}{right}</svg>'
        f"<figcaption>{caption}</figcaption>"
    )


def exaggeration(pair: Pair) -> int:
    """Return the largest round factor that keeps the backlash within 30 % of a base pitch."""
    most = 0.3 * pair.drive.base_pitch
    return max((f for f in FACTORS if f * pair.backlash <= most), default=1) if pair.backlash > 0 else 1


def tooth(gear: Gear, half_angle: float, steps: int = 14) -> np.ndarray:
    """Return half a tooth, from the middle of the space to the tip."""
    lowest, angle = form(gear, half_angle)
    roots = fillet_points(gear, half_angle, np.linspace(0.5 * pi, angle, steps))
    roll = np.linspace(max(lowest, 0.0), gear.tip_roll, steps)
    flank = np.stack([gear.base_radius * np.sqrt(1 + roll**2), half_angle - (roll - np.arctan(roll))], axis=1)
    return np.vstack([[roots[0, 0], pi / gear.teeth], roots, flank])


def _pitch(pair: Pair) -> float:
    """Return the circular pitch at the working pitch circles [m]."""
    return pair.drive.base_pitch / cos(pair.working_pressure_angle)


def _panel(pair: Pair, displacement: float, height: float, left: float, title: str) -> str:
    """Return one panel: the surroundings of the pitch point, ``height`` [m] high, as a nested SVG element."""
    scale = HEIGHT / height
    pitch_point = pair.centre_distance * pair.drive.base_radius / (pair.drive.base_radius + pair.loose.base_radius)
    turn = {"drive": 0.0, "loose": displacement / pair.loose.base_radius}

    def place(points: np.ndarray) -> np.ndarray:
        return np.stack([(points[:, 0] - pitch_point) * scale + WIDTH / 2, HEIGHT / 2 - points[:, 1] * scale], axis=1)

    parts = []
    for which in ("drive", "loose"):
        body, active, reverse = _outline(pair, which, turn[which], height)
        parts.append(f'<path class="gear-{which}" d="{_path(place(body))}Z"/>')
        parts += [f'<path class="edge-active" d="{_path(place(one))}"/>' for one in active]
        parts += [f'<path class="edge-reverse" d="{_path(place(one))}"/>' for one in reverse]
        parts.append(f'<path class="pitch-circle" d="{_path(place(_circle(pair, which, height)))}"/>')
    parts += [f'<path class="{name}" d="{_path(place(line))}"/>' for name, line in _lines_of_action(pair, height)]
    parts.append(f'<circle class="pitch-point" cx="{WIDTH / 2:g}" cy="{HEIGHT / 2:g}" r="2.6"/>')
    parts.append(_scale_bar(height, scale))
    parts += [
        f'<text x="10" y="20">drive</text><text x="{WIDTH - 10:g}" y="20" text-anchor="end">loose</text>',
        f'<path class="arrow" d="M22 {HEIGHT / 2 + 30:g}v-52m-5 9l5 -9l5 9"/>',
    ]
    frame = f'<rect class="frame" width="{WIDTH:g}" height="{HEIGHT:g}"/>'
    return (
        f'<svg x="{left:g}" width="{WIDTH:g}" height="{HEIGHT:g}" overflow="hidden">{"".join(parts)}{frame}</svg>'
        f'<text x="{left:g}" y="{HEIGHT + 18:g}">{title}</text>'
    )


def _outline(pair: Pair, which: str, turned: float, height: float) -> tuple[np.ndarray, list, list]:
    """Return the body near the mesh, and its active and reverse flanks, as world points [m]."""
    gear, half = pair.gear(which), pair.half_angle(which)
    half_tooth = tooth(gear, half)
    middle = inv(pair.working_pressure_angle) - half
    count = int(height / _pitch(pair)) + 3
    body, active, reverse = [], [], []
    flank = len(half_tooth) // 2 + 1
    for k in range(-count, count + 1):
        at = middle + 2 * pi * k / gear.teeth
        low = np.stack([half_tooth[:, 0], at - half_tooth[:, 1]], axis=1)
        high = np.stack([half_tooth[::-1, 0], at + half_tooth[::-1, 1]], axis=1)
        body += [low, high]
        reverse.append(low[flank:])
        active.append(high[:-flank])
    first, last = body[0][0, 1], body[-1][-1, 1]
    inner = gear.root_radius - 3 * height
    body.append(np.array([[max(inner, 0.0), last], [max(inner, 0.0), first]]))

    def world(polar: np.ndarray) -> np.ndarray:
        angle = polar[:, 1] + pair.rotation(which, turned)
        return np.stack([polar[:, 0] * np.cos(angle), polar[:, 0] * np.sin(angle)], axis=1) + pair.centre(which)[:2]

    return world(np.vstack(body)), [world(one) for one in active], [world(one) for one in reverse]


def _circle(pair: Pair, which: str, height: float) -> np.ndarray:
    """Return the stretch of the working pitch circle near the mesh [m]."""
    radius = pair.gear(which).base_radius / cos(pair.working_pressure_angle)
    angle = np.linspace(-1, 1, 33) * min(height / radius, pi) + (pi if which == "loose" else 0.0)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1) + pair.centre(which)[:2]


def _lines_of_action(pair: Pair, height: float) -> list[tuple[str, np.ndarray]]:
    """Return both lines of action and the paths of contact on them, as world points [m]."""
    alpha, base = pair.working_pressure_angle, pair.drive.base_radius
    begin, end = pair.start_roll("drive") * base, pair.drive.tip_roll * base
    lines = []
    for name, up in (("active", 1.0), ("reverse", -1.0)):
        touch = np.array([base * cos(alpha), -up * base * sin(alpha)])
        along = np.array([sin(alpha), up * cos(alpha)])
        middle = base * np.tan(alpha)
        lines.append((f"action-{name}", np.array([touch + along * (middle + far) for far in (-height, height)])))
        lines.append((f"contact-{name}", np.array([touch + along * far for far in (begin, end)])))
    return lines


def _scale_bar(height: float, scale: float) -> str:
    power = 10.0 ** np.floor(np.log10(height / 4))
    length = max(step * power for step in (1, 2, 5) if step * power <= height / 4)
    right, y = WIDTH - 12, HEIGHT - 12
    text = figure(float(length), "length", 3).text
    return (
        f'<path class="scale" d="M{right - length * scale:.1f} {y:g}H{right:g}"/>'
        f'<text x="{right:g}" y="{y - 6:g}" text-anchor="end">{text}</text>'
    )


def _path(points: np.ndarray) -> str:
    """Return points as SVG path data."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)

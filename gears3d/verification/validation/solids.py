"""The solids: watertight, flanks on the involute, the backlash that was asked."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gears3d.gears import Pair, nearest_gap, piece_budget, solid
from gears3d.simulation import simulate
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

CHORD = 0.2e-6


def chord_error(pair: Pair, which: str) -> float:
    """Return how far the solid's chords lie off the involute at most [m], from the solid's vertices alone.

    A string unwound from the base circle to a point at radius r has the length t = sqrt(r² - rb²) and leaves the circle
    at the polar angle of the point plus t/rb - atan(t/rb), the same angle for every point of one involute. At the
    middle of a chord it differs by the chord's sag over rb.
    """
    gear = pair.gear(which)
    body = solid(pair, which, chord=CHORD)
    corners = body.triangles[np.abs(body.face_normals[:, 2]) < 0.5][:, :, :2]
    edges = np.concatenate([corners[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    radius = np.linalg.norm(edges, axis=2)
    start = gear.base_radius * np.hypot(1.0, pair.start_roll(which))
    on_flank = (radius.min(axis=1) > start) & (radius.max(axis=1) <= gear.tip_radius + 1e-12)
    on_flank &= np.ptp(radius, axis=1) > 1e-9
    tips = edges[np.abs(radius - gear.tip_radius) < 1e-12]
    turn = np.exp(1j * gear.teeth * np.arctan2(tips[:, 1], tips[:, 0]))
    centre = float(np.angle(turn.mean()) / gear.teeth)
    ends = _foot(edges[on_flank], gear.base_radius, gear.teeth, centre)
    middle = _foot(edges[on_flank].mean(axis=1), gear.base_radius, gear.teeth, centre)
    return float(np.abs(middle - ends.mean(axis=1)).max() * gear.base_radius)


def _foot(points: np.ndarray, base: float, teeth: int, centre: float) -> np.ndarray:
    """Return the angle from the tooth's centre line at which a point's involute leaves the base circle [rad]."""
    unwound = np.sqrt(np.sum(points**2, axis=-1) / base**2 - 1)
    pitch = 2 * np.pi / teeth
    angle = np.arctan2(points[..., 1], points[..., 0]) - centre
    return np.abs(angle - pitch * np.round(angle / pitch)) + unwound - np.arctan(unwound)


def refined_backlash(pair: Pair, theta: float) -> float:
    """Return the gap on the reverse flank while the active one touches, from the flank surfaces [m].

    Units: ``theta`` [rad].
    """
    flanks = pair.compiled()
    loose = theta * pair.drive.base_radius / pair.loose.base_radius
    for _ in range(3):
        found = nearest_gap(flanks, theta, loose, 0)
        loose -= found[2] / found[4]
    return float(nearest_gap(flanks, theta, loose, 1)[2])


def raw_error() -> float:
    """Return how far Bullet's own measure of the backlash is off, both flanks together, over 0.4 s of figure 5 [m]."""
    budget = simulate(fig5(run__duration="0.4 s")).meta["error_budget"]
    return abs(2.0 * (budget["raw_minus_refined_mean"] + budget["hull_margins"]))


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    pair = fig5().pair()
    for which in ("drive", "loose"):
        body = solid(pair, which, chord=CHORD)
        yield Check(f"{which}: watertight, wound consistently, one body: faults", float(not _whole(body)), 0)
        yield Check(f"{which}: chords off the involute", chord_error(pair, which), CHORD, "m")
    angles = np.linspace(0, 2 * np.pi, 181)
    worst = max(abs(refined_backlash(pair, float(theta)) - 250e-6) for theta in angles)
    yield Check("backlash asked, refined on the flanks over a turn: largest error", worst, 0.01e-6, "m")
    yield Check("backlash asked, raw in Bullet less its margins, both flanks: mean error", raw_error(), 0.5e-6, "m")
    yield Check("hull pieces: chord error", piece_budget(pair)["chord_error_m"], 0.2e-6, "m")


def _whole(body) -> bool:  # type: ignore[no-untyped-def]
    return bool(body.is_watertight and body.is_winding_consistent and body.body_count == 1 and body.volume > 0)

"""Random pairs against gears cut by a rack, polygon by polygon, and laid over each other by shapely.

The second opinion (:mod:`rackcut`) shares no formula with gears3d beyond the definition of the rack. Lengths are in
modules.
"""

import importlib.util
import re
from dataclasses import dataclass
from math import cos, pi, radians, sin, tan
from pathlib import Path

import numpy as np
import pytest
from shapely.geometry import Polygon, box

from gears3d.errors import InputError
from gears3d.gears import Gear, Pair
from gears3d.gears.outline import outline

SPEC = importlib.util.spec_from_file_location("rackcut", Path(__file__).with_name("rackcut.py"))
rackcut = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(rackcut)

SCALLOP = 2e-5
"""What the rack's steps and the polygons' chords leave on a flank, at most."""
TINY = 3e-6
"""Area of two polygons that only touch: scallops along a flank on each of the pairs of teeth in contact."""
GRAZE = 2e-5
"""Area of overlap from which on teeth certainly dig into each other."""


@dataclass
class Case:
    """Two random gears with what gears3d says of them."""

    drive: rackcut.Shape
    loose: rackcut.Shape
    backlash: float
    pair: Pair | None
    said: str

    def __post_init__(self):
        self.angle = rackcut.working_angle(self.drive, self.loose, self.backlash)
        self.distance = (self.drive.base + self.loose.base) / cos(self.angle)
        self.cut = rackcut.section(self.drive), rackcut.section(self.loose)

    def lay(self, theta, extra=0.0):
        """Both sections at a drive angle, the loose gear ahead by ``extra`` along the line of action."""
        drive = rackcut.posed(self.cut[0], self.drive, self.angle, True, theta)
        ahead = (theta * self.drive.base + extra) / self.loose.base
        return drive, rackcut.posed(self.cut[1], self.loose, self.angle, False, ahead, self.distance)

    def thetas(self, count=6):
        return (np.arange(count) / count - 0.5) * 2 * pi / self.drive.teeth


def random_case(number):
    """The case of a number: the same on every machine; ``None`` where there are no such gears at all."""
    rng = np.random.default_rng(number)
    rack = radians(rng.uniform(16, 26)), radians(rng.choice([0.0, rng.uniform(5, 32)]))
    shapes = []
    for _ in range(2):
        teeth, shift = int(np.exp(rng.uniform(np.log(8), np.log(90)))), rng.uniform(-0.4, 0.8)
        addendum = rng.uniform(0.8, 1.15)
        dedendum = addendum + rng.uniform(0.15, 0.35)
        shapes.append(rackcut.Shape(teeth, *rack, shift, addendum, dedendum, rng.uniform(0.08, 0.25)))
    backlash = rng.uniform(0.01, 0.05)
    try:
        gears = [Gear(1.0, s.teeth, *rack, 10.0, *s[3:]) for s in shapes]
    except InputError:
        return None  # pointed teeth, a rack without a tip: nothing to lay over each other
    try:
        return Case(*shapes, backlash, Pair.from_backlash(*gears, backlash), "")
    except InputError as error:
        said = str(error)
        return None if "contact ratio" in said or "no solution" in said else Case(*shapes, backlash, None, said)


def overlap(case):
    """Largest area that the cut gears share over a mesh, active flanks in contact as the involutes say."""
    return max(a.intersection(b).area for a, b in (case.lay(theta) for theta in case.thetas(6 if case.pair else 24)))


def tip_clearances(case):
    """Distance of each tip circle from the mate's root circle."""
    for one, other in ((case.drive, case.loose), (case.loose, case.drive)):
        yield case.distance - one.tip - (other.reference + other.shift - other.dedendum)


def check_mesh(case):
    """Touching where gears3d says contact is, apart by less backlash, overlapping when turned slightly into it."""
    for theta in case.thetas()[::3]:
        drive, loose = case.lay(theta)
        assert drive.distance(loose) < 2 * SCALLOP
        for ahead, sign in ((0.3 * case.backlash, 1), (0.7 * case.backlash, -1)):
            gap = ahead if sign > 0 else case.backlash - ahead
            drive, loose = case.lay(theta, ahead)
            slack = 3 * SCALLOP + 5e-3 * gap
            assert drive.distance(loose) <= gap + slack
            if min(tip_clearances(case)) > 0.1:  # else a tip may be nearer to a root than flank to flank
                assert drive.distance(loose) >= gap - slack
        for ahead in (-2e-3, case.backlash + 2e-3):
            drive, loose = case.lay(theta, ahead)
            assert drive.intersection(loose).area > 1e-4


def check_outlines(case):
    """The product's own outlines are those that the rack leaves, fillets and undercuts included."""
    for number, which in enumerate(("drive", "loose")):
        shape = (case.drive, case.loose)[number]
        turn = case.pair.rotation(which, 0.0)
        points = outline(case.pair, which, 1e-5).points.reshape(-1, 2)
        ours = points @ np.array([[cos(turn), sin(turn)], [-sin(turn), cos(turn)]]) + case.pair.centre(which)[:2]
        cut = rackcut.posed(case.cut[number], shape, case.angle, number == 0, 0.0, number * case.distance)
        root = shape.reference + shape.shift - shape.dedendum
        side = 1 if number == 0 else -1
        ends = sorted((number * case.distance + side * (root - 0.3), number * case.distance + side * (shape.tip + 1.0)))
        half = min(1.5, 0.5 * shape.reference)
        window = box(ends[0], -half, ends[1], half)
        apart = Polygon(ours).intersection(window).symmetric_difference(cut.intersection(window))
        assert apart.area < 40 * SCALLOP
        assert apart.buffer(-10 * SCALLOP).is_empty


def run(numbers):
    """Check the cases of some numbers; count what gears3d says, and what is too close to call."""
    counts = {"mesh": 0, "dig": 0, "undercut": 0, "close": 0}
    for number in numbers:
        case = random_case(number)
        if case is None:
            continue
        area = overlap(case)
        deep = [float(depth) * 1e-6 for depth in re.findall(r"(?:digs|reaches) (\S+) um", case.said)]
        if case.pair is None and not deep:
            counts["undercut"] += 1
            assert area < TINY, f"case {number}: {case.said}"
        elif TINY < area < GRAZE or (deep and max(deep) < 2e-3):
            counts["close"] += 1
        elif case.pair is None:
            counts["dig"] += 1
            assert area >= GRAZE, f"case {number}: refused ({case.said}), but nothing overlaps"
        else:
            counts["mesh"] += 1
            assert area <= TINY, f"case {number}: accepted, but the teeth overlap by {area:.2g} square modules"
            if case.pair.contact_ratio > 1.0:  # else helical teeth touch in other sections only for a while
                check_mesh(case)
            check_outlines(case)
    return counts


@pytest.mark.slow
def test_some_random_pairs_agree_with_shapely():
    counts = run(range(12, 30))
    assert counts["mesh"] >= 6, counts
    assert min(counts["dig"], counts["undercut"]) >= 2, counts
    assert counts["close"] <= 1, counts


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_a_thousand_random_pairs_agree_with_shapely():
    counts = dict.fromkeys(("mesh", "dig", "undercut", "close"), 0)
    number = 0
    while sum(counts.values()) - counts["close"] < 1000:
        for name, count in run(range(number, number + 50)).items():
            counts[name] += count
        number += 50
    assert min(counts["mesh"], counts["dig"], counts["undercut"]) > 100, counts
    assert counts["close"] < 20, counts


def test_rack_cut_gear_has_the_thickness_of_its_rack():
    """The second opinion itself: a rack's tooth is as wide as its space, so on the reference circle with x = 0."""
    shape = rackcut.Shape(24, radians(20), 0.0, 0.0, 1.0, 1.25, 0.25)
    cut = rackcut.section(shape)
    angles = np.linspace(-pi / 24, pi / 24, 20001)
    ring = shape.reference * np.c_[np.cos(angles), np.sin(angles)]
    import shapely

    inside = shapely.contains_xy(cut, ring[:, 0], ring[:, 1])
    assert inside.mean() == pytest.approx(0.5, abs=2e-4)
    assert shape.base == pytest.approx(12 * cos(radians(20)))
    assert rackcut.half_angle(shape) == pytest.approx(pi / 48 + tan(radians(20)) - radians(20))

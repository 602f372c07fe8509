"""STEP files, read back by Open CASCADE: a valid solid whose volume and flanks are those of the gear."""

import math
from io import BytesIO

import numpy as np
import pytest

from gears3d.gears import (
    ACTIVE,
    REVERSE,
    Gear,
    HelixSlope,
    Pair,
    ProfileWave,
    Relief,
    ToothDeviation,
    compile_surfaces,
    profile,
    solid,
    surface_point,
    write_meshes,
)
from gears3d.scenario import load

pytest.importorskip("OCP", reason='pip install "gears3d[cad]"')

from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepGProp import BRepGProp
from OCP.gp import gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.STEPControl import STEPControl_Reader
from OCP.TopAbs import TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

MM = 1e-3
SMALL = Gear(2e-3, 15, math.radians(20), face_width=8e-3, bore=6e-3)
WHEEL = Gear(2e-3, 30, math.radians(20), face_width=8e-3, bore=10e-3, rim=4e-3, web=3e-3, hub=20e-3)
MODIFIED = Gear(
    2e-3,
    21,
    math.radians(20),
    math.radians(20),
    face_width=12e-3,
    tip_relief=Relief(20e-6, length=1.5e-3),
    root_relief=Relief(10e-6, length=1e-3, shape="parabolic"),
    lead_crowning=8e-6,
    helix_slope=10e-6,
)


def pairs():
    yield "spur", lambda: load("base/rigaud-2020").pair()
    yield "helical", lambda: load("base/helical-17-43").pair()
    yield "undercut and web", lambda: Pair.from_backlash(SMALL, WHEEL, 2e-4)
    yield (
        "modified",
        lambda: Pair.from_backlash(MODIFIED, MODIFIED, 3e-4).with_deviations(
            ToothDeviation("drive", "active", 3, -15e-6),
            ProfileWave("drive", "reverse", 1.5e-6, 2.5, 0.3),
            HelixSlope("drive", "active", 12e-6, 5),
        ),
    )


@pytest.fixture(scope="module", params=[*pairs()], ids=lambda each: each[0].replace(" ", "-"))
def made(request, tmp_path_factory):
    """A pair, what its sidecars say, and its drive and loose gears as the kernel reads them."""
    pair = request.param[1]()
    folder = tmp_path_factory.mktemp("step")
    cards = write_meshes(pair, folder, ["step"], 20e-6)
    return pair, cards, {which: read((folder / f"{which}.step").read_bytes()) for which in cards}


def read(data):
    reader = STEPControl_Reader()
    reader.ReadStream("gear", BytesIO(data))
    reader.TransferRoots()
    return reader.OneShape()


def parts(shape, kind):
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def volume(shape):
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found, 1e-6)
    return found.Mass() * MM**3


def exact_volume(pair, which):
    """Of a fine polygon's section, bore and pockets taken off; of modified gears that of a fine solid."""
    gear = pair.gear(which)
    if gear.lead_crowning or pair.deviations:
        return solid(pair, which, 0.05e-6).volume
    tooth, pitch = profile(pair, which, 1e-9), 2.0 * math.pi / gear.teeth
    turn = np.array([[math.cos(pitch), math.sin(pitch)], [-math.sin(pitch), math.cos(pitch)]])
    x, y = np.vstack([tooth, tooth[:1] @ turn]).T
    area = gear.teeth * 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) - math.pi * (0.5 * (gear.bore or 0.0)) ** 2
    pocket = 0.0
    if gear.pocket:
        pocket = (gear.face_width - gear.web) * math.pi * (gear.pocket[1] ** 2 - gear.pocket[0] ** 2)
    return area * gear.face_width - pocket


def test_it_is_one_valid_solid_of_the_gears_volume(made):
    pair, cards, shapes = made
    for which, shape in shapes.items():
        assert shape.ShapeType() == TopAbs_SOLID
        assert BRepCheck_Analyzer(shape).IsValid()
        assert len([*parts(shape, TopAbs_FACE)]) == cards[which]["files"]["step"]["faces"]
        exact = exact_volume(pair, which)
        # chords of 50 nm take 1e-6 off the volume that modified gears are compared with
        assert volume(shape) == pytest.approx(exact, rel=2e-6 if pair.deviations else 2e-7)
        assert cards[which]["files"]["step"]["volume_m3"] == pytest.approx(exact, rel=1e-5)


def test_its_flanks_are_those_of_the_pair(made):
    """Points of the working flanks lie on faces of the solid, within what the sidecar says and the file's digits."""
    pair, cards, shapes = made
    surfaces = compile_surfaces(pair)
    rng = np.random.default_rng(5)
    for number, (which, shape) in enumerate(shapes.items()):
        (shell,) = parts(shape, TopAbs_SHELL)
        gear, said = pair.gear(which), cards[which]["files"]["step"]["flank_deviation_m"]
        assert said < 1.1e-9
        low = max(pair.start_roll(which), 0.05)
        for side in (ACTIVE, REVERSE):
            for tooth in (1, 3, 5, gear.teeth):
                roll = low + 0.97 * rng.random() * (gear.tip_roll - low)
                height = gear.face_width * (rng.random() - 0.5)
                point = surface_point(surfaces, number, side, tooth, roll, height)[0] / MM
                vertex = BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()
                assert BRepExtrema_DistShapeShape(vertex, shell).Value() * MM < said + 1e-10


def test_teeth_are_b_splines_and_the_bore_is_a_cylinder(made):
    pair, _, shapes = made
    for which, shape in shapes.items():
        names = [type(BRep_Tool.Surface_s(TopoDS.Face(face))).__name__ for face in parts(shape, TopAbs_FACE)]
        assert names.count("Geom_BSplineSurface") >= 5 * pair.gear(which).teeth
        assert ("Geom_CylindricalSurface" in names) == (pair.gear(which).bore is not None)


def test_the_same_file_twice(tmp_path):
    pair = Pair.from_backlash(SMALL, SMALL, 1e-4)
    first, second = (
        write_meshes(pair, tmp_path / name, ["step"], 20e-6, which=["drive"])["drive"]["files"] for name in "ab"
    )
    assert first == second

"""``gears3d export``: files that other programs read back as the same solid, and the card beside them."""

import io
import json

import numpy as np
import pytest
import trimesh
from shapely.geometry import Point, Polygon

from gears3d import cli, errors
from gears3d.gears import content_hash, solid, step, write_meshes
from gears3d.scenario import load

RIG, HELICAL = "scenarios/base/rigaud-2020.toml", "scenarios/base/helical-17-43.toml"
SCALE = {"stl": 1e-3, "obj": 1e-3, "glb": 1.0}
RESOLUTION = {"stl": 1e-8, "obj": 1e-12, "glb": 1e-8}
"""What the format keeps of a coordinate, m: float32 or nine decimals of a millimetre."""


@pytest.fixture
def mesh(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(["export", *arguments])
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


def read(path):
    body = trimesh.load(path, force="mesh", process=False)
    body.merge_vertices(merge_norm=True, merge_tex=True)
    body.apply_scale(SCALE[path.suffix[1:]])
    return body


@pytest.mark.parametrize("scenario", [RIG, HELICAL], ids=["spur", "helical"])
def test_round_trip(mesh, tmp_path, scenario):
    code, out, err = mesh(scenario, "--out", str(tmp_path), "--format", "stl,obj,glb", "--chord", "5 um")
    assert (code, err) == (0, "")
    names = {f"{gear}.{kind}" for gear in ("drive", "loose") for kind in ("stl", "obj", "glb", "json")}
    assert {path.name for path in tmp_path.iterdir()} == names
    pair = load(scenario).pair()
    for gear in ("drive", "loose"):
        exact = solid(pair, gear, 5e-6)
        card = json.loads((tmp_path / f"{gear}.json").read_text())
        assert card["hash"] == content_hash(exact)
        assert card["hash"][:23] in out
        for kind in ("stl", "obj", "glb"):
            body = read(tmp_path / f"{gear}.{kind}")
            assert body.is_watertight
            assert body.is_winding_consistent
            assert body.body_count == 1
            assert body.volume == pytest.approx(exact.volume, rel=1e-6 if kind != "obj" else 1e-9)
            assert body.bounds == pytest.approx(exact.bounds, abs=RESOLUTION[kind] + 1e-15)
            assert len(body.faces) == len(exact.faces)
            assert card["files"][kind]["bytes"] == (tmp_path / f"{gear}.{kind}").stat().st_size
        properties = card["mass_properties"]
        assert properties["volume_m3"] == pytest.approx(exact.volume, rel=1e-12)
        assert properties["mass_kg"] == pytest.approx(7850 * exact.volume, rel=1e-12)
        assert card["pair"]["backlash_m"] == pytest.approx(pair.backlash, abs=1e-18)
        assert card["data"]["helix_angle"] == pair.drive.helix_angle
        assert card["command"].startswith(f"gears3d export {scenario} --out {tmp_path} --format stl,obj,glb")


def test_poses_of_the_cards_put_the_gears_in_mesh(mesh, tmp_path):
    """Read back, turned and moved as the cards say, active flanks touch in the pitch point and nothing overlaps."""
    mesh(RIG, "--out", str(tmp_path), "--format", "obj", "--chord", "1 um")
    sections = []
    for gear in ("drive", "loose"):
        card = json.loads((tmp_path / f"{gear}.json").read_text())
        points = trimesh.load(tmp_path / f"{gear}.obj", process=False, maintain_order=True).vertices * 1e-3
        ring = points[(points[:, 2] < 0) & (np.hypot(*points[:, :2].T) > 0.1)][:, :2]
        angle = card["pose"]["rotation_about_z_rad"]
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        sections.append(Polygon(ring @ turn + card["pose"]["axis_m"]))
    drive, loose = sections
    assert drive.is_valid
    assert loose.is_valid
    pitch_point = Point(0.5 * json.loads((tmp_path / "drive.json").read_text())["pair"]["centre_distance_m"], 0.0)
    assert drive.distance(pitch_point) < 1e-6
    assert loose.distance(pitch_point) < 1e-6
    assert drive.intersection(loose).area < 1e-15


def test_effects_on_the_flanks_are_in_the_solid_and_on_the_card(mesh, tmp_path):
    effect = 'effect=[{kind="transmission_error", amplitude="20 um", order=1}]'
    code, _, _ = mesh(RIG, "--out", str(tmp_path), "--chord", "10 um", "--gear", "drive", "--set", effect)
    assert code == 0
    card = json.loads((tmp_path / "drive.json").read_text())
    assert [d["flank"] for d in card["pair"]["deviations"]] == ["active", "reverse"]
    assert card["pair"]["deviations"][0]["amplitude"] == 20e-6
    assert card["hash"] != content_hash(solid(load(RIG).pair(), "drive", 10e-6))
    assert not (tmp_path / "loose.stl").exists()


def test_same_twice_and_replaced_whole(mesh, tmp_path):
    arguments = (RIG, "--out", str(tmp_path), "--chord", "20 um", "--gear", "loose", "--format", "stl,glb")
    mesh(*arguments)
    first = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    (tmp_path / "loose.stl").write_bytes(b"half")
    mesh(*arguments)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == first


def test_normals_of_the_glb_are_those_of_the_flanks(tmp_path):
    pair = load(HELICAL).pair()
    write_meshes(pair, tmp_path, ["glb"], 2e-6, which=["drive"])
    scene = trimesh.load(io.BytesIO((tmp_path / "drive.glb").read_bytes()), file_type="glb", process=False)
    (body,) = scene.geometry.values()
    assert "vertex_normals" in body._cache.cache
    normals = np.asarray(body.vertex_normals)
    facing = np.einsum("ij,ij->i", body.face_normals, normals[body.faces].mean(axis=1))
    assert np.quantile(facing, 0.01) > 0.95


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--format", "stp"], 2, "there is no format 'stp'"),
        (["--format", ","], 2, "--format is empty"),
        (["--gear", "driv"], 2, "--gear is 'driv'; did you mean 'drive'?"),
        (["--chord", "0 um"], 3, "--chord: is 0 um"),
        (["--chord", "1 s"], 3, "--chord: '1 s' is a time, not a length"),
    ],
)
def test_bad_options(mesh, tmp_path, arguments, code, said):
    got, out, err = mesh(RIG, "--out", str(tmp_path / "new"), *arguments)
    assert (got, out) == (code, "")
    assert said in err
    assert not (tmp_path / "new").exists()


def test_folder_that_cannot_be_written(mesh, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, err = mesh(RIG, "--out", str(tmp_path / "file"), "--chord", "20 um")
    assert code == 3
    assert "is a file" in err


def test_formats_that_need_no_extra_are_written_where_step_has_to_be_refused(mesh, tmp_path, monkeypatch):
    fault = errors.Fault("", "STEP needs cadquery-ocp-novtk, which is not installed", 'pip install "gears3d[cad]"')

    def lacks():
        raise errors.MissingExtraError(fault, "cad")

    monkeypatch.setattr(step, "require_kernel", lacks)
    words = [RIG, "--chord", "20 um", "--gear", "loose"]
    code, out, err = mesh(*words, "--out", str(tmp_path / "both"), "--format", "stl,step")
    assert code == errors.MissingExtraError.exit_code
    assert 'pip install "gears3d[cad]"' in " ".join(err.split())
    assert "loose.stl" in out
    assert sorted(path.name for path in (tmp_path / "both").iterdir()) == ["loose.json", "loose.stl"]
    code, out, err = mesh(*words, "--out", str(tmp_path / "alone"), "--format", "step")
    assert code == errors.MissingExtraError.exit_code
    assert not (tmp_path / "alone").exists()

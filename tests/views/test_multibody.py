"""``gears3d export --format urdf,mjcf``: stock PyBullet and stock MuJoCo load the files, and the gears rattle there."""

import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from gears3d import cli
from gears3d.gears import pieces
from gears3d.lumped import rigid
from gears3d.scenario import load
from gears3d.views.multibody import write_multibody
from tools.exported_rattle import drive_angle, impacts, in_mujoco, in_pybullet, listed

RATTLE, HELICAL = "rigaud-2020/fig5-20rpm", "kadmiri-2012/fig12-1000rpm"


@pytest.fixture
def mesh(capsys):
    def run(*arguments):
        with pytest.raises(SystemExit) as stop:
            cli.main(["export", *map(str, arguments)])
        captured = capsys.readouterr()
        return stop.value.code or 0, captured.out, captured.err

    return run


@pytest.fixture(scope="module")
def rattling(tmp_path_factory):
    """Two settled periods of fig. 5, its files, and the impacts of the rigid model."""
    scenario = load(RATTLE, ["run.duration=1.34 s", "run.output_rate=200 kHz"])
    folder = tmp_path_factory.mktemp("rattling")
    write_multibody(scenario, folder, ["urdf", "mjcf"])
    return scenario, folder, rigid.simulate(scenario)


def numbers(element, name):
    return np.array([float(word) for word in element.get(name).split()])


def test_the_urdf_has_the_bodies_of_the_scenario(rattling):
    scenario, folder, _ = rattling
    robot = ElementTree.parse(folder / "pair.urdf").getroot()
    pair, rig = scenario.pair(), scenario.rig()
    for name, sense in (("drive", 1), ("loose", -1)):
        joint = robot.find(f"joint[@name='{name}_axis']")
        assert (joint.get("type"), joint.find("parent").get("link")) == ("continuous", "world")
        assert numbers(joint.find("origin"), "xyz") == pytest.approx(pair.centre(name), abs=1e-9)
        assert numbers(joint.find("axis"), "xyz").tolist() == [0, 0, sense]
        assert robot.find(f"link[@name='{name}']/collision/geometry/mesh").get("filename") == f"{name}-teeth.obj"
    assert float(robot.find("link[@name='loose']/inertial/inertia").get("izz")) == pytest.approx(rig.inertia, rel=1e-8)
    assert float(robot.find("joint[@name='loose_axis']/dynamics").get("friction")) == rig.drag_torque
    restitution = [float(each.get("value")) for each in robot.iter("restitution")]
    assert math.prod(restitution) == pytest.approx(rig.restitution)


def test_the_hulls_are_those_of_the_engine_with_their_facets_outwards(rattling):
    scenario, folder, _ = rattling
    for name in ("drive", "loose"):
        turn = [1.0, 1.0, 1.0] if name == "drive" else [-1.0, -1.0, 1.0]  # into the world, as it stands at angle 0
        wanted = [piece * turn * 1e3 for piece in pieces(scenario.pair(), name)]
        lines = (folder / f"{name}-teeth.obj").read_text().splitlines()
        vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
        assert vertices == pytest.approx(np.vstack(wanted), abs=1e-9)
        assert sum(line.startswith("o ") for line in lines) == len(wanted)
        faces = np.array([line.split()[1:] for line in lines if line.startswith("f ")], int) - 1
        body = trimesh.Trimesh(vertices, faces, process=False)
        assert body.is_watertight
        volume = sum(trimesh.convex.convex_hull(piece).volume for piece in wanted)
        assert body.volume == pytest.approx(volume, rel=1e-9)


@pytest.mark.slow
def test_stock_pybullet_rattles(rattling):
    scenario, folder, reference = rattling
    found, expected = impacts(scenario, in_pybullet(folder, scenario, 1.34)), listed(scenario, reference)
    assert len(found) == len(expected) == 8
    # a chord of the hulls tilts the normal, so that an impact's speed scatters; Bullet multiplies by the restitution
    assert np.median(found[:, 1] / found[:, 0]) == pytest.approx(scenario.impact.restitution, abs=0.05)
    assert found[:, 0].mean() == pytest.approx(expected[:, 0].mean(), rel=0.1)


def test_stock_mujoco_rattles_from_the_keyframe(rattling):
    pytest.importorskip("mujoco", reason='pip install "gears3d[bench]"')
    scenario, folder, reference = rattling
    motion, expected = in_mujoco(folder, scenario, 1.34), listed(scenario, reference)
    found = impacts(scenario, motion)
    assert len(found) == len(expected) == 8
    assert np.median(found[:, 1] / found[:, 0]) == pytest.approx(scenario.impact.restitution, abs=0.05)
    assert found[:, 0].mean() == pytest.approx(expected[:, 0].mean(), rel=0.1)
    # a soft contact lets the teeth in by the speed of impact × its duration / π, 10 µm here
    place = np.interp(motion.time, reference.time, reference.signals["displacement_m"])
    assert np.sqrt(np.mean((motion.place - place) ** 2)) < 10e-6


def test_the_mjcf_imposes_the_motion_of_the_drive(tmp_path):
    mujoco = pytest.importorskip("mujoco", reason='pip install "gears3d[bench]"')
    waves = '[{amplitude="20 rpm", frequency="3 Hz", phase="40 deg"}, {amplitude="5 rpm", frequency="11 Hz"}]'
    scenario = load(RATTLE, [f"motion.harmonics={waves}", "start.state=reverse"])
    write_multibody(scenario, tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "pair.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    rig = scenario.rig()
    assert rig.base_radius_loose * data.qpos[-1] == pytest.approx(rig.backlash, rel=1e-8)
    for _ in range(4000):
        mujoco.mj_step(model, data)
    # impacts against a rotor 1e6 times as heavy
    assert data.qpos[:-1].sum() == pytest.approx(drive_angle(scenario, data.time), abs=1e-5)


def test_helical_teeth_keep_to_the_rigid_model_in_mujoco(tmp_path):
    """Their slices meet in the same heights only: contacts of end faces would spoil the solver."""
    pytest.importorskip("mujoco", reason='pip install "gears3d[bench]"')
    scenario = load(HELICAL, ["run.output_rate=200 kHz"])
    write_multibody(scenario, tmp_path, ["mjcf"])
    motion = in_mujoco(tmp_path, scenario, 0.02)
    reference = rigid.simulate(scenario)
    place = np.interp(motion.time, reference.time, reference.signals["displacement_m"])
    assert np.ptp(place) > 50e-6
    assert np.sqrt(np.mean((motion.place - place) ** 2)) < 5e-6


def test_the_sidecar_says_what_the_files_hold(mesh, tmp_path):
    effects = 'effect=[{kind="drag_viscous", coefficient="0.01 N m s/rad"}, '
    effects += '{kind="restitution_scatter", standard_deviation=0.1}]'
    code, out, err = mesh(RATTLE, "--out", tmp_path, "--format", "urdf,mjcf", "--set", effects)
    assert code == 0
    assert "restitution_scatter" in err
    assert "drag_viscous" not in err
    card = json.loads((tmp_path / "pair.json").read_text())
    assert card["effects_left_out"] == ["restitution_scatter"]
    assert card["drag"] == {"coulomb_N_m": 0.22, "viscous_N_m_s": 0.01}
    assert card["hulls"]["drive"] == card["hulls"]["loose"] == 90
    assert set(card["files"]) == {"drive-teeth.obj", "loose-teeth.obj", "pair.urdf", "pair.xml"}
    assert all(str(tmp_path / name) in out for name in card["files"])
    assert {path.name for path in tmp_path.iterdir()} == {*card["files"], "pair.json"}
    damping = ElementTree.parse(tmp_path / "pair.xml").getroot().find(".//joint[@name='loose']").get("damping")
    assert float(damping) == 0.01


def test_the_same_files_twice(tmp_path):
    first, second = (write_multibody(load(RATTLE), tmp_path / name, ["urdf", "mjcf"])["files"] for name in "ab")
    assert first == second


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--format", "mjfc"], 2, "there is no format 'mjfc'; did you mean 'mjcf'?"),
        (["--format", "urdf", "--gear", "drive"], 2, "--format urdf holds both gears"),
        (["--format", "mjcf", "--set", 'motion={record="MOTION", mean="30 rpm"}'], 3, "motion.record"),
    ],
)
def test_bad_options(mesh, tmp_path, arguments, code, said):
    record = tmp_path / "motion.csv"
    time = np.linspace(0.0, 6.0, 600)
    np.savetxt(record, np.c_[time, math.pi * time], delimiter=",", header="time_s,theta_drive_rad", comments="")
    words = [word.replace("MOTION", str(record)) for word in arguments]
    got, _, err = mesh(RATTLE, "--out", tmp_path / "new", *words)
    assert (got, said in err) == (code, True), err
    assert not (tmp_path / "new").exists()

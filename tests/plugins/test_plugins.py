"""Packages that bring effects and readers: installed by pip, used on the command line; a broken one costs a warning."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from gears3d.effects import Param, base, catalogue, register, torque_constant
from gears3d.errors import Fault, InputError
from gears3d.extras import missing, pip_line
from gears3d.measured.readers import formats
from gears3d.plugins import PluginWarning
from gears3d.recording import read
from gears3d.scenario import load
from gears3d.simulation import record
from gears3d.simulation.excitation import assess

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
RIG = ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"
SEAL = '{kind="stribeck_seal", static="0.15 N m", falls_at="6 rad/s", viscous="0.01 N m s/rad"}'


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Both example packages as pip installs them, from their sources and without a network."""
    pytest.importorskip("hatchling")
    place = tmp_path_factory.mktemp("site")
    for name in ("example_effect", "example_reader"):
        source = shutil.copytree(HERE / name, place.parent / f"{place.name}-{name}")
        options = ["--no-deps", "--no-index", "--no-build-isolation", "--quiet", "--target", str(place)]
        done = subprocess.run(
            [sys.executable, "-m", "pip", "install", *options, str(source)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
    return place


def gears3d(site, *arguments, cwd=ROOT):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(site), str(ROOT)))}
    words = [sys.executable, "-m", "gears3d", *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, cwd=cwd, env=environment, check=False)


def written(site, source, target):
    """The record of a file in the format of the example package."""
    code = (
        "import sys, gears3d_riglog\nfrom pathlib import Path\nfrom gears3d.recording import read\n"
        "gears3d_riglog.write(sys.argv[2], dict(read(Path(sys.argv[1])).signals))\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(site), str(ROOT)))}
    subprocess.run([sys.executable, "-c", code, source, target], env=environment, check=True)


def fake(site, name, group, value, code):
    """An installed package with one module and one entry point."""
    site.mkdir(exist_ok=True)
    about = site / f"{name.replace('-', '_')}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(f"[{group}]\nmine = {value}\n", encoding="utf-8")
    (site / f"{value.partition(':')[0]}.py").write_text(code, encoding="utf-8")


@pytest.mark.slow
def test_a_record_of_a_format_of_another_package_is_measured_and_identified(installed, tmp_path):
    rig = load(RIG, {"run.duration": "3 s"})
    record(rig).write(tmp_path / "rattle.parquet")
    record(rig, "coastdown").write(tmp_path / "rundown.parquet")
    told = {}
    for name, verb in (
        ("rattle", ("segment", "--rig", RIG)),
        ("rundown", ("identify", "coastdown", "--inertia", "0.0695 kg m^2")),
    ):
        written(installed, tmp_path / f"{name}.parquet", tmp_path / f"{name}.riglog")
        for ending in ("parquet", "riglog"):
            done = gears3d(installed, *verb, f"{name}.{ending}", "--json", cwd=tmp_path)
            assert done.returncode == 0, done.stderr
            json.loads(done.stdout)
            told[ending] = re.sub("[0-9a-f]{64}", "HASH", done.stdout).replace(f".{ending}", ".ENDING")
        assert told["parquet"] == told["riglog"]


def test_what_its_reader_refuses_is_told_like_any_fault(installed, tmp_path):
    (tmp_path / "cut.riglog").write_bytes(b'RIGLOG 1\n["time_s", "theta_drive_rad", "theta_loose_rad"]\n12345')
    done = gears3d(installed, "measure", "cut.riglog", "--rig", RIG, cwd=tmp_path)
    assert done.returncode == 3
    assert "cut.riglog: ends amid a row" in done.stderr
    (tmp_path / "bad.riglog").write_bytes(b"RIGLOG 1\nno json\n")
    done = gears3d(installed, "measure", "bad.riglog", "--rig", RIG, cwd=tmp_path)
    assert done.returncode == 3
    assert "cannot be read as RIGLOG by the package gears3d-example-reader: JSONDecodeError" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_effect_of_another_package_acts_alike_in_rigid_model_and_engine(installed, tmp_path):
    """Its law is a function of its own, compiled by numba; the impacts agree as for the drags of gears3d."""
    if missing("engine"):
        pytest.skip(pip_line("engine"))
    done = gears3d(installed, "run", RIG, "--set", f"effect=[{SEAL}]", "--set", "run.duration=2 s", "--no-views",
                   "--out", "with", "--json", cwd=tmp_path)  # fmt: skip
    assert done.returncode == 0, done.stderr
    compared = json.loads(done.stdout)["comparison"]
    assert compared["impacts_matched"] > 30
    assert (compared["impacts_missed"], compared["impacts_invented"]) == (0, 0)
    assert compared["velocity_error_p95"] < 1e-8
    again = gears3d(installed, "run", RIG, "--set", "run.duration=2 s", "--model", "rigid", "--no-views",
                    "--out", "without", cwd=tmp_path)  # fmt: skip
    assert again.returncode == 0, again.stderr
    with_seal, without = (read(tmp_path / name).impacts["velocity_m_s"] for name in ("with/twin", "without"))
    count = min(len(with_seal), len(without))
    changed = np.abs(with_seal[:count] / without[:count] - 1.0).max()
    assert changed > 5e-3  # of the seal, five orders above what the models differ by


def test_it_is_listed_checked_and_in_the_schema(installed, tmp_path):
    listed = json.loads(gears3d(installed, "list", "effects", "--json").stdout)
    (found,) = [one for one in listed if one["name"] == "stribeck_seal"]
    assert set(found["parameters"]) == {"static", "falls_at", "viscous"}
    assert "stribeck_seal" in gears3d(installed, "schema").stdout
    wrong = SEAL.replace("6 rad/s", "6 m/s")
    done = gears3d(installed, "check", RIG, "--set", f"effect=[{wrong}]")
    assert done.returncode == 3
    assert "falls_at" in done.stderr


BROKEN = {
    "raises": ("raising:X", "raise RuntimeError('no licence')", "RuntimeError: no licence"),
    "ends the process": ("ending:X", "import sys\nsys.exit('sorry')", "SystemExit: sorry"),
    "has no such name": ("nameless:X", "", "AttributeError"),
    "is a number": ("number:X", "X = 7", "TypeError: 7 is not a"),
    "lacks a package": ("lacking:X", "import no_such_package", "ModuleNotFoundError"),
}
CLASH = """
from dataclasses import dataclass
from gears3d.effects import register

@register
@dataclass(frozen=True)
class X:
    kind = "brand_new"
    place = "torque"
    params = {}
    def rows(self, rig): return []
    def unit_size(self, rig): return 1.0

@register
@dataclass(frozen=True)
class Y(X):
    kind = "drag_viscous"
"""


@pytest.mark.parametrize("group", ["gears3d.effects", "gears3d.readers"])
def test_a_broken_package_costs_one_warning_that_names_it(group, tmp_path):
    for case, (value, code, _) in BROKEN.items():
        fake(tmp_path / "site", case.replace(" ", "-"), group, value, code)
    (tmp_path / "a.csv").write_text("nothing\n", encoding="utf-8")
    verb = ("list", "effects") if group.endswith("effects") else ("segment", tmp_path / "a.csv", "--rig", RIG)
    done = gears3d(tmp_path / "site", *verb)
    assert done.returncode == (0 if group.endswith("effects") else 3)
    lines = [line for line in done.stderr.splitlines() if line.startswith("warning:")]
    assert len(lines) == len(BROKEN)
    for line, (case, (_, _, why)) in zip(lines, sorted(BROKEN.items()), strict=True):
        package = case.replace(" ", "-")
        assert line.startswith(f"warning: plug-in 'mine' ({group}) of the package {package} is excluded: {why}")
        assert line.endswith(f"(update or uninstall {package})")
    assert "Traceback" not in done.stderr
    assert "drag_viscous" in done.stdout or group.endswith("readers")


def test_a_kind_that_is_taken_stays_that_of_gears3d(tmp_path):
    """Nothing of the package is kept, not even what it registered before the clash."""
    fake(tmp_path / "site", "clashing", "gears3d.effects", "clash:Y", CLASH)
    done = gears3d(tmp_path / "site", "list", "effects", "--json")
    assert "clashing is excluded: ValueError: effect kind 'drag_viscous' is taken by gears3d.effects" in done.stderr
    assert done.stderr.count("warning:") == 1
    names = {one["name"] for one in json.loads(done.stdout)}
    assert "brand_new" not in names
    assert names == set(catalogue())


def test_an_import_of_a_clashing_package_cannot_take_a_kind_either(tmp_path):
    fake(tmp_path / "site", "clashing", "gears3d.unused", "clash:Y", CLASH)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(tmp_path / "site"), str(ROOT)))}
    done = subprocess.run([sys.executable, "-c", "import clash"], capture_output=True, text=True, env=environment)
    assert "effect kind 'drag_viscous' is taken by gears3d.effects.drag_viscous" in done.stderr


def test_two_readers_of_one_format_are_a_clash(tmp_path):
    code = (
        "from gears3d.measured.readers import Reader\nX = Reader('{}', lambda p, h: h[:2] == b'!!', lambda p: 1 / 0)\n"
    )
    for name, form in (("a-reader", "ABC"), ("b-reader", "abc"), ("c-reader", "Parquet")):
        fake(tmp_path / "site", name, "gears3d.readers", f"{name[0]}_module:X", code.format(form))
    (tmp_path / "x.dat").write_bytes(b"!!")
    done = gears3d(tmp_path / "site", "measure", tmp_path / "x.dat", "--rig", RIG)
    assert done.returncode == 3
    text = " ".join(done.stderr.split())
    assert "b-reader is excluded: ValueError: the format 'abc' is read by a-reader already" in text
    assert "c-reader is excluded: ValueError: the format 'Parquet' is read by gears3d already" in text
    assert "cannot be read as ABC by the package a-reader: ZeroDivisionError" in text


def test_a_reader_that_fails_to_recognise_is_warned_of_and_passed_over(tmp_path, monkeypatch):
    bad = formats.Reader("BAD", lambda path, head: head.no_such_name, lambda path: None)
    monkeypatch.setattr(formats, "readers", lambda held={"BAD": (bad, "bad-reader")}: held)
    (tmp_path / "a.csv").write_text("time_s,theta_drive_rad,theta_loose_rad\n0,0,0\n1,1,1\n2,2,2\n", encoding="utf-8")
    from gears3d.measured.readers import open_source

    with pytest.warns(PluginWarning, match="of the package bad-reader is excluded: AttributeError"):
        assert open_source(tmp_path / "a.csv").form == "CSV"
    assert open_source(tmp_path / "a.csv").form == "CSV"  # without a second warning


def test_what_is_no_effect_is_named_with_what_it_lacks():
    class Half:
        kind, place = "half", "torque"

    with pytest.raises(TypeError, match="it has no params, rows, unit_size"):
        base._load_plug_in(lambda: Half, "half-done")
    assert "half" not in catalogue()


def made(monkeypatch, **changed):
    """An effect of the package ``seal_lab``, registered for one test; ``changed`` are attributes of its class."""
    monkeypatch.setattr(base, "_REGISTRY", dict(catalogue()))
    body = {
        "__annotations__": {"falls_at": float},
        "__module__": "seal_lab.seal",
        "kind": "seal",
        "place": "torque",
        "params": {"falls_at": Param("speed", 0.0, 1e4)},
        "rows": lambda self, rig: [],
        "unit_size": lambda self, rig: 1.0,
    }
    return register(dataclass(frozen=True)(type("Seal", (), body | changed)))


MISTAKES = {
    "typing error": (lambda self, rig: [torque_constant(self.fals_at)], "'fals_at'; did you mean 'falls_at'?"),
    "any exception": (lambda self, rig: [torque_constant(1 / 0)], "ZeroDivisionError: division by zero"),
    "no list": (lambda self, rig: torque_constant(0.1), "not a list of rows"),
    "no rows": (lambda self, rig: [0.1], "not a list of rows"),
    "no number": (lambda self, rig: [torque_constant(float("nan"))], "not finite"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_rows_is_a_fault_that_names_package_class_and_effect(mistake, monkeypatch):
    rows, why = MISTAKES[mistake]
    made(monkeypatch, rows=rows)
    with pytest.raises(InputError) as caught:
        load(RIG, {"effect": [{"kind": "seal", "falls_at": "30 rpm"}]})
    (fault,) = caught.value.faults
    assert fault.key == "effect[0]"
    assert "effect 'seal' of the package seal_lab: rows() of Seal fails: " in fault.message
    assert why in fault.message
    assert fault.remedy == "correct seal_lab.seal, or remove the effect"


def test_a_mistake_where_an_effect_is_made_is_a_fault_and_its_own_message_stays(monkeypatch):
    made(monkeypatch, __post_init__=lambda self: [][0])
    with pytest.raises(InputError, match="the class of Seal fails: IndexError"):
        load(RIG, {"effect": [{"kind": "seal", "falls_at": "30 rpm"}]})

    def refuse(self, rig):
        raise InputError(Fault("falls_at", "is too low", "give more"))

    made(monkeypatch, rows=refuse)
    with pytest.raises(InputError) as caught:
        load(RIG, {"effect": [{"kind": "seal", "falls_at": "30 rpm"}]})
    assert [str(fault) for fault in caught.value.faults] == ["--set: effect[0].falls_at: is too low (give more)"]


@pytest.mark.parametrize(
    ("changed", "why"),
    [
        ({"params": {"falls_at": Param("rotational_speed")}}, "parameter 'falls_at' has the unknown unit family"),
        ({"params": {"fals_at": Param("speed")}}, "parameter 'fals_at' of params is not a field of the class; did you"),
        ({"params": {}}, "field 'falls_at' has no default and is not in params"),
        ({"params": {"falls_at": Param("choice")}}, "is a choice without choices"),
        ({"place": "sensor"}, "it has no observe"),
    ],
)
def test_a_class_that_contradicts_itself_is_not_registered(changed, why, monkeypatch):
    with pytest.raises(TypeError, match=r"seal_lab\.seal\.Seal") as caught:
        made(monkeypatch, **changed)
    assert why in str(caught.value)
    assert "seal" not in catalogue()


def test_a_scenario_with_an_effect_of_an_excluded_package_says_so(tmp_path):
    one = CLASH[: CLASH.rindex("@register")].replace("import register", "import Param, register")
    code = one.replace("params = {}", 'params = {"a": Param("rotational_speed")}').replace("brand_new", "mine")
    fake(tmp_path / "site", "seal-lab", "gears3d.effects", "sealing:X", code)
    done = gears3d(tmp_path / "site", "check", RIG, "--set", 'effect=[{kind="mine"}]')
    assert done.returncode == 3
    assert "Traceback" not in done.stderr
    text = " ".join(done.stderr.split())
    assert "'mine' is not available: the package seal-lab is excluded: TypeError: sealing.X: parameter 'a' has" in text
    assert "the unknown unit family 'rotational_speed': did you mean 'rotational_" in text
    assert "known families: gears3d list units" in text


@pytest.mark.slow
def test_a_challenge_refuses_effects_of_other_packages_and_says_why(installed, tmp_path):
    done = gears3d(installed, "challenge", "--effect", "stribeck_seal", "--out", "blind", cwd=tmp_path)
    assert done.returncode == 2
    assert "'stribeck_seal' is an effect of another package: the generator of a challenge has no" in done.stderr
    rig = f'format = 1\nextends = "{RIG}"\n[[effect]]\n' + SEAL.strip("{}").replace(", ", "\n") + "\n"
    (tmp_path / "rig.toml").write_text(rig, encoding="utf-8")
    options = ("--rig", "rig.toml", "--none", "--records", "1", "--duration", "1 s", "--out", "blind")
    done = gears3d(installed, "challenge", *options, cwd=tmp_path)
    assert done.returncode == 3
    assert "'stribeck_seal' is an effect of another package: the generator of a challenge has no" in done.stderr
    assert "remove it from the rig" in done.stderr


def test_the_torques_of_one_effect_are_one_line_of_the_excitation(monkeypatch):
    made(monkeypatch, rows=lambda self, rig: [torque_constant(0.3), torque_constant(-0.1)])
    scenario = load(RIG, {"effect": [{"kind": "seal", "falls_at": "30 rpm"}]})
    drag = assess(scenario).drag
    assert [part["source"] for part in drag] == ["drag.torque", "effect[0] seal"]
    assert drag[1]["torque_N_m"] == pytest.approx(0.2)
    assert assess(scenario).drag_torque_N_m == pytest.approx(scenario.drag.torque + 0.2)

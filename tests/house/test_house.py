"""What keeps the house in order: light import, small files and functions, every public name explained."""

import ast
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FILES = sorted((ROOT / "gears3d").rglob("*.py"))
LAZY = ["pybullet", "rerun", "pint", "numba", "scipy", "trimesh", "matplotlib", "pandas", "pyarrow"]
HEAVY = [*LAZY, "pydantic", "typer", "rich", "jinja2"]


def definitions(tree):
    return [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef)]


def lines(node):
    return node.end_lineno - node.lineno


def test_import_loads_numpy_and_nothing_heavier():
    code = f"import sys, gears3d; print(*(m for m in {HEAVY} if m in sys.modules), 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True"]


def test_help_loads_no_simulator():
    code = (
        "import sys\nfrom gears3d.cli import main\nsys.argv = ['gears3d', '--help']\n"
        "try:\n    main()\nexcept SystemExit as stop:\n    assert not stop.code\n"
        f"print('loaded:', *(m for m in {LAZY} if m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().splitlines()[-1] == "loaded:"


def test_public_names_resolve():
    import gears3d

    for name in gears3d.__all__:
        assert getattr(gears3d, name) is not None
    with pytest.raises(AttributeError, match="simulate"):
        _ = gears3d.simulat


def test_records_are_taken_from_their_files(tmp_path):
    import gears3d
    from gears3d.errors import InputError
    from gears3d.simulation import record

    rig = ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"
    made = record(gears3d.load(rig, {"run.duration": "1 s"}))
    made.write(tmp_path / "a.parquet")
    found = gears3d.measure(tmp_path / "a.parquet", str(rig))
    again = gears3d.measure(made, gears3d.load(rig))
    assert len(found.recording.impacts["time_s"]) == len(again.recording.impacts["time_s"]) > 10
    for verb in (gears3d.measure, gears3d.diagnose):
        with pytest.raises(InputError, match=r"gone\.parquet"):
            verb(tmp_path / "gone.parquet", rig)
    with pytest.raises(InputError, match="no record is given"):
        gears3d.diagnose([], rig)


def test_objects_show_themselves_in_notebooks():
    import gears3d

    scenario = gears3d.load(
        ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s", "run.settle": "0 s"}
    )
    run = gears3d.simulate(scenario.with_({"title": "<b>bold</b>"}), "rigid")
    shown = [one._repr_html_() for one in (scenario, run, gears3d.compare(run, run))]
    for html in shown:
        assert html.startswith("<table><caption>")
        assert html.count("<td>") == html.count("</td>") > 4
    assert "250 um" in shown[0]
    assert "&lt;b&gt;bold" in shown[1]
    assert "<b>bold" not in shown[1]
    assert "double sided" in shown[1]


def test_public_names_survive_the_import_of_their_rooms():
    import gears3d
    import gears3d.comparison
    import gears3d.simulation
    import gears3d.views.camera
    import gears3d.views.replay

    assert callable(gears3d.simulate)
    assert callable(gears3d.compare)
    assert callable(gears3d.replay)
    assert callable(gears3d.camera)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_files_and_functions_are_small(path):
    text = path.read_text()
    assert text.count("\n") <= 400
    for node in definitions(ast.parse(text)):
        if not isinstance(node, ast.ClassDef):
            assert node.end_lineno - node.lineno <= 80, f"{node.name} has {node.end_lineno - node.lineno} lines"


def test_median_file_and_function_are_small():
    functions = [d for f in FILES for d in definitions(ast.parse(f.read_text())) if hasattr(d, "args")]
    assert statistics.median(f.read_text().count("\n") for f in FILES) <= 170
    assert statistics.median(map(lines, functions)) <= 16


def test_what_is_caught_is_named_and_what_is_caught_broadly_goes_on():
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ExceptHandler):
                assert node.type is not None, f"{path}:{node.lineno} bare except"
                broad = ast.unparse(node.type) in ("BaseException", "Exception")
                assert not broad or isinstance(node.body[-1], ast.Raise), f"{path}:{node.lineno} swallows"


def test_nothing_tracked_is_large():
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, names.split("\0")):
        path = ROOT / name
        assert not path.exists() or path.stat().st_size <= 2_000_000, name

"""What runs the tests elsewhere is well formed and names what is there."""

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def jobs(path):
    yaml = pytest.importorskip("yaml")
    return yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_every_step_runs_something_that_is_there(path):
    for name, job in jobs(path).items():
        assert job["timeout-minutes"] <= 360, name
        for step in job["steps"]:
            assert ("uses" in step) != ("run" in step), f"{name}: {step}"
            for place in re.findall(r"(?<=\s)(?:tests|tools|\.ci)/\w+", f" {step.get('run', '')}"):
                assert (ROOT / place).exists(), place
            for extra in re.findall(r"\.\[([\w,]+)\]", step.get("run", "")):
                assert set(extra.split(",")) <= set(PROJECT["optional-dependencies"])


def test_each_system_and_each_python_that_the_project_names_is_tested():
    declared = {line.rpartition(" ")[2] for line in PROJECT["classifiers"] if re.search(r":: 3\.\d+$", line)}
    for name in ("core", "wheel"):
        matrix = jobs(ROOT / ".github/workflows/test.yml")[name]["strategy"]["matrix"]
        assert set(matrix["python"]) == declared == {"3.11", "3.12", "3.13"}
        assert [one.split("-")[0] for one in matrix["os"]] == ["ubuntu", "macos", "windows"]


def test_the_image_copies_what_is_there_and_not_ignored():
    text = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    wanted = [word for line in re.findall(r"^COPY (?!--from)(.*)$", text, re.MULTILINE) for word in line.split()[:-1]]
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").split() if line.startswith("!")}
    assert set(wanted) == kept
    assert all((ROOT / word).exists() for word in wanted)
    assert (ROOT / re.search(r'CMD \["run", "/opt/(.*?)"', text)[1]).is_file()

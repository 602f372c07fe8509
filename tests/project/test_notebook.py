"""The notebook of the documentation: nothing generated is kept in it, and its cells do what they say."""

import json
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CELLS = json.loads((ROOT / "docs" / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
CODE = ["".join(cell["source"]) for cell in CELLS if cell["cell_type"] == "code"]


def test_nothing_generated_is_kept():
    for cell in CELLS:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


@pytest.mark.slow
def test_cells_run_one_after_the_other(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib").use("agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))

    def shell(line):
        done = subprocess.run(line, shell=True, capture_output=True, text=True, check=True)
        said.append(done.stdout)

    said, known = [], {"shell": shell}
    for code in CODE:
        exec(re.sub(r"^!(.*)$", r"shell(r'''\1''')", code, flags=re.MULTILINE), known)
    assert known["diagnosis"].verdict == "explained"
    assert [one.kind for one in known["diagnosis"].causes] == ["restitution_asymmetry"]
    assert "restitution_asymmetry" in known["diagnosis"]._repr_html_()
    assert "explained: right" in said[-1]

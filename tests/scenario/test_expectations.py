"""Every shipped scenario that expects something gets it from the rigid twin."""

from pathlib import Path

import pytest

from gears3d.recording import describe
from gears3d.runs import judge
from gears3d.scenario import load
from gears3d.scenario.document import names, shipped
from gears3d.simulation import simulate

ROOT = Path(__file__).resolve().parents[2]
EXPECTING = [path for path in (shipped() / f"{name}.toml" for name in names()) if load(path).expect]


@pytest.mark.parametrize("path", EXPECTING, ids=lambda path: path.stem)
def test_what_a_scenario_expects_comes_out_of_the_twin(path):
    scenario = load(path)
    verdicts = judge(scenario, describe(simulate(scenario, model="rigid")))
    assert verdicts.keys() == scenario.expect.keys()
    assert all(verdict["met"] for verdict in verdicts.values()), verdicts

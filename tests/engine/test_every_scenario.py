"""Every shipped scenario in the engine and in the twin: nothing is refused, no impact missed or invented."""

import pytest

from gears3d import simulate
from gears3d.comparison import compare
from gears3d.effects import Code
from gears3d.scenario import load
from gears3d.scenario.document import names, shipped

FILES = [shipped() / f"{name}.toml" for name in names()]


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: f"{file.parent.name}/{file.stem}")
def test_it_runs_as_solids_and_agrees_with_the_twin(file):
    scenario = load(file)
    oiled = any(row.code == Code.GAP_FILM for row in scenario.rows())
    lasts = min(scenario.run.duration, 0.2 if oiled else 1.0)
    short = scenario.with_({"run.duration": f"{lasts!r} s", "run.settle": "0 s"})
    engine, twin = simulate(short), simulate(short, model="rigid")
    found = compare(engine, twin, flight_height_min=0.05e-6, mode="trajectory")
    assert (found.impacts_missed, found.impacts_invented) == (0, 0)
    assert len(set(found.regimes)) == 1
    assert found.velocity_error_median is None or found.velocity_error_median < 1e-3

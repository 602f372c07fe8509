"""What an effect changes in the engine is what it changes in the twin, down to ten times the error budget."""

import numpy as np
import pytest

from gears3d.engine import simulate
from gears3d.lumped import rigid
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
BASE = load(FIG5, ["run.duration=0.7 s"])
PHI = (
    '{{kind="transmission_error", order={order}, amplitude="{size:.12e} m", phase="40 deg", '
    'gear="{gear}", flank="{flank}"}}'
)
CASES = {
    "te drive both": PHI.format(order=1, size=50e-6, gear="drive", flank="both"),
    "te drive active": PHI.format(order=3, size=-20e-6, gear="drive", flank="active"),
    "te loose both": PHI.format(order=2, size=-30e-6, gear="loose", flank="both"),
    "te loose active": PHI.format(order=90, size=1e-6, gear="loose", flank="active"),
    "drag_viscous": '{kind="drag_viscous", coefficient="0.01 N m s/rad"}',
    "restitution_speed +": '{kind="restitution_speed", slope="2 s/m"}',
    "restitution_speed -": '{kind="restitution_speed", slope="-4 s/m"}',
    "tooth_compliance": '{kind="tooth_compliance", stiffness="5.2e6 N/m", damping="1000 N s/m"}',
}


def displacement(model, *effects):
    scenario = BASE.with_([f"effect=[{', '.join(effects)}]"]) if effects else BASE
    return model(scenario).signals["displacement_m"][:14000]


@pytest.fixture(scope="module")
def base():
    return displacement(simulate), displacement(rigid.simulate)


@pytest.mark.parametrize("case", CASES)
def test_change_is_the_twins(case, base):
    ours = displacement(simulate, CASES[case]) - base[0]
    twins = displacement(rigid.simulate, CASES[case]) - base[1]
    assert np.abs(twins).max() > 1e-7
    assert np.abs(ours - twins).max() <= 1e-3 * np.abs(twins).max()


def test_both_models_draw_the_same_scatter():
    """The seed and the number of an impact make its scatter: runs match impact by impact, and the seed matters."""
    scatter = '{kind="restitution_scatter", standard_deviation=0.05}'
    first, second = (
        [model(BASE.with_([f"effect=[{scatter}]", f"run.seed={seed}"])).impacts["velocity_m_s"] for seed in (0, 5)]
        for model in (simulate, rigid.simulate)
    )
    for ours, twins in zip(first, second, strict=True):
        assert np.abs(ours[:12] - twins[:12]).max() < 1e-8
    assert np.abs(first[0][:12] - first[1][:12]).max() > 1e-4


TINY = {
    "te drive both": [PHI.format(order=1, size=sign * 1e-10, gear="drive", flank="both") for sign in (1, -1)],
    "te loose active": [PHI.format(order=2, size=sign * 1e-10, gear="loose", flank="active") for sign in (1, -1)],
    "drag_viscous": ['{kind="drag_viscous", coefficient="1.5e-8 N m s/rad"}'],
    "restitution_speed": [f'{{kind="restitution_speed", slope="{slope} s/m"}}' for slope in (5e-6, -5e-6)],
}


@pytest.mark.parametrize(("kind", "number"), [(kind, n) for kind, texts in TINY.items() for n in range(len(texts))])
def test_change_at_ten_times_the_error_budget(kind, number, base):
    """Sizes that move the loose gear by about 1e-10 m, ten times ``error_budget["total"]``."""
    text = TINY[kind][number]
    ours, twins = displacement(simulate, text) - base[0], displacement(rigid.simulate, text) - base[1]
    size = np.abs(twins).max()
    assert 0.3e-10 < size < 3e-10
    assert np.abs(ours - twins).max() <= 0.05 * size


@pytest.mark.parametrize("stiffness", [2e11, 2e9])
def test_teeth_sink_in_as_the_twins_do(stiffness):
    """A flank that yields by 1e-10 m under the drag, ten times the error budget."""
    text = f'effect=[{{kind="tooth_compliance", stiffness="{stiffness:g} N/m", damping="10 N s/m"}}]'
    short = ["run.duration=4 ms", 'run.settle="0 s"']
    rigid_flanks, yielding = load(FIG5, short), load(FIG5, [*short, text])
    ours, twins = (
        model(yielding).signals["displacement_m"] - model(rigid_flanks).signals["displacement_m"]
        for model in (simulate, rigid.simulate)
    )
    size = np.abs(twins).max()
    assert size * stiffness == pytest.approx(20.0, rel=0.02)  # N, inertia and drag at t = 0
    assert np.abs(ours - twins).max() <= 0.05 * size

"""Runs too long for the memory are refused before they are simulated."""

import pytest

from gears3d.errors import InputError
from gears3d.inputs import VARIABLE
from gears3d.scenario import load
from gears3d.simulation import MODELS, simulate

LONG = {"run.duration": "2000 s", "run.output_rate": "20 kHz"}


@pytest.mark.parametrize("model", ["bullet", "rigid"])
def test_a_run_too_long_for_the_memory_is_refused_at_once(model, monkeypatch):
    monkeypatch.setenv(VARIABLE, "1e9")
    assert model in MODELS
    with pytest.raises(InputError) as caught:
        simulate(load("rigaud-2020/fig5-20rpm", LONG), model)
    (fault,) = caught.value.faults
    assert fault.key == "run.output_rate"
    assert "2000 s at 20000 Hz, 4e+07 samples, require 4.1 GiB of memory, 0.931 GiB are permitted" in fault.message
    assert "run.duration" in fault.remedy
    assert VARIABLE in fault.remedy
    assert ("--stream" in fault.remedy) == (model == "bullet")

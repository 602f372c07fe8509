"""An excerpt of a record that cannot be segmented, gone over by the law of contact that was found."""

import numpy as np
import pytest

from gears3d.diagnosis import diagnose
from gears3d.diagnosis.validity import excerpt
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan


@pytest.mark.slow
def test_law_of_contact_goes_over_the_record(tmp_path):
    hide(plan(10021, ("tooth_compliance",), size=0.4, records=2, duration=4.0, noise=0.005), tmp_path)
    rig = load(tmp_path / "rig.toml")
    admitted = [admit(file, rig, chart) for file, chart in files_of([tmp_path / "record.toml"])]
    made = excerpt(diagnose(admitted, rig), admitted)
    off = [
        np.sqrt(np.mean((np.interp(made.measured.time, one.time, one.signals["displacement_m"])
                         - made.measured.signals["displacement_m"]) ** 2))
        for one in (made.base, made.extended)
    ]  # fmt: skip
    assert off[1] < 0.01 * rig.rig().backlash < 0.1 * off[0]

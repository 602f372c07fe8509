"""Numbers that no model should ever see: told at the door with key and remedy, in every model alike."""

import pytest

from gears3d.errors import InputError
from gears3d.verification.validation import fig5


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"impact.restitution": 1.2}, "impact.restitution", "at most 1"),
        ({"impact.restitution": -0.1}, "impact.restitution", "at least 0"),
        ({"motion.harmonics[0].frequency": "11 kHz"}, "motion.harmonics[0].frequency", "half of run.output_rate"),
        ({"motion.harmonics[0].frequency": "0 Hz"}, "motion.harmonics[0].frequency", "more than 0"),
        ({"effect": [{"kind": "tooth_compliance", "stiffness": "0 N/m"}]}, "effect[0].stiffness", "at least"),
        (
            {"effect": [{"kind": "drive_motion", "amplitude": "1 rpm", "frequency": "11 kHz"}]},
            "effect[0]",
            "output_rate",
        ),
        ({"effect": [{"kind": "backlash_variation", "amplitude": "300 um"}]}, "effect[0]", "backlash"),
        ({"effect": [{"kind": "backlash_offset", "offset": "-260 um"}]}, "effect[0]", "backlash"),
        ({"mount.backlash": "0 um"}, "mount.backlash", "no gap"),
    ],
)
def test_it_is_refused_with_its_key_and_a_remedy(changes, key, words):
    with pytest.raises(InputError) as caught:
        fig5().with_(changes)
    fault = caught.value.faults[0]
    assert fault.key.startswith(key)
    assert words in f"{fault.message} {fault.remedy}"
    assert fault.remedy or "must be" in fault.message

"""What an effect cannot be on its rig is told at the door, with its key and what to do."""

import pytest

from gears3d.errors import InputError
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
"""250 µm of backlash, 0.22 N m of drag, 30 rpm, 20 kHz."""


def faults(effects, *changes):
    with pytest.raises(InputError) as caught:
        load(FIG5, [f"effect=[{effects}]", *changes])
    return [(fault.key, str(fault)) for fault in caught.value.faults]


CASES = {
    "below zero": ('{kind="drag_coulomb", torque="-0.3 N m"}', "effect[0].torque", "-80 mN m"),
    "two of them": (
        '{kind="drag_coulomb", torque="-0.1 N m"}, {kind="drag_drift", relative_change=-0.6, time_constant="9 s"}',
        "effect[1].relative_change",
        "120 mN m",
    ),
    "no base drag": ('{kind="drag_drift", relative_change=1, time_constant="9 s"}', "effect[0].relative_change", "0 N"),
    "offset": ('{kind="backlash_offset", offset="-250 um"}', "effect[0].offset", "mount.backlash"),
    "variation": ('{kind="backlash_variation", amplitude="-260 um", order=3}', "effect[0].amplitude", "-10 um"),
    "together": (
        '{kind="backlash_offset", offset="-150 um"}, {kind="backlash_variation", amplitude="101 um"}',
        "effect[1].amplitude",
        "-1 um",
    ),
    "eccentric": ('{kind="eccentricity", offset="370 um"}', "effect[0].offset", "-5.28866"),  # 250 - 740·sin 20.181°
    "thick teeth": (
        '{kind="pitch_error", tooth=1, flank="active", offset="130 um"},'
        '{kind="pitch_error", tooth=1, flank="reverse", gear="loose", offset="-130 um"}',
        "effect[1].offset",
        "-10 um",
    ),
    "no such tooth": ('{kind="pitch_error", tooth=91, offset="1 um"}', "effect[0].tooth", "has 90 teeth"),
    "no stiffness": ('{kind="tooth_compliance", stiffness="0 N/m"}', "effect[0].stiffness", "at least"),
    "too fast": ('{kind="drive_motion", amplitude="1 rpm", frequency="11 kHz"}', "effect[0].frequency", "22 kHz"),
    "too high": ('{kind="drive_motion", amplitude="1 rpm", order=22000}', "effect[0].order", "10000"),
    "order too fast": ('{kind="drive_motion", amplitude="1 rpm", order=10000}', "effect[0].order", "output_rate"),
    "both": ('{kind="drive_motion", amplitude="1 rpm", order=2, frequency="3 Hz"}', "effect[0].order", "keep one"),
    "neither": ('{kind="drive_motion", amplitude="1 rpm"}', "effect[0].frequency", "is missing"),
    "a torque": ('{kind="drive_motion", amplitude="1 N m", order=2}', "effect[0].amplitude", "an angular acceleration"),
    "e > 1": ('{kind="restitution_offset", offset=1.5}', "effect[0].offset", "at most 1"),
    "locks": ('{kind="mesh_friction", coefficient=1}', "effect[0].coefficient", "at most 0.9"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_fault_names_key_and_remedy(case):
    effects, key, words = CASES[case]
    changes = {"no base drag": ["drag.torque=0 N m"], "order too fast": ["run.output_rate=9 kHz"]}.get(case, [])
    found = faults(effects, *changes)
    assert [place for place, _ in found] == [key]
    assert words in found[0][1]
    assert found[0][1].startswith("--set: ")


def test_order_needs_a_mean_speed():
    found = faults('{kind="drive_motion", amplitude="1 rpm", order=2}', "motion.mean=0 rpm")
    assert found[0][0] == "effect[0].order"
    assert "mean speed" in found[0][1]


def test_what_just_fits_is_taken():
    fine = [
        '{kind="drag_coulomb", torque="-0.22 N m"}',
        '{kind="backlash_offset", offset="-249 um"}, {kind="transmission_error", amplitude="300 um"}',
        '{kind="eccentricity", offset="360 um"}',
        '{kind="backlash_offset", offset="-200 um"}, {kind="backlash_offset", offset="100 um"}',
        '{kind="drive_motion", amplitude="1 rpm", frequency="10 kHz"}',
    ]
    for effects in fine:
        assert load(FIG5, [f"effect=[{effects}]"]).effects


def test_effects_do_not_hide_other_faults_nor_the_other_way_round():
    found = faults('{kind="drag_coulomb", torque="-1 N m"}', "sensors.sample_rate=0 Hz", "expect.regime=chaos")
    assert [key for key, _ in found] == ["sensors.sample_rate", "expect.regime", "effect[0].torque"]

"""Records of a lumped model whose teeth are springs, with a fluctuation in step with the revolution and no noise."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

from gears3d.measured.checks import admit
from gears3d.measured.segmentation import measure
from gears3d.scenario import load
from gears3d.simulation import record

RATE, LASTS, STIFFNESS, BACKLASH = 50_000, 2.0, 1e8, 1.4e-4
INERTIA, TORQUE = 2e-4, 0.15


@njit(cache=False)
def moves(speed, fluctuation, turn, damping, steps, stiffness, backlash, radii, mass, pull):
    """Return the places of drive and loose gear along the line of action at every tenth step [m], (2, n)."""
    step, count = 1.0 / 500_000, steps // 10
    made = np.zeros((2, count))
    place, pace = 0.0, radii[0] * speed
    for k in range(steps):
        time = k * step
        drive = radii[0] * (speed * time + fluctuation / turn * np.sin(turn * time))
        moving = radii[0] * (speed + fluctuation * np.cos(turn * time))
        if k % 10 == 0:
            made[0, k // 10], made[1, k // 10] = drive, place
        off, rate, force = place - drive, pace - moving, 0.0
        if off < 0.0:
            force = max(-stiffness * off - damping * rate, 0.0)
        elif off > backlash:
            force = min(-stiffness * (off - backlash) - damping * rate, 0.0)
        pace += (force / mass - pull) * step
        place += pace * step
    return made


def springs(rpm):
    """Return a record of a pair of 29 and 37 teeth at 1000 rpm or so, of a second order of 5 %, and its rig."""
    rig = load("scenarios/rigaud-2020/fig5-20rpm.toml", {
        "gears.module": "2 mm", "gears.pressure_angle": "20 deg", "gears.helix_angle": "0 deg",
        "gears.drive.teeth": 29, "gears.loose.teeth": 37, "gears.loose.inertia": f"{INERTIA} kg m^2",
        "mount.backlash": f"{BACKLASH} m", "mount.centre_distance": "66 mm", "drag.torque": f"{TORQUE} N m",
        "motion.mean": f"{rpm} rpm", "motion.harmonics": [{"amplitude": f"{0.05 * rpm} rpm", "order": 2}],
        "run.duration": f"{LASTS} s", "run.settle": "0 s", "sensors.sample_rate": f"{RATE} Hz",
    })  # fmt: skip
    radii = (rig.rig().base_radius_drive, rig.rig().base_radius_loose)
    speed, mass = np.pi / 30.0 * rpm, INERTIA / radii[1] ** 2
    pull, damping = TORQUE / INERTIA * radii[1], 0.4 * np.sqrt(STIFFNESS * mass)
    steps = int(LASTS * 500_000)
    drive, loose = moves(speed, 0.05 * speed, 2.0 * speed, damping, steps, STIFFNESS, BACKLASH, radii, mass, pull)
    made = record(rig)
    signals = {**made.signals, "time_s": np.arange(len(drive)) / RATE, "theta_drive_rad": drive / radii[0],
               "theta_loose_rad": loose / radii[1]}  # fmt: skip
    return replace(
        made, signals={name: signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad")}
    ), rig


@pytest.mark.slow
@pytest.mark.parametrize(("rpm", "regime"), [(1000, "single_sided"), (1300, "double_sided")])
def test_a_model_of_springs_without_noise_is_segmented(tmp_path, rpm, regime):
    """Where rattle is in step with the revolution, neither flanks nor a second flank are what flights look like."""
    made, rig = springs(rpm)
    made.write(tmp_path / "r.parquet")
    seen = admit(tmp_path / "r.parquet", rig)
    assert not [one for one in seen.findings if one.kind == "wave"]
    found = measure(seen.recording, rig).summary
    assert found["regime"] == regime
    backlash = found["flanks"]["backlash_m"]
    assert (backlash is None) == (regime == "single_sided")
    if backlash is not None:
        assert backlash["ci95"][0] < BACKLASH < backlash["ci95"][1]
        marked = {(one["gear"], one["order"]): one["in_step"] for one in found["flanks"]["orders"]["backlash"]}
        assert marked["drive", 2]
        assert not marked["loose", 2]

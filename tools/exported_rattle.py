#!/usr/bin/env python
"""How an exported pair rattles in stock PyBullet and stock MuJoCo, beside the engine and the rigid model of gears3d.

Impacts end flights of at least 5 µm after the scenario's settling time; the displacement is compared with the rigid
model's over all of the run. MuJoCo needs `pip install gears3d[bench]` and is left out without it.

Example: tools/exported_rattle.py rigaud-2020/fig5-20rpm --duration "2 s" --restitution 0.3 0.8
"""

import argparse
import math
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from gears3d.engine import simulate
from gears3d.lumped import rigid
from gears3d.scenario import load
from gears3d.views.multibody import write_multibody

LEAST_FLIGHT = 5e-6
PYBULLET_STEP = 2e-5
DRIVE, LOOSE = 0, 1


class Motion(NamedTuple):
    """Path of the loose gear: times [s], its speed [m/s], displacement [m] and relative velocity [m/s]."""

    time: np.ndarray
    speed: np.ndarray
    place: np.ndarray
    rate: np.ndarray


def drive_angle(scenario, time):
    """Angle of the drive gear [rad]."""
    angle = scenario.motion.mean * time
    for wave in scenario.motion.harmonics:
        turning = 2.0 * math.pi * wave.frequency
        angle += wave.amplitude / turning * (math.cos(wave.phase) - math.cos(turning * time + wave.phase))
    return angle


def in_pybullet(folder, scenario, duration, step=PYBULLET_STEP):
    """Load pair.urdf in mm, impose the motion of the drive and return the path of the loose gear."""
    import pybullet
    from pybullet_utils.bullet_client import BulletClient

    bullet = BulletClient(pybullet.DIRECT)  # of its own: the engine keeps worlds in the same process
    try:
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_USE_SELF_COLLISION
        pair = bullet.loadURDF(str(folder / "pair.urdf"), useFixedBase=True, globalScaling=1000, flags=flags)
        bullet.setPhysicsEngineParameter(
            fixedTimeStep=step,
            restitutionVelocityThreshold=0,
            solverResidualThreshold=0,
            contactERP=0,
            contactBreakingThreshold=1e-4,
        )
        bullet.changeDynamics(pair, -1, maxJointVelocity=1e9)  # 100 rad/s otherwise; alone, and to the base
        bullet.changeDynamics(pair, -1, linearDamping=0, angularDamping=0)
        for gear in (DRIVE, LOOSE):
            bullet.changeDynamics(pair, gear, contactProcessingThreshold=0, linearDamping=0, angularDamping=0)
        heavy = [1e3 * moment for moment in bullet.getDynamicsInfo(pair, DRIVE)[2]]
        bullet.changeDynamics(pair, DRIVE, localInertiaDiagonal=heavy)
        drag = bullet.getJointInfo(pair, LOOSE)[7]
        bullet.setJointMotorControl2(pair, DRIVE, bullet.VELOCITY_CONTROL, force=0)
        bullet.setJointMotorControl2(pair, LOOSE, bullet.VELOCITY_CONTROL, targetVelocity=0, force=drag)
        times = step * np.arange(round(duration / step) + 1)
        angles = [drive_angle(scenario, time) for time in times]
        ratio = scenario.gears.drive.teeth / scenario.gears.loose.teeth
        bullet.resetJointState(pair, LOOSE, 0.0, ratio * (angles[1] - angles[0]) / step)
        states = np.zeros((len(times) - 1, 2))
        for i in range(len(states)):
            bullet.resetJointState(pair, DRIVE, angles[i], (angles[i + 1] - angles[i]) / step)
            bullet.stepSimulation()
            states[i] = bullet.getJointState(pair, LOOSE)[:2]
    finally:
        bullet.disconnect()
    return path(scenario, times[1:], states)


def in_mujoco(folder, scenario, duration):
    """Load pair.xml, start from its keyframe and return the path of the loose gear."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(folder / "pair.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    states = np.zeros((round(duration / model.opt.timestep), 2))
    for i in range(len(states)):
        mujoco.mj_step(model, data)
        states[i] = data.qpos[-1], data.qvel[-1]
    return path(scenario, model.opt.timestep * np.arange(1, len(states) + 1), states)


def path(scenario, times, states):
    """Put angles and speeds of the loose gear beside the drive's."""
    rig = scenario.rig()
    angles = np.array([drive_angle(scenario, time) for time in times])
    place = rig.base_radius_loose * states[:, 0] - rig.base_radius_drive * angles
    speed = rig.base_radius_loose * states[:, 1]
    return Motion(times, speed, place, speed - rig.base_radius_drive * np.gradient(angles, times))


def impacts(scenario, motion):
    """Approach and rebound speeds [m/s] of the impacts that end flights after settling, (n, 2)."""
    rig, step = scenario.rig(), motion.time[1] - motion.time[0]
    change = rig.drag_torque / rig.inertia * rig.base_radius_loose * step
    touching = np.flatnonzero(np.abs(np.diff(motion.speed) + change) > max(5e-6, 0.1 * change))
    found, left = [], 0
    ends = np.flatnonzero(np.diff(touching) > 3)
    for first, last in zip(touching[np.append(0, ends + 1)], touching[np.append(ends, -1)] + 1, strict=True):
        if np.ptp(motion.place[left : first + 1]) >= LEAST_FLIGHT and motion.time[first] >= scenario.run.settle:
            away = -1.0 if motion.place[first] < 0.5 * rig.backlash else 1.0
            found.append((away * motion.rate[first], -away * motion.rate[last]))
        left = last
    return np.array(found).reshape(-1, 2)


def listed(scenario, recording):
    """The same of a recording of gears3d."""
    table = recording.impacts
    kept = (table["flight_height_m"] >= LEAST_FLIGHT) & (table["time_s"] >= scenario.run.settle)
    return np.abs(np.c_[table["velocity_m_s"], table["rebound_m_s"]][kept])


def measure(scenario):
    """Yield (engine, impacts, error of the displacement [m], processor seconds for a simulated one)."""
    twin = rigid.simulate(scenario.with_({"run.output_rate": "200 kHz"}))
    yield "rigid model", listed(scenario, twin), 0.0, math.nan
    simulate(scenario)  # compiles
    begin = time.process_time()
    own = simulate(scenario)
    spent = time.process_time() - begin
    yield "gears3d engine", listed(scenario, own), error_of(own.time, own.signals["displacement_m"], twin), spent
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_multibody(scenario, folder, ["urdf", "mjcf"])
        for engine, run in (("PyBullet, pair.urdf", in_pybullet), ("MuJoCo, pair.xml", in_mujoco)):
            begin = time.process_time()
            try:
                motion = run(folder, scenario, scenario.run.duration)
            except ModuleNotFoundError:
                print(f"{engine}: not installed, left out")
                continue
            spent = time.process_time() - begin
            yield engine, impacts(scenario, motion), error_of(motion.time, motion.place, twin), spent


def error_of(times, place, twin):
    """Return the root mean square distance from the rigid model [m]."""
    return float(np.sqrt(np.mean((place - np.interp(times, twin.time, twin.signals["displacement_m"])) ** 2)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", nargs="?", default="rigaud-2020/fig5-20rpm")
    parser.add_argument("--duration", default="2 s")
    parser.add_argument("--restitution", nargs="+", default=["0", "0.3", "0.8"])
    asked = parser.parse_args()
    print("| e | engine | impacts per period | restitution: median (quartiles) | approach [mm/s] | rms [µm] | s/s |")
    print("|---|---|---|---|---|---|---|")
    for value in asked.restitution:
        scenario = load(asked.scenario, [f"run.duration={asked.duration}", f"impact.restitution={value}"])
        periods = (scenario.run.duration - scenario.run.settle) / scenario.period
        for engine, found, error, spent in measure(scenario):
            cost = f"{1e6 * error:.1f} | {spent / scenario.run.duration:.2g}"
            if len(found) == 0:
                print(f"| {value} | {engine} | 0.00 | | | {cost} |")
                continue
            low, middle, high = np.quantile(found[:, 1] / found[:, 0], [0.25, 0.5, 0.75])
            line = f"| {value} | {engine} | {len(found) / periods:.2f} | {middle:.3f} ({low:.3f} to {high:.3f}) "
            print(f"{line}| {1e3 * found[:, 0].mean():.1f} | {cost} |", flush=True)


if __name__ == "__main__":
    main()

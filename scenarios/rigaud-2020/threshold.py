"""Rigaud & Perret-Liaudet 2020, eqs (7)-(10): contact is lost where the excitation passes 1, at any frequency."""

from math import pi
from pathlib import Path

import gears3d as g3

base = g3.load(Path(__file__).with_name("fig5-5rpm.toml"))
rig = base.rig()
print("  Hz   rpm at excitation 1    impacts at 0.98    at 1.02")
for frequency in (1.0, 3.0, 10.0):
    rpm = rig.drag_torque / rig.inertia / (2 * pi * frequency) * 30 / pi
    found = []
    for excitation in (0.98, 1.02):
        harmonics = [{"amplitude": f"{excitation * rpm} rpm", "frequency": f"{frequency} Hz"}]
        run = g3.simulate(base.with_({"motion.harmonics": harmonics}), model="rigid")
        found.append(len(run.impacts["time_s"]))
    print(f"{frequency:4.0f} {rpm:16.3f} {found[0]:18d} {found[1]:12d}")

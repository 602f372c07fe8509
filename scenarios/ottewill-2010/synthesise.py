"""Ottewill et al. 2010, eq. (11): write this folder's files, whose error functions are assumed."""

from math import pi
from pathlib import Path

from gears3d.verification.papers.measures.tooth_errors import ERRORS, drive_phase, error_function

RADIUS = 50.743e-3  # base radius, m
HEAD = """\
# Case {case} of Ottewill, Neild & Wilson 2010 at steady speed. Printed is the largest amplitude of the error,
# {peak:g} rad; ASSUMED are its 21 orders and their phases (gears3d/verification/papers/measures/tooth_errors.py).
# Written by synthesise.py.
format = 1
extends = "../base/ottewill-2010.toml"
title  = "Ottewill, Neild & Wilson 2010, case {case} at steady speed"
source = "ottewill-2010, section 5; orders of the error assumed"

[[effect]]                       # delta = c/(I*Omega) = 2.3 with Omega = 1 rev/s
kind = "drag_viscous"
coefficient = "0.023 N m s/rad"

[[effect]]                       # delta_contact - delta = {more:g}
kind = "mesh_drag"
coefficient = "{drag:g} N m s/rad"
"""
EFFECT = """
[[effect]]
kind = "transmission_error"
order = {order}
amplitude = "{amplitude:.4f} um"
phase = "{phase:.5f} rad"
"""

POINT = """\
# {what}; phase of the drive {phase:g} rad after that of order 1 of the error, the
# "phase relative to eccentricity" of the paper. Time 0 is where the drive's angle is 0. Written by synthesise.py.
format = 1
extends = "case-i.toml"
title  = "Ottewill, Neild & Wilson 2010, {name}"
source = "ottewill-2010, {figure}; orders of the error assumed"

[motion]
harmonics = [ {{ amplitude = "0.43 rad", frequency = "1 Hz", phase = "{turned:.6f} rad" }} ]

[run]
duration = "6 s"
settle = "1 s"
output_rate = "1 kHz"
"""
POINTS = {
    "fig5a": ("Small rattle on the rig", "fig. 5 (a), small rattle", "fig. 5", 2.60),
    "fig5b": ("Medium rattle on the rig", "fig. 5 (b), medium rattle", "fig. 5", 5.14),
    "fig5c": ("Large rattle on the rig", "fig. 5 (c), large rattle", "fig. 5", 0.25),
    "fig6-lag": ("Fig. 5 (b) with the drive 0.035 rad later", "fig. 6, lagging", "fig. 6", 5.105),
    "fig6-lead": ("Fig. 5 (b) with the drive 0.035 rad earlier", "fig. 6, leading", "fig. 6", 5.175),
}


def text(case: str) -> str:
    """Return the scenario of a case: the transmission error is the error's negative, along the line of action."""
    peak, more = ERRORS[case][0], 1.4 if case == "iii" else 1.9
    parts = [HEAD.format(case=case, peak=peak, more=more, drag=0.01 * more)]
    for order, amplitude, phase in zip(*error_function(case), strict=True):
        size, turned = amplitude * RADIUS * 1e6, (phase + pi) % (2 * pi)
        parts.append(EFFECT.format(order=order, amplitude=size, phase=turned))
    return "".join(parts)


if __name__ == "__main__":
    for case in ERRORS:
        Path(__file__).with_name(f"case-{case}.toml").write_text(text(case))
    for file, (what, name, figure, phase) in POINTS.items():
        turned = drive_phase("i", 0.43, phase)
        point = POINT.format(what=what, name=name, figure=figure, phase=phase, turned=turned)
        Path(__file__).with_name(f"{file}.toml").write_text(point)

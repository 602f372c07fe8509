"""The bench of Rigaud & Perret-Liaudet 2020 with the base radius rounded to 148 mm, for the kernel's tests."""

from math import inf, pi

from gears3d.effects import Rig
from gears3d.lumped.model import model
from gears3d.lumped.run import run

RPM = pi / 30


def bench(amplitude=20 * RPM, frequency=3.0, backlash=250e-6, e=0.0, mean=30 * RPM, drag=0.22, rows=(), **more):
    """Return the packed model; ``amplitude`` in rad/s, none when 0."""
    rig = Rig(0.148, 0.148, 0.0695, drag, backlash, e, mean, 90, 90)
    return model(rig, [(amplitude, frequency, 0.0)] if amplitude else [], rows, **more)


def simulate(duration, start="active", spacing=inf, lyapunov=False, **about):
    """Return the outcome of a run of the bench."""
    return run(bench(**about), duration, spacing, start, lyapunov=lyapunov)

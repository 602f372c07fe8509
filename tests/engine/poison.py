"""A world whose state turns into no number after some steps."""

from gears3d.engine import door


def poison(monkeypatch, after):
    """Let every world's speed be lost after so many steps.

    Args:
        monkeypatch: pytest's own.
        after: steps that are honest.
    """
    honest, steps = door.World.step, []

    def poisoned(self, duration, torque):
        steps.append(duration)
        state = honest(self, duration, torque)
        return state if len(steps) < after else (float("nan"), state[1])

    monkeypatch.setattr(door.World, "step", poisoned)

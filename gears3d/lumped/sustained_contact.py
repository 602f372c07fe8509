"""Contact with a perfect flank under dry friction in closed form, up to its loss.

It is lost where J·ω·A·(Rb1/Rb2)·cos ψ = −T; Rigaud & Perret-Liaudet 2020, eqs (17), (18). Dry friction changes its sign
where the drive reverses.
"""

from __future__ import annotations

from math import acos, asin, inf, pi

from gears3d.lumped import layout as at
from gears3d.lumped.closed_form import place, sample
from gears3d.lumped.compile import inner
from gears3d.lumped.flank_events import pressing, separate
from gears3d.lumped.law import thrust


@inner
def follow_contact(m, state, count, contacts, samples, spacing, end):
    """Stay on a flank until contact is lost, the drive reverses, or the end."""
    amplitude, omega, t = m[at.HARMONICS], m[at.HARMONICS + 1], state[at.TIME]
    flank = int(state[at.MODE]) - at.STUCK
    side, ratio, psi = 1.0 - 2.0 * flank, m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE], omega * t + m[at.HARMONICS + 2]
    torque, sign = pressing(m, t, flank, state[at.SLIDE])
    dry = m[at.BASE] if state[at.SLIDE] == 1.0 else m[at.BASE + 3 * (1 + flank)]
    driven, loss = m[at.INERTIA] * ratio * amplitude * omega, inf
    if torque <= 0.0 and sign != 0.0:
        loss = t
    elif abs(dry * sign) < driven:
        loss = t + (side * acos(-dry * sign / driven) - psi) % (2.0 * pi) / omega
    if loss < t + state[at.HOLD]:
        end, loss = min(t + state[at.HOLD], end), inf
    if abs(m[at.MEAN]) < amplitude:
        still = asin(m[at.MEAN] / amplitude)
        end = min(end, t + ((pi + still if sign > 0.0 else -still) - psi) % (2.0 * pi) / omega)
    end = min(end, loss)
    state[at.SIGN] = sign
    sample(m, state, count, samples, spacing, end)
    place(m, state, end, flank, 0.0, 0.0, 0.0, state[at.HEIGHT])
    state[at.SPEED], state[at.HOLD] = ratio * state[at.DRIVE_SPEED], 0.0
    if end < loss:
        return
    if m[at.GATED + flank] != 0.0:  # the torques of flight may press the gear back at once
        torque, sign = pressing(m, end, flank, 1.0 - state[at.SLIDE])
        mass = m[at.INERTIA] / m[at.RADIUS_LOOSE] / m[at.RADIUS_LOOSE]
        if torque * side * thrust(m, side, sign) > m[at.UNFELT] * mass:
            state[at.SLIDE] = 1.0 - state[at.SLIDE]
            return
    row = contacts[count[at.N_CONTACTS]]
    row[0], row[1], row[2] = flank, state[at.CONTACT_SINCE], end
    count[at.N_CONTACTS] += 1
    separate(m, state, flank, float(flank))

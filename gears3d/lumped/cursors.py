"""Tables in the compiled kernel: piecewise polynomials over time, an angle or the loose gear's speed.

The state remembers the piece that each table is in. A step ends where a variable leaves its piece, so within a step
every table is one polynomial, and its composition with the series of its variable is exact.
"""

from __future__ import annotations

from math import inf

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.roots import first_root

SLACK = 4e-15  # relative distance from a knot that is rounding
BRIEF = 1e-9  # added to an approximate distance [s]


@inner
def page(m, state, i):
    """Return the place of table i's current piece, its degree, and the start of its variable there."""
    row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
    width = int(m[row + at.WIDTH])
    place = int(m[row + at.AT_PIECES]) + width * int(state[cursor])
    return place + 1, width - 2, m[place] + state[cursor + 1]


@inner
def walk(m, state, i, x):
    """Select the piece of table i that holds x."""
    row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
    knots, last = int(m[row + at.AT_KNOTS]), int(m[row + at.PIECES]) - 1
    k, slack = int(state[cursor]), SLACK * abs(x)
    while k < last and x > m[knots + k + 1] + slack:
        k += 1
    while k > 0 and x < m[knots + k] - slack:
        k -= 1
    state[cursor] = k


@inner
def horizon(m, state, reach):
    """Find the pieces of the tables of torques and of time, and return the distance to the nearest knot of time.

    For a table over the drive's angle it is the approximate distance to its next knot, which limits the step.
    """
    t = state[at.TIME]
    for i in range(int(m[at.N_TABLES])):
        row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
        variable = int(m[row + at.VARIABLE])
        if variable == at.TIME_TABLE:
            knots, last = int(m[row + at.AT_KNOTS]), int(m[row + at.PIECES]) - 1
            while state[cursor] < last and t >= m[knots + int(state[cursor]) + 1] * (1.0 - SLACK):
                state[cursor] += 1.0
            reach = min(reach, m[knots + int(state[cursor]) + 1] - t)
        elif variable == at.THETA1 and state[at.DRIVE_SPEED] != 0.0:
            angle = (m[at.RADIUS_LOOSE] * state[at.ANGLE] - state[at.DISPLACEMENT]) / m[at.RADIUS_DRIVE]
            ahead = 1 if state[at.DRIVE_SPEED] > 0.0 else 0
            knot = m[int(m[row + at.AT_KNOTS]) + int(state[cursor]) + ahead] + state[cursor + 1]
            reach = min(reach, 1.1 * abs((knot - angle) / state[at.DRIVE_SPEED]) + BRIEF)
        elif variable == at.OMEGA2:
            walk(m, state, i, state[at.SPEED])
        elif variable == at.THETA2:
            walk(m, state, i, state[at.ANGLE])
    return reach


@inner
def crossing(m, state, w, n, x):
    """Return the first time within [0, x) when a variable leaves its piece, the table, and on which side; or x, -1."""
    table, way = -1, 0
    for i in range(int(m[at.N_TABLES])):
        row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
        variable = int(m[row + at.VARIABLE])
        if variable == at.TIME_TABLE:
            continue
        series, order = w[variable], n - 1 if variable == at.OMEGA2 else n
        here, first = series[0], int(m[row + at.AT_KNOTS]) + int(state[cursor])
        slack = SLACK * (abs(here) + state[at.TIME] * abs(series[1]))
        for side in range(2):
            knot = m[first + side] + state[cursor + 1]
            if abs(knot) < inf:
                series[0] = here - knot
                if abs(series[0]) <= slack:
                    series[0] = 0.0
                root = first_root(series, 1.0 - 2.0 * side, order, x)
                if root < x:
                    x, table, way = root, i, side
        series[0] = here
    return x, table, way


@inner
def turn_page(m, state, i, side):
    """Select the next piece of table i; returns the change of its slope."""
    row, cursor = int(m[at.AT_TABLES]) + at.PER_TABLE * i, at.STATE + 2 * i
    pieces, period = int(m[row + at.PIECES]), m[row + at.PERIOD]
    knot = m[int(m[row + at.AT_KNOTS]) + int(state[cursor]) + side] + state[cursor + 1]
    before = derivatives(m, state, i, knot)[1]
    state[cursor] += 2.0 * side - 1.0
    if state[cursor] == pieces:
        state[cursor], state[cursor + 1] = 0.0, state[cursor + 1] + period
    elif state[cursor] < 0.0:
        state[cursor], state[cursor + 1] = pieces - 1.0, state[cursor + 1] - period
    return derivatives(m, state, i, knot)[1] - before


@inner
def derivatives(m, state, i, x):
    """Return the polynomial that table i is in, and its first and second derivative, at x."""
    place, degree, start = page(m, state, i)
    u, value, slope, bend = x - start, m[place + degree], 0.0, 0.0
    for k in range(degree - 1, -1, -1):
        bend = bend * u + slope
        slope = slope * u + value
        value = value * u + m[place + k]
    return value, slope, 2.0 * bend


@inner
def linear(m, state, i, k, w):
    """Return the coefficient of order k of a table of straight lines."""
    row = int(m[at.AT_TABLES]) + at.PER_TABLE * i
    variable = int(m[row + at.VARIABLE])
    place, _, start = page(m, state, i)
    if k == 0:
        x = state[at.TIME] if variable == at.TIME_TABLE else w[variable, 0]
        return m[place] + m[place + 1] * (x - start)
    if variable == at.TIME_TABLE:
        return m[place + 1] if k == 1 else 0.0
    return m[place + 1] * w[variable, k]


@inner
def shifted(m, place, degree, u, out):
    """Write the polynomial's coefficients about u."""
    for k in range(degree + 1):
        out[k] = m[place + k]
    for i in range(degree):
        for k in range(degree - 1, i - 1, -1):
            out[k] += u * out[k + 1]


@inner
def motion(m, state, n, w):
    """Add the tabulated motion to the drive's speed and angle up to order n."""
    place, degree, start = page(m, state, int(m[at.DRIVE_TABLE]))
    own = w[at.SCRATCH]
    shifted(m, place, degree, state[at.TIME] - start, own)
    for k in range(min(degree, n) + 1):
        w[at.THETA1, k] += own[k]
        if k > 0:
            w[at.OMEGA1, k - 1] += k * own[k]


@inner
def tabled(m, state, n, w):
    """Write the contribution of the flanks' tables over the drive's angle, both flanks, up to order n."""
    if m[at.FLANK_TABLE] < 0.0:
        return
    angle, own = w[at.THETA1], w[at.SCRATCH]
    for flank in range(2):
        place, degree, start = page(m, state, int(m[at.FLANK_TABLE + flank]))
        shifted(m, place, degree, angle[0] - start, own)
        out = w[at.TABLED + flank]
        for k in range(n + 1):
            out[k] = 0.0
        out[0] = own[degree]
        for j in range(degree - 1, -1, -1):
            for k in range(n, 0, -1):
                total = 0.0
                for i in range(1, k + 1):
                    total += angle[i] * out[k - i]
                out[k] = total
            out[0] = own[j]

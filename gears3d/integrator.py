"""The integrator of compliant contact: Dormand and Prince's pair of order 8 with dense output, for any law of motion.

A step keeps the rates that it evaluates, so that dense output of order 7 costs three more calls, and only in steps with
an event. Events are roots of functions of the state, found on the dense output.

Source: Hairer, Norsett & Wanner 1993, Solving Ordinary Differential Equations I, section II.10: DOP853.
"""

from __future__ import annotations

from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from gears3d import kernels

inner: Any = partial(kernels.inner, error_model="numpy", _nrt=False)  # makes no arrays, counts no references

STAGES, END = 16, 12  # rates that are kept; those after END serve dense output alone
MOST = 6.0  # largest growth of a step
DENSE = 7  # coefficients of dense output
SHORTEST = 1e-15  # shorter steps make no progress [s]
EXACT = 1e-11  # part of a step to which events are located
NEVER = 1.0  # value of an event that cannot happen
LOOKS = 8  # parts of a step at whose ends events are looked for where they may come and go within it

# Nodes: places in a step at which the rates are evaluated.
C = np.array([
    0.0, 0.05260015195876773, 0.0789002279381516, 0.1183503419072274, 0.2816496580927726, 0.3333333333333333,
    0.25, 0.3076923076923077, 0.6512820512820513, 0.6, 0.8571428571428571, 1.0, 1.0, 0.1, 0.2, 0.7777777777777778,
])  # fmt: skip
_SPARSE = (
    (1, (0,), (0.05260015195876773,)),
    (2, (0, 1,), (0.0197250569845379, 0.0591751709536137,)),
    (3, (0, 2,), (0.02958758547680685, 0.08876275643042054,)),
    (4, (0, 2, 3,), (0.2413651341592667, -0.8845494793282861, 0.924834003261792,)),
    (5, (0, 3, 4,), (0.037037037037037035, 0.17082860872947386, 0.12546768756682242,)),
    (6, (0, 3, 4, 5,), (0.037109375, 0.17025221101954405, 0.06021653898045596, -0.017578125,)),
    (7, (0, 3, 4, 5, 6,), (0.03709200011850479, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
    0.008273789163814023,)),
    (8, (0, 3, 4, 5, 6, 7,), (0.6241109587160757, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
    20.154067550477894, -43.48988418106996,)),
    (9, (0, 3, 4, 5, 6, 7, 8,), (0.47766253643826434, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
    15.279233632882423, -33.28821096898486, -0.020331201708508627,)),
    (10, (0, 3, 4, 5, 6, 7, 8, 9,), (-0.9371424300859873, 5.186372428844064, 1.0914373489967295,
    -8.149787010746927, -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196,)),
    (11, (0, 3, 4, 5, 6, 7, 8, 9, 10,), (2.273310147516538, -10.53449546673725, -2.0008720582248625,
    -17.9589318631188, 27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303,
    0.6433927460157636,)),
    (12, (0, 5, 6, 7, 8, 9, 10, 11,), (0.054293734116568765, 4.450312892752409, 1.8915178993145003,
    -5.801203960010585, 0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,)),
    (13, (0, 6, 7, 8, 9, 10, 11, 12,), (0.056167502283047954, 0.25350021021662483, -0.2462390374708025,
    -0.12419142326381637, 0.15329179827876568, 0.00820105229563469, 0.007567897660545699, -0.008298,)),
    (14, (0, 5, 6, 7, 10, 11, 12, 13,), (0.03183464816350214, 0.028300909672366776, 0.053541988307438566,
    -0.05492374857139099, -0.00010834732869724932, 0.0003825710908356584, -0.00034046500868740456,
    0.1413124436746325,)),
    (15, (0, 5, 6, 7, 8, 12, 13, 14,), (-0.42889630158379194, -4.697621415361164, 7.683421196062599,
    4.06898981839711, 0.3567271874552811, -0.0013990241651590145, 2.9475147891527724, -9.15095847217987,)),
)  # fmt: skip
A = np.zeros((STAGES, STAGES))  # Runge-Kutta matrix, stage by stage; the row END gives the result
for _stage, _places, _parts in _SPARSE:
    A[_stage, list(_places)] = _parts
# Weights of the error estimates of orders 5 and 3.
E = np.array([
    [0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294],
    [-0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082],
])  # fmt: skip
# Weights of dense output.
D = np.array([
    [-8.428938276109013, 0.0, 0.0, 0.0, 0.0, 0.5667149535193777, -3.0689499459498917, 2.38466765651207,
    2.117034582445028, -0.871391583777973, 2.2404374302607883, 0.6315787787694688, -0.08899033645133331,
    18.148505520854727, -9.194632392478356, -4.436036387594894],
    [10.427508642579134, 0.0, 0.0, 0.0, 0.0, 242.28349177525817, 165.20045171727028, -374.5467547226902,
    -22.113666853125306, 7.733432668472264, -30.674084731089398, -9.332130526430229, 15.697238121770845,
    -31.139403219565178, -9.35292435884448, 35.81684148639408],
    [19.985053242002433, 0.0, 0.0, 0.0, 0.0, -387.0373087493518, -189.17813819516758, 527.8081592054236,
    -11.57390253995963, 6.8812326946963, -1.0006050966910838, 0.7777137798053443, -2.778205752353508,
    -60.19669523126412, 84.32040550667716, 11.99229113618279],
    [-25.69393346270375, 0.0, 0.0, 0.0, 0.0, -154.18974869023643, -231.5293791760455, 357.6391179106141,
    93.40532418362432, -37.45832313645163, 104.0996495089623, 29.8402934266605, -43.53345659001114,
    96.32455395918828, -39.17726167561544, -149.72683625798564],
])  # fmt: skip


def integrator(rates: Any) -> tuple[Any, Any]:
    """Return a step of the integrator for a law of motion, and its dense output, to be called from compiled code.

    ``rates(given, time, state, out)`` is compiled and writes the rates of the state. ``attempt(given, t, y, h, k, end,
    motions)`` tries a step ``h`` from the time ``t`` and the state ``y`` (n,). The first row of ``k`` (STAGES, n) holds
    the rates there; ``end`` (n,) becomes the state at the end, whose rates the caller writes into the row END.
    ``open_up(given, t, y, h, k, end, dense, between, motions)`` then fills ``dense`` (DENSE, n); ``between`` (n,) is
    scratch. The state is ``motions`` numbers, places and their rates in pairs, and after them integrals on which
    nothing depends.
    """

    @inner
    def stage(y, h, k, i, end, motions):
        for c in range(0, motions, 2):
            place = rate = 0.0
            for j in range(i):
                place += A[i, j] * k[j, c]
                rate += A[i, j] * k[j, c + 1]
            end[c], end[c + 1] = y[c] + h * place, y[c + 1] + h * rate

    @inner
    def attempt(given, t, y, h, k, end, motions):
        for i in range(1, END):
            stage(y, h, k, i, end, motions)
            rates(given, t + C[i] * h, end, k[i])
        stage(y, h, k, END, end, motions)
        for c in range(motions, y.shape[0]):
            total = 0.0
            for j in range(END):
                total += A[END, j] * k[j, c]
            end[c] = y[c] + h * total

    @inner
    def open_up(given, t, y, h, k, end, dense, between, motions):
        for i in range(END + 1, STAGES):
            stage(y, h, k, i, between, motions)
            rates(given, t + C[i] * h, between, k[i])
        for c in range(y.shape[0]):
            change = end[c] - y[c]
            dense[0, c] = change
            dense[1, c] = h * k[0, c] - change
            dense[2, c] = 2.0 * change - h * (k[END, c] + k[0, c])
            for i in range(4):
                total = 0.0
                for j in range(STAGES):
                    total += D[i, j] * k[j, c]
                dense[3 + i, c] = h * total

    return attempt, open_up


@inner
def off(k, h, c):
    """Return the error of component ``c`` of the state at the end of a step."""
    fifth = third = 0.0
    for j in range(END):
        fifth += E[0, j] * k[j, c]
        third += E[1, j] * k[j, c]
    both = sqrt(fifth * fifth + 0.01 * third * third)
    return h * fifth * fifth / both if both > 0.0 else 0.0


@inner
def judge(h, error, before, root_before):
    """Return whether a step is accepted, the next one, and the eighth root of the error in parts of the tolerance.

    The trend of two steps, of which the last are ``before`` and ``root_before``, is extrapolated (Gustafsson 1994), as
    a gap that shrinks step by step requires.
    """
    root = max(sqrt(sqrt(sqrt(error))), 0.01)
    if not error <= 1.0:
        return h <= SHORTEST, h * max(0.9 / root, 0.2) if error < 1e30 else 0.1 * h, root
    factor = 0.9 / root
    if before > 0.0:
        factor = min(factor, factor * h / before * root_before / root)
    return True, h * min(max(factor, 0.2), MOST), root


@inner
def inside(y, dense, x, c):
    """Return component ``c`` of the state at the part ``x`` of a step."""
    total, rest = 0.0, 1.0 - x
    for i in range(DENSE - 1, -1, -1):
        total = (total + dense[i, c]) * (x if i % 2 == 0 else rest)
    return y[c] + total


def locator(outlook: Any) -> Any:
    """Return a function that finds the first event of a step, to be called from compiled code.

    ``outlook(given, time, state, values, rates)`` is compiled and writes functions of which one falls below zero at an
    event. ``first(given, t, y, h, wavers, dense, point, g, values, spare, held)`` returns the event and the part of the
    step after which it happens, or -1 and 1. ``g`` has the functions at the start, ``values`` those at the end, and
    then at every part that no event is known to precede; ``wavers`` states whether one may come and go within the step,
    ``held`` which ones have just happened; ``point`` (n,) and ``spare`` are scratch.
    """

    @inner
    def at(given, t, y, h, dense, point, values, x):
        for c in range(y.shape[0]):
            point[c] = inside(y, dense, x, c)
        outlook(given, t + x * h, point, values, dense[DENSE])
        return values

    @inner
    def root(given, t, y, h, dense, point, spare, which, low, begin, high, last):
        before, side = low, 0  # the method of Illinois
        for _ in range(100):
            part = (begin * high - last * low) / (begin - last)
            if not low < part < high:
                part = 0.5 * (low + high)
            if abs(part - before) <= EXACT:
                return part
            before, value = part, at(given, t, y, h, dense, point, spare, part)[which]
            if value < 0.0:
                high, last = part, value
                begin = 0.5 * begin if side == -1 else begin
                side = -1
            else:
                low, begin = part, value
                last = 0.5 * last if side == 1 else last
                side = 1
        return high

    @inner
    def first(given, t, y, h, wavers, dense, point, g, values, spare, held):
        found, x, n = -1, 1.0, g.shape[0]
        for j in range(1, LOOKS if wavers else 0):
            at(given, t, y, h, dense, point, spare, j / LOOKS)
            low = 1.0
            for i in range(n):
                low = min(low, spare[i] if g[i] > 0.0 else 1.0)
            if low < 0.0:
                x = j / LOOKS
                for i in range(n):
                    values[i] = spare[i]
                break
        for _ in range(4 * n):
            which = 0
            while which < n and (values[which] >= 0.0 or which == found):
                which += 1
            if which == n:
                break
            low, begin = 0.0, g[which]
            for j in range(1, LOOKS if begin <= 0.0 else 0):
                low, begin = j / LOOKS * x, at(given, t, y, h, dense, point, spare, j / LOOKS * x)[which]
                if begin > 0.0:
                    break
            if begin > 0.0:
                found, x = which, root(given, t, y, h, dense, point, spare, which, low, begin, x, values[which])
                at(given, t, y, h, dense, point, values, x)
            elif held[which] == 0:
                return which, 0.0
            else:
                values[which] = NEVER
        return found, x

    return first

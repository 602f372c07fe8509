"""Free motion between perfect flanks in closed form: dry friction alone, one harmonic of the drive's speed.

The gap between the loose gear and the flank it left is, with x = ω·τ the phase since then,

    g(τ) = g(0) + v·τ ∓ [a·τ²/2 + (Rb1·A/ω)·(cos ψ·(1 − cos x) − sin ψ·(x − sin x))]

with a = Rb2·T/J; Rigaud & Perret-Liaudet 2020, eqs (12)-(14). On a flank the loose gear follows the drive.

A series of bounces on one flank is followed in registers: a bounce is taken only where it is proved to be concave up to
its root, which is then the only one, and where the other flank is out of reach.

In a free flight the relative acceleration changes its sign at two phases of the drive's period. Between two such phases
the gap's rate is monotonic: it has one zero at most, and the gap is monotonic before and after it. So every root of the
gap to either flank is bracketed, and the first one is found.

Sustained contact is lost where J·ω·A·(Rb1/Rb2)·cos ψ = −T. Dry friction changes its sign where the drive reverses.

The run needs no power series and is small: the code for most scenarios compiles in seconds.

Source: Rigaud & Perret-Liaudet 2020, eqs (12)-(14), (17)-(19).
"""

from __future__ import annotations

from math import acos, asin, cos, inf, isfinite, pi, sin

from gears3d.lumped import layout as at
from gears3d.lumped.compile import borrowed, entry, inner
from gears3d.lumped.law import LEAST, TOUCH, restitution, thrust

BESIDE = 1e-9  # phases that differ by less are equal [rad]
WIDEST = 0.7  # largest phase of a bounce [rad]
PATIENCE = 20_000  # A run is given up after so many successive steps whose mean is SHORTEST or less
SHORTEST = 1e-12  # mean length of a step without progress [s]


@inner
def fly(v, pull, size, omega, c0, s0, tau):
    """Return the changes of the gap, its rate and acceleration in flight; ``pull``, ``size`` = ±Rb1·A: flank's sign."""
    x = omega * tau
    if x < 0.7:  # nine terms are exact to rounding, without cancellation
        z = x * x
        versine = z * (1 / 2 - z * (1 / 24 - z * (1 / 720 - z * (1 / 40320 - z * (1 / 3628800 - z / 479001600)))))
        lag = 1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880 - z * (1 / 39916800 - z / 6227020800))))
        lag *= x * z
        sine = x - lag
    else:
        half, sine = sin(0.5 * x), sin(x)
        versine, lag = 2.0 * half * half, x - sine
    gap = v * tau - (0.5 * pull * tau * tau + size / omega * (c0 * versine - s0 * lag))
    rate = v - (pull * tau + size * (c0 * sine - s0 * versine))
    return gap, rate, -(pull + size * omega * (c0 * (1.0 - versine) - s0 * sine))


@inner
def place(m, state, t, flank, gap, rate, speed, height):
    """Put the state at time t to a gap before a flank, whose bits are kept."""
    amplitude, omega = m[at.HARMONICS], m[at.HARMONICS + 1]
    psi = omega * t + m[at.HARMONICS + 2]
    theta = m[at.MEAN] * t - amplitude / omega * (cos(psi) - m[at.HARMONICS + 3])
    beyond = m[at.BACKLASH] - gap
    displacement = gap if flank == 0 else beyond
    state[at.TIME], state[at.DISPLACEMENT] = t, displacement
    state[at.ANGLE] = (displacement + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
    state[at.SPEED], state[at.DRIVE_SPEED] = speed, m[at.MEAN] + amplitude * sin(psi)
    state[at.GAPS + flank], state[at.RATES + flank] = gap, rate
    state[at.GAPS + 1 - flank], state[at.RATES + 1 - flank] = beyond, -rate
    state[at.HEIGHT], state[at.LIFT] = height, -1.0


@inner
def sample(m, state, count, samples, spacing, end):
    """Take the samples of the step that begins with the state and ends at a time."""
    i, last = count[at.N_SAMPLES], end * (1.0 + 1e-15)  # the last sample's time may be rounded up
    if i >= samples.shape[0] or i * spacing > last:
        return
    amplitude, omega, begin = m[at.HARMONICS], m[at.HARMONICS + 1], state[at.TIME]
    psi, brake, v, start = omega * begin + m[at.HARMONICS + 2], m[at.BASE] * state[at.SIGN] / m[at.INERTIA], 0.0, 0.0
    flies = state[at.MODE] < at.STUCK
    flank = int(state[at.DEPARTED] if flies else state[at.MODE] - at.STUCK)
    if flies:
        v, start = state[at.RATES + flank], state[at.GAPS + flank]
    side = 1.0 - 2.0 * flank
    pull, size = side * m[at.RADIUS_LOOSE] * brake, side * m[at.RADIUS_DRIVE] * amplitude
    c0, s0 = cos(psi), sin(psi)
    while i < samples.shape[0] and i * spacing <= last:
        time = i * spacing
        psi = omega * time + m[at.HARMONICS + 2]
        drive, since = m[at.MEAN] + amplitude * sin(psi), min(max(time - begin, 0.0), end - begin)
        theta = m[at.MEAN] * time - amplitude / omega * (cos(psi) - m[at.HARMONICS + 3])
        gap, rate, speed = start, 0.0, m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE] * drive
        if flies:
            way, rate, _ = fly(v, pull, size, omega, c0, s0, since)
            gap, speed = start + way, state[at.SPEED] - brake * since
        displacement = gap if flank == 0 else m[at.BACKLASH] - gap
        row = samples[i]
        row[0], row[1] = time, theta
        row[2] = (displacement + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
        row[3], row[4] = drive, speed
        row[5], row[6] = displacement, side * rate
        i += 1
    count[at.N_SAMPLES] = i


@inner
def sense(x):
    """Return the sign of a number, 0 of zero."""
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


@inner
def pressing(m, t, flank, slides):
    """Return a flank's torque on the gear in contact with it, and the direction that dry friction resists.

    Rigaud & Perret-Liaudet 2020, eqs (17), (18). The direction is that of the motion just after t, 0 at lasting rest.
    The torques are those of contact, or of flight where ``slides`` is 1.
    """
    ratio, amplitude = m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE], m[at.HARMONICS]
    psi = m[at.HARMONICS + 1] * t + m[at.HARMONICS + 2]
    rise, swing = amplitude * m[at.HARMONICS + 1] * cos(psi), amplitude * sin(psi)
    way = m[at.MEAN] + swing
    if abs(ratio * way) <= m[at.REST] * (1.0 + 1e-2 * m[at.RATE] * t):
        way = rise if rise != 0.0 else -swing
    sign = sense(way)
    dry = m[at.BASE] if slides == 1.0 else m[at.BASE + 3 * (1 + flank)]
    return (1.0 - 2.0 * flank) * (m[at.INERTIA] * ratio * rise + dry * sign), sign


@inner
def let_go(m, state):
    """Find the direction that dry friction resists: that of the speed, or 0 where it keeps the gear at rest."""
    if abs(state[at.SPEED]) <= m[at.REST]:
        state[at.SPEED] = 0.0
    state[at.SIGN] = sense(state[at.SPEED])
    if m[at.BASE] < 0.0 and state[at.SIGN] == 0.0:
        state[at.SIGN] = 1.0


@inner
def separate(m, state, flank, lift):
    """Begin a free flight from a flank; ``lift`` is that flank where contact is lost without an impact, else -1."""
    state[at.MODE], state[at.DEPARTED], state[at.LIFT] = at.FREE, flank, lift
    state[at.HEIGHT] = state[at.SLIDE] = 0.0
    let_go(m, state)


@inner
def set_on_flank(m, state, flank, rebound, hold):
    """Put the gear on a flank: with a rebound, or in permanent contact for a time ``hold`` >= 0 at least."""
    pace = (1.0 - 2.0 * flank) * rebound + m[at.RADIUS_DRIVE] * state[at.DRIVE_SPEED]
    state[at.SPEED] = pace / m[at.RADIUS_LOOSE]
    state[at.RATES + flank], state[at.RATES + 1 - flank] = rebound, -rebound
    if hold < 0.0:
        separate(m, state, flank, -1.0)
    else:
        state[at.MODE], state[at.SLIDE], state[at.HOLD] = at.STUCK + flank, 0.0, hold
        state[at.CONTACT_SINCE] = state[at.TIME]


@inner
def impact(m, state, count, impacts, flank):
    """Newton's law on the flanks' relative velocity, v⁺ = −e·v⁻; Kadmiri et al. 2012, eqs (19), (20), (27)."""
    side, hold = 1.0 - 2.0 * flank, -1.0
    speed, before, t, height = max(-state[at.RATES + flank], 0.0), state[at.SPEED], state[at.TIME], state[at.HEIGHT]
    rebound = restitution(m, flank, speed, count[at.TOTAL]) * speed
    count[at.STALL] = count[at.STALL] + 1 if t <= state[at.LAST_IMPACT] else 0
    state[at.LAST_IMPACT] = t
    if rebound < max(m[at.STICK_VELOCITY], LEAST) or count[at.STALL] > 100:
        gated = m[at.GATED + flank]
        for slides in range(2):
            if slides <= gated and pressing(m, t, flank, float(slides))[0] > 0.0:
                hold = 0.0
    if hold == 0.0:
        count[at.ZENO] += rebound > m[at.STICK_VELOCITY]
        count[at.CONTACTS] += 1
        rebound = 0.0
    else:
        count[at.BOUNCES] += 1
    set_on_flank(m, state, flank, rebound, hold)
    if speed <= TOUCH:
        count[at.GRAZING] += 1
        return
    push = thrust(m, side, sense(before if before != 0.0 else state[at.SPEED]))
    row = impacts[count[at.N_IMPACTS]]
    row[0], row[1] = t, flank
    row[2], row[3] = -side * speed, side * rebound
    row[4] = side * m[at.INERTIA] * abs((state[at.SPEED] - before) * push)
    row[5], row[6] = state[at.DISPLACEMENT], height
    count[at.N_IMPACTS] += 1
    count[at.TOTAL] += 1


@inner
def begin(m, state):
    """Put the state on its flank, or into the middle of the backlash, at time 0."""
    start = state[at.DEPARTED]
    flank = 1 if start == 1.0 else 0
    place(m, state, 0.0, flank, 0.5 * m[at.BACKLASH] if start == 2.0 else 0.0, 0.0, 0.0, 0.0)
    state[at.LAST_IMPACT], state[at.GUESS] = -inf, inf
    held = start < 2.0 and pressing(m, 0.0, flank, 0.0)[0] > 0.0
    held = held or (start < 2.0 and m[at.GATED + flank] > 0.0 and pressing(m, 0.0, flank, 1.0)[0] > 0.0)
    set_on_flank(m, state, flank, 0.0, 0.0 if held else -1.0)
    if start < 2.0:
        state[at.LIFT] = -1.0 if held else float(flank)


@inner
def _when(v, pull, size, omega, c0, s0, goal, order, low, high, tau):
    """Return when the gap is ``goal``, or its rate where ``order`` is 1, between two times: Newton, bracketed."""
    gap, rate, bend = fly(v, pull, size, omega, c0, s0, high)
    rises = (rate if order == 1.0 else gap) > goal
    exact = 1e-12 if order == 1.0 else 1e-15
    for _ in range(80):
        gap, rate, bend = fly(v, pull, size, omega, c0, s0, tau)
        off, slope = gap - goal, rate
        if order == 1.0:
            off, slope = rate - goal, bend
        if (off > 0.0) == rises:
            high = tau
        else:
            low = tau
        step = -off / slope if slope != 0.0 else inf
        if not low <= tau + step <= high:
            step = 0.5 * (low + high) - tau
        tau += step
        if abs(step) <= exact * tau:
            break
    return tau


@inner
def follow_flight(m, state, count, impacts, samples, spacing, end):
    """Follow the free flight to the next contact, the loose gear's standstill, or the end."""
    flank, t, sign, speed = int(state[at.DEPARTED]), state[at.TIME], state[at.SIGN], state[at.SPEED]
    side, omega, start, v = 1.0 - 2.0 * flank, m[at.HARMONICS + 1], state[at.GAPS + flank], state[at.RATES + flank]
    size, brake = side * m[at.RADIUS_DRIVE] * m[at.HARMONICS], m[at.BASE] * sign / m[at.INERTIA]
    pull, push, psi = side * m[at.RADIUS_LOOSE] * brake, size * omega, omega * t + m[at.HARMONICS + 2]
    c0, s0 = cos(psi), sin(psi)
    low, high, height = -start, m[at.BACKLASH] - start, max(state[at.HEIGHT], start)
    until, stops, meets, crosses = end - t, False, False, high <= 0.0 and v > 0.0
    if brake * sign > 0.0 and speed / brake < until:
        until, stops = speed / brake, True
    parts = v
    if v == 0.0:  # just after separation the acceleration is rounding
        parts = -(pull + push * c0)
        if state[at.LIFT] >= 0.0 and 0.5 * abs(parts) < m[at.UNFELT] * (1.0 + 1e-3 * m[at.RATE] * t):
            parts = push * s0
    meets = start <= 0.0 and parts < 0.0
    turn = acos(-pull / push) if abs(pull) < abs(push) else pi
    tau, begun, gap, rate = 0.0, 0.0, 0.0, v
    while not meets and not crosses and begun < until:
        # up to the next of the phases where the acceleration changes its sign
        behind = (psi + omega * begun + BESIDE) % (2.0 * pi)
        ahead = turn if behind < turn else 2.0 * pi - turn if behind < 2.0 * pi - turn else 2.0 * pi + turn
        finish = min(begun + (ahead - behind + BESIDE) / omega, until)
        for part in range(2):  # up to where the rate changes sign, and after it
            before, tau = gap, finish
            gap, after, _ = fly(v, pull, size, omega, c0, s0, finish)
            if part == 0 and rate * after < 0.0:
                tau = _when(v, pull, size, omega, c0, s0, 0.0, 1.0, begun, finish, 0.5 * (begun + finish))
                gap, after, _ = fly(v, pull, size, omega, c0, s0, tau)
            meets, crosses = gap < low, gap > high
            if meets or crosses:
                goal = low if meets else high
                guess = begun + (tau - begun) * (goal - before) / (gap - before)
                tau = _when(v, pull, size, omega, c0, s0, goal, 0.0, begun, tau, guess)
                break
            height, begun, rate = max(height, start + gap), tau, after
            if tau == finish:
                break
    now = t + tau if stops or meets or crosses else end
    gap, rate, _ = fly(v, pull, size, omega, c0, s0, tau)
    sample(m, state, count, samples, spacing, now)
    gap, speed = start + gap, speed - brake * tau
    if crosses:
        flank, rate, height = 1 - flank, -rate, m[at.BACKLASH]
    if meets or crosses:
        place(m, state, now, flank, 0.0, rate, speed, height)
        if tau == 0.0 and rate > -TOUCH:
            count[at.GRAZING] += 1
            set_on_flank(m, state, flank, 0.0, 1e-6 / m[at.RATE])
        else:
            impact(m, state, count, impacts, flank)
    else:
        place(m, state, now, flank, gap, rate, 0.0 if stops else speed, height)
        if stops:
            let_go(m, state)


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


@inner
def follow_bounces(m, state, count, impacts, samples, spacing, end):
    """Follow bounces on one flank until one is not proved; True when at least one was done."""
    flank = int(state[at.DEPARTED])
    if state[at.SIGN] == 0.0 or state[at.GAPS + flank] != 0.0 or not state[at.RATES + flank] > 0.0:
        return False
    side, omega = 1.0 - 2.0 * flank, m[at.HARMONICS + 1]
    size, brake = side * m[at.RADIUS_DRIVE] * m[at.HARMONICS], m[at.BASE] * state[at.SIGN] / m[at.INERTIA]
    pull, jerk = side * m[at.RADIUS_LOOSE] * brake, abs(size) * omega * omega
    push = m[at.INERTIA] / m[at.RADIUS_LOOSE] * thrust(m, side, state[at.SIGN])
    place_of, stick = flank * m[at.BACKLASH], max(m[at.STICK_VELOCITY], LEAST)
    t, v, speed = state[at.TIME], state[at.RATES + flank], state[at.SPEED]
    done, first, sticks = 0, count[at.N_IMPACTS], False
    while first + done < impacts.shape[0]:
        psi = omega * t + m[at.HARMONICS + 2]
        c0, s0 = cos(psi), sin(psi)
        start = pull + size * omega * c0
        if start <= 0.0:
            break
        longest = 2.5 * v / start
        if omega * longest > WIDEST or jerk * longest > 0.2 * start or t + longest >= end:
            break
        if v * v >= 1.6 * start * m[at.BACKLASH] or abs(brake) * longest >= 0.5 * speed * state[at.SIGN]:
            break
        # the landing: Halley's method on gap/τ from the cubic's root
        tau = 2.0 * v / (start - size * omega * omega * s0 * 2.0 * v / (3.0 * start))
        rate = 0.0
        for _ in range(20):
            gap, rate, bend = fly(v, pull, size, omega, c0, s0, tau)
            inverse = 1.0 / tau
            q = gap * inverse
            q1 = (rate - q) * inverse
            q2 = (bend - 2.0 * q1) * inverse
            step = -2.0 * q * q1 / (2.0 * q1 * q1 - q * q2)
            rate += bend * step
            tau += step
            if abs(step) <= 1e-6 * tau:
                break
        # the highest point, from where a cubic has its own
        top, height = v / (start - 0.5 * size * omega * omega * s0 * v / start), 0.0
        for _ in range(20):
            gap, climb, bend = fly(v, pull, size, omega, c0, s0, top)
            step = -climb / bend
            height = gap + 0.5 * climb * step
            if abs(step) <= 1e-2 * top:
                break
            top += step
        state[at.TIME], state[at.RATES + flank], state[at.SPEED] = t, v, speed
        sample(m, state, count, samples, spacing, t + tau)
        t += tau
        speed -= brake * tau
        rebound = -restitution(m, flank, -rate, count[at.TOTAL]) * rate
        if rebound < stick:
            place(m, state, t, flank, 0.0, rate, speed, height)
            sticks = True
            break
        change = rebound - rate
        row = impacts[first + done]
        row[0], row[1] = t, flank
        row[2], row[3] = side * rate, side * rebound
        row[4], row[5], row[6] = change * push, place_of, height
        speed += side * change / m[at.RADIUS_LOOSE]
        v = rebound
        done += 1
        count[at.TOTAL] += 1
    count[at.N_IMPACTS] += done
    count[at.BOUNCES] += done
    count[at.STEPS] += done
    if sticks:
        impact(m, state, count, impacts, flank)
    elif done:
        place(m, state, t, flank, 0.0, v, speed, 0.0)
        state[at.LAST_IMPACT] = t
        let_go(m, state)
    return sticks or done > 0


@entry
def advance(m, state, count, impacts, contacts, samples, spacing, end):
    """Advance the state as :func:`gears3d.lumped.kernel.advance` does, with samples ``spacing`` [s] apart."""
    m, state, count = borrowed(m), borrowed(state), borrowed(count)
    impacts, contacts, samples = borrowed(impacts), borrowed(contacts), borrowed(samples)
    if state[at.MODE] == at.BEFORE:
        begin(m, state)
    while state[at.TIME] < end:
        if count[at.N_IMPACTS] >= impacts.shape[0]:
            return at.IMPACTS_FULL
        if count[at.N_CONTACTS] >= contacts.shape[0]:
            return at.CONTACTS_FULL
        if state[at.MODE] >= at.STUCK:
            follow_contact(m, state, count, contacts, samples, spacing, end)
        elif not follow_bounces(m, state, count, impacts, samples, spacing, end):
            follow_flight(m, state, count, impacts, samples, spacing, end)
        count[at.STEPS] += 1
        if not (isfinite(state[at.DISPLACEMENT]) and isfinite(state[at.SPEED])):
            return at.BROKEN
        count[at.IDLE] += 1
        if count[at.IDLE] == PATIENCE:
            if state[at.TIME] - state[at.MARK] < PATIENCE * SHORTEST:
                return at.STANDSTILL
            count[at.IDLE], state[at.MARK] = 0, state[at.TIME]
    return at.DONE

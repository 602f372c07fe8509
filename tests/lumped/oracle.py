"""The same model written a second time, on scipy's solve_ivp restarted at every event: slow, plain, independent."""

from dataclasses import dataclass, field
from math import cos, pi, sin

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

RPM = pi / 30


@dataclass
class Oracle:
    amplitude: float
    frequency: float
    e: float
    backlash: float = 250e-6
    mean: float = 30 * RPM
    rb1: float = 0.148
    rb2: float = 0.148
    inertia: float = 0.0695
    drag: float = 0.22
    stick: float = 1e-4
    viscous: float = 0.0
    slope: float = 0.0
    deviations: list = field(default_factory=list)  # (gear, flank, order, amplitude, phase), as in FLANK_HARMONIC

    def omega(self, t):
        return self.mean + self.amplitude * sin(2 * pi * self.frequency * t)

    def omega_dot(self, t):
        return self.amplitude * 2 * pi * self.frequency * cos(2 * pi * self.frequency * t)

    def theta(self, t):
        w = 2 * pi * self.frequency
        return self.mean * t - self.amplitude / w * (cos(w * t) - 1)

    def deviation(self, gear, flank, angle, derivative=0):
        total = 0.0
        for g, f, order, amplitude, phase in self.deviations:
            if (g, f) == (gear, flank):
                total += amplitude * order**derivative * cos(order * angle + phase + derivative * pi / 2)
        return total

    def both(self, flank, t, s):
        return self.deviation(0, flank, self.theta(t)) + self.deviation(1, flank, self.loose(t, s))

    def loose(self, t, s):
        return (s + self.rb1 * self.theta(t)) / self.rb2

    def gap(self, flank, t, s):
        return s - self.both(0, t, s) if flank == 0 else self.backlash - self.both(1, t, s) - s

    def gap_rate(self, flank, t, s, v):
        w1 = self.omega(t)
        w2 = (v + self.rb1 * w1) / self.rb2
        moving = self.deviation(0, flank, self.theta(t), 1) * w1 + self.deviation(1, flank, self.loose(t, s), 1) * w2
        return v - moving if flank == 0 else -v - moving

    def velocity_for(self, flank, t, s, rate):
        zero = self.gap_rate(flank, t, s, 0.0)
        return (rate - zero) / (self.gap_rate(flank, t, s, 1.0) - zero)

    def torque(self, w):
        return self.drag * np.sign(w) + self.viscous * w

    def right(self, t, y):
        w2 = (y[1] + self.rb1 * self.omega(t)) / self.rb2
        return [y[1], -self.rb2 * self.torque(w2) / self.inertia - self.rb1 * self.omega_dot(t)]

    def place(self, flank, t):
        s = 0.0
        for _ in range(60):
            s = self.both(0, t, s) if flank == 0 else self.backlash - self.both(1, t, s)
        return s

    def reaction(self, flank, t):
        """Force of the flank [N], positive while it pushes."""
        s = self.place(flank, t)
        th1, th2, w1 = self.theta(t), self.loose(t, s), self.omega(t)
        side = 1 if flank == 0 else -1
        p1, p2 = side * self.deviation(0, flank, th1, 1), side * self.deviation(1, flank, th2, 1)
        q1, q2 = side * self.deviation(0, flank, th1, 2), side * self.deviation(1, flank, th2, 2)
        w2 = (self.rb1 + p1) * w1 / (self.rb2 - p2)
        acceleration = ((self.rb1 + p1) * self.omega_dot(t) + q1 * w1**2 + q2 * w2**2) / (self.rb2 - p2)
        return side * (self.inertia * acceleration + self.torque(w2)) / self.rb2

    def lift_off(self, flank, t, end):
        step = 1 / self.frequency / 400
        orders = [abs(d[2]) for d in self.deviations]
        step /= max([1, *orders])
        while t < end:
            if self.reaction(flank, t + step) < 0:
                return brentq(lambda x: self.reaction(flank, x), t, t + step, xtol=1e-16, rtol=1e-15)
            t += step
        return end

    def fly(self, t, s, v, end, departed):
        """Until the next impact: (flank, t, s, v), or None at the end."""
        rate, pull = self.gap_rate(departed, t, s, v), abs(self.right(t, [s, v])[1]) + 1e-9
        while t < end:
            events = [lambda t, y, f=f: self.gap(f, t, y[0]) for f in (0, 1)]
            for event in events:
                event.terminal, event.direction = True, -1
            longest = min(1 / self.frequency / 100, max(0.4 * rate / pull, 1e-5))
            until = min(end, t + 50 * longest)
            if departed is not None and rate <= 0.0:  # a lift-off: the first moments by themselves
                events, until = [], min(end, t + 1e-4)
            done = solve_ivp(
                self.right, (t, until), [s, v], method="DOP853", rtol=1e-13, atol=[1e-19, 1e-16],
                events=events or None, max_step=longest,
            )  # fmt: skip
            t, (s, v) = done.t[-1], done.y[:, -1]
            if events and done.status == 1:
                return int(not done.t_events[0].size), t, s, v
            departed = None
        return None

    def run(self, end):
        """Impacts as rows (time, flank, velocity, rebound) from rest on the active flank."""
        impacts, t, flank = [], self.lift_off(0, 0.0, end), 0
        s = self.place(0, t)
        v = self.velocity_for(0, t, s, 0.0)
        while t < end:
            hit = self.fly(t, s, v, end, flank)
            if hit is None:
                break
            flank, t, s, v = hit
            side = 1 if flank == 0 else -1
            speed = -self.gap_rate(flank, t, s, v)
            rebound = min(max(self.e + self.slope * speed, 0), 1) * speed
            s = self.place(flank, t)
            stuck = rebound < self.stick and self.reaction(flank, t) > 0
            impacts.append((t, flank, -side * speed, 0.0 if stuck else side * rebound))
            if stuck:
                t, rebound = self.lift_off(flank, t, end), 0.0
                s = self.place(flank, t)
            v = self.velocity_for(flank, t, s, rebound)
        return np.array(impacts)

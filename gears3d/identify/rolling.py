"""Both flanks of a pair from its contact: orders found on either, fitted on each, with intervals."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd, pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.identify.contact import Contact, Contacts
from gears3d.identify.law import Parameter
from gears3d.identify.orders import LEVEL, Fit, Line, Lines, Solved, find, fit, lines_of, solve
from gears3d.identify.rattle_flanks import rattle_flanks
from gears3d.signals.orders import GEARS

CLOSE = 0.02  # Part of the amplitude that the closed form, which is one of first order, may leave over


@dataclass(frozen=True)
class Axis:
    """An offset axis that explains order 1 of both flanks."""

    gear: str  # whose teeth are eccentric
    offset: float  # [m]
    phase: float  # as the effect ``eccentricity`` has it [rad]
    rest: float  # what it leaves over, as a part of the amplitude

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {"gear": self.gear, "offset_m": self.offset, "phase_rad": self.phase, "rest": self.rest}

    def comment(self) -> str:
        """Return the effect as comments in TOML."""
        what = f"in place of order 1 of the {self.gear} gear on both flanks (leaves {self.rest:.1%} over):"
        size = f'kind = "eccentricity", gear = "{self.gear}", offset = "{1e6 * self.offset:.5g} um"'
        return f'# {what}\n# {size}, phase = "{np.degrees(self.phase):.4g} deg"\n'


def eccentric_axes(rolled: Rolled) -> list[Axis]:
    """Return the gears whose eccentric teeth would explain order 1 of both flanks.

    To first order, an offset e at the phase p moves the active flank by e·sin(θ + p + αw) and the reverse one by
    e·sin(θ + p − αw), or of the loose gear by −e·sin(θ + p − αw) and −e·sin(θ + p + αw): equal in
    amplitude and 2·αw apart in phase, with a sign that identifies the gear.

    Source: geometry, as the effect ``eccentricity``.
    """
    active, reverse = rolled.fits
    if active is None or reverse is None:
        return []
    found = []
    for gear in (0, 1):
        line = Line(gear, 1)
        either = rolled.lines.alike.get(line)
        at = next((one for one in (line, either) if one is not None and one in active.lines), None)
        at = at or next((one for one in active.lines if rolled.lines.alike.get(one) == line), None)
        if at is None or at.order != 1:
            continue
        place = active.lines.index(at)
        if max(active.chance[place], reverse.chance[place]) > rolled.level:
            continue
        one, other = complex(active.phasors[place]), complex(reverse.phasors[place])
        turn = np.exp(1j * rolled.contacts.pressure_angle) * -1j
        back = np.exp(-1j * rolled.contacts.pressure_angle) * -1j
        shape = np.array([turn, back]) if gear == 0 else -np.array([back, turn])
        pair = np.array([one, other])
        offset = np.vdot(shape, pair) / 2.0
        rest = float(np.linalg.norm(pair - offset * shape) / np.linalg.norm(pair))
        noise = float(np.hypot(active.deviation[place], reverse.deviation[place]) / np.linalg.norm(pair))
        if rest < max(CLOSE, 3.0 * noise):
            found.append(Axis(GEARS[gear], float(abs(offset)), float(np.angle(offset)), rest))
    return found


STRONGEST = 21  # Orders that are reported, the strongest first, as Ottewill et al. 2010 keep them (eq. 11)
# Δχ² by which the loose gear must explain an order better than the drive to be reported as its cause
CLEARLY = 10.0
COUNTED = 0.5  # Part of an order that counting must leave of it, for it to be one of the flank
ALIKE = 9.0  # Chi-square below which an order of both flanks is the same


class Rolled(NamedTuple):
    """Flanks as contact shows them."""

    contacts: Contacts  # the data
    lines: Lines  # the orders looked at
    # of the active and of the reverse flank, of the same orders; ``None`` where the flank was not seen
    fits: tuple[Fit | None, Fit | None]
    notes: tuple[str, ...] = ()  # what contact during rattle cannot show

    @property
    def level(self) -> float:
        """p-value below which an order of a flank is significant."""
        return LEVEL / max(2 * len(self.lines.all), 1)

    def half_count(self, line: Line) -> float:
        """Return how far the zero of a record's angle may be off in terms of an order's phase [rad]."""
        return 0.5 * line.order * self.contacts.quanta[line.gear]


def roll(contacts: Contacts) -> Rolled:
    """Find and fit the orders of both flanks.

    Args:
        contacts: of the records.
    """
    if contacts.cuts:
        flanks, lines, fits, notes = rattle_flanks(contacts.cuts, contacts.teeth)
        return Rolled(contacts._replace(flanks=flanks), lines, fits, notes)
    ratio = contacts.teeth[0] / contacts.teeth[1]
    seen = [contact for contact in contacts.flanks if contact is not None]
    lines = lines_of(min(seen, key=lambda contact: contact.turns), contacts.teeth)
    chosen: list[Line] = []
    for contact in seen:
        chosen += [line for line in find(contact, lines, ratio) if line not in chosen]
    seen = [_smoothed(contact, chosen, ratio, contacts.radii[1]) for contact in seen]
    lines, chosen = _sides(seen, lines, chosen, ratio)
    fits = iter([fit(contact, lines, chosen, ratio) for contact in seen])
    return Rolled(contacts, lines, tuple(None if c is None else next(fits) for c in contacts.flanks))  # type: ignore[arg-type]


def _smoothed(contact: Contact, chosen: list[Line], ratio: float, radius: float) -> Contact:
    """Return contact with the loose gear's angle as the orders have it: its own counts would disturb both sides."""
    solved = solve(contact, chosen, ratio)
    return contact._replace(loose=contact.loose - np.where(solved.kept, solved.rest, 0.0) / radius)


def _sides(seen: list[Contact], lines: Lines, chosen: list[Line], ratio: float) -> tuple[Lines, list[Line]]:
    """Assign orders that either gear may have to the loose one where that gives a significantly smaller residual.

    The angles of both gears differ by the displacement itself, which separates large orders, but not small ones: on
    one flank by its own waves, from flank to flank by the backlash. What on the loose gear moves both flanks equally
    would be a variation of the backlash on the drive.
    """
    fits = [fit(contact, lines, chosen, ratio) for contact in seen]
    floors = [made.floor for made in fits]
    solved = [solve(contact, chosen, ratio) for contact in seen]
    for place, line in enumerate(chosen):
        if (other := lines.alike.get(line)) is None:
            continue
        tried = [*chosen[:place], other, *chosen[place + 1 :]]
        now = [solve(contact, tried, ratio) for contact in seen]
        at = lines.all.index(line)
        all_of = zip(seen, solved, now, floors, strict=True)
        gain = sum(_gain(contact, old, new, floor[at]) for contact, old, new, floor in all_of)
        noise = float(np.sum([floor[at] ** 2 for floor in floors]))
        alone, shared = (_parted(pair, place, len(chosen)) / noise for pair in (solved, now))
        if shared < ALIKE:
            gain += max(alone - shared, 0.0)
        if gain > CLEARLY:
            solved, chosen = now, tried
            everything = tuple(other if one == line else one for one in lines.all)
            alike = {**{key: value for key, value in lines.alike.items() if key != line}, other: line}
            lines = Lines(everything, lines.frequency, alike)
    return lines, chosen


def _parted(solved: list[Solved], place: int, count: int) -> float:
    """Return the square of how far an order of one flank is from that of the other [m²], 0 for one flank."""
    if len(solved) < 2:
        return 0.0
    first, second = (one.numbers[len(one.numbers) - 2 * count :].reshape(-1, 2)[place] for one in solved)
    return float(((first - second) ** 2).sum())


def _gain(contact: Contact, old: Solved, new: Solved, floor: float) -> float:
    """Return the Δχ² between two fits, by the noise at an order."""
    weight = contact.weight * (old.kept & new.kept)
    left = float((weight * (old.rest**2 - new.rest**2)).sum())
    return left / max(0.5 * float(weight.sum()) * floor**2, 1e-300)


def amplitude_and_phase(
    phasor: complex, block: np.ndarray, half_count: float, freedom: float
) -> tuple[Parameter, Parameter]:
    """Return amplitude and phase of an order with 95 % intervals.

    Noise makes amplitudes too large on average; that is subtracted. The phase counts from the zero of the record's
    angle, which is uncertain by half a count of the encoder.

    >>> size, phase = amplitude_and_phase(3e-6 + 4e-6j, 1e-16 * np.eye(2), 0.0, 1e9)
    >>> [round(1e6 * end, 3) for end in (size.low, size.value, size.high)], round(phase.high - phase.value, 5)
    ([4.98, 5.0, 5.02], 0.00392)
    """
    from scipy.stats import t as student

    size = abs(phasor)
    along = np.array([phasor.real, phasor.imag]) / size
    across = np.array([-along[1], along[0]])
    radial, sideways = (float(np.sqrt(way @ block @ way)) for way in (along, across))
    wide = float(student.ppf(0.975, freedom))
    value = float(np.sqrt(max(size**2 - sideways**2, 0.0)))
    phase = float(np.angle(phasor))
    reach = reach_of(wide / 1.959964 * sideways / size, half_count)
    amplitude = Parameter(value, "m", max(value - wide * radial, 0.0), value + wide * radial)
    return amplitude, Parameter(phase, "rad", phase - reach, phase + reach)


def reach_of(deviation: float, half: float) -> float:
    """Return the half width that holds 95 % of a normal error and one that is anywhere within ± half.

    >>> round(reach_of(1.0, 0.0), 4), round(reach_of(1e-6, 1.0), 4)
    (1.96, 0.95)
    """
    from scipy.optimize import brentq
    from scipy.stats import norm

    if half < 1e-3 * deviation or deviation == 0.0:
        return 1.959964 * deviation if deviation else 0.95 * half

    def beyond(reach: float) -> float:
        ends = (reach + half) / deviation, (reach - half) / deviation
        upper, lower = (end * norm.cdf(end) + norm.pdf(end) for end in ends)
        return float(deviation / half * (upper - lower) - 1.95)

    return float(brentq(beyond, 0.0, 2.0 * deviation + half))  # type: ignore[arg-type]


def strongest(rolled: Rolled, sizes: np.ndarray, real: np.ndarray) -> list[int]:
    """Return the places of the orders that are reported, the strongest first."""
    return [int(place) for place in np.argsort(-sizes) if real[place]][:STRONGEST]


def counted(fitted: Fit) -> np.ndarray:
    """Return which of the fitted orders the drive's counting makes, in size and phase, (p,)."""
    return np.abs(fitted.phasors - fitted.counted) < COUNTED * np.abs(fitted.phasors)


def cycle(teeth: tuple[int, int]) -> int:
    """Return the revolutions of the drive after which the same teeth meet again.

    >>> cycle((19, 37)), cycle((90, 90))
    (37, 1)
    """
    return teeth[1] // gcd(*teeth)


def goodness(rolled: Rolled) -> dict[str, object]:
    """Return how well the flanks are known, as JSON can hold it."""
    made: dict[str, object] = {"source": rolled.contacts.source, "speed_rad_s": rolled.contacts.speed}
    made["orders_looked_at"] = len(rolled.lines.all)
    made["chance_of_one_false_order"] = LEVEL
    for name, contact, fitted in zip(("active", "reverse"), rolled.contacts.flanks, rolled.fits, strict=True):
        if contact is None or fitted is None:
            continue
        left = np.sqrt(np.average(fitted.rest[fitted.kept] ** 2, weights=contact.weight[fitted.kept]))
        made[name] = {
            "turns": round(contact.turns, 3),
            "rest_rms_m": float(left),
            "noise_floor_m": float(np.median(fitted.floor)) if len(fitted.floor) else None,
            "bins_left_out": float(1.0 - fitted.kept.mean()),
            "scatter_of_turns_over_floor": fitted.scatter,
        }
    made["either_gear"] = [
        [line.name, rolled.lines.alike[line].name] for line in _fitted(rolled) if line in rolled.lines.alike
    ]
    return made


def _fitted(rolled: Rolled) -> tuple[Line, ...]:
    return next((fitted.lines for fitted in rolled.fits if fitted is not None), ())


def warnings(rolled: Rolled) -> list[str]:
    """Return the warnings about the orders."""
    contacts, told = rolled.contacts, [*rolled.notes]
    turns = min((contact.turns for contact in contacts.flanks if contact is not None), default=0.0)
    if contacts.unused:
        told.append(f"{contacts.unused} records with rattle are not used: slow turns determine the flanks better")
    mesh = cycle(contacts.teeth)
    either = [
        f"{line.name} may be {rolled.lines.alike[line].name}" for line in _fitted(rolled) if line in rolled.lines.alike
    ]
    if either:
        more = "" if turns >= mesh else f"; {mesh} turns tell more of them apart"
        told.append(f"orders of both gears that cannot be distinguished: {', '.join(either)}{more}")
    if contacts.source == "rattle":
        told.append("from what rattle leaves in contact, whose ends are uncertain: slow turns both ways are surer")
    for name, fitted in zip(("active", "reverse"), rolled.fits, strict=True):
        if fitted is None:
            told.append(f"the {name} flank was not seen: turn the drive the other way, too")
        elif fitted.kept.mean() < 0.99:
            told.append(f"{1.0 - fitted.kept.mean():.1%} of the {name} bins are off the flank and were left out")
        if fitted is not None and fitted.scatter > 2.0:
            told.append(f"{name} orders scatter from turn to turn by {fitted.scatter:.1f} times the noise: widened")
    if turns < 2.0:
        told.append(f"{turns:.2f} turns: what comes again every turn cannot be told from noise")
    counts = max(rolled.half_count(line) for line in _fitted(rolled)) if _fitted(rolled) else 0.0
    if counts > 0.02:
        told.append(f"phases are uncertain by up to {np.degrees(counts):.2g} deg, half a count of the encoder")
    return told


def curve(rolled: Rolled, flank: int, points: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Return the place of a flank over a turn of the drive by the orders found: angle [rad] and place [m]."""
    theta = np.linspace(0.0, 2.0 * pi, points)
    fitted = rolled.fits[flank]
    assert fitted is not None
    place = np.full(points, np.mean(list(fitted.offsets.values())))
    ratio = rolled.contacts.teeth[0] / rolled.contacts.teeth[1]
    for line, phasor in zip(fitted.lines, fitted.phasors, strict=True):
        place += (phasor * np.exp(1j * line.order * theta * (ratio if line.gear else 1.0))).real
    return theta, place


def effect(kind: str, line: Line, phasor: complex, extra: str = "") -> list[str]:
    """Return an effect of one order as lines of TOML."""
    size, phase = 1e6 * abs(phasor), np.degrees(np.angle(phasor))
    made = ["[[effect]]", f'kind = "{kind}"', f"order = {line.order}", f'amplitude = "{size:.6g} um"']
    made.append(f'phase = "{phase:.5g} deg"')
    if kind == "transmission_error":
        made.append(f'gear = "{GEARS[line.gear]}"')
    return [*made, extra] if extra else made

"""Both flanks of a pair from its contact: orders found on either, fitted on each, with intervals."""

from __future__ import annotations

from math import gcd, pi
from typing import NamedTuple

import numpy as np

from gears3d.identify.contact import Contact, Contacts
from gears3d.identify.law import Parameter
from gears3d.identify.order_lines import GEARS, Line, Lines, lines_of
from gears3d.identify.orders import LEVEL, Fit, Solved, find, fit, solve

STRONGEST = 21
"""Orders that are told, the strongest first, as Ottewill et al. 2010 keep them (eq. 11)."""
CLEARLY = 10.0
"""Chi-square that the loose gear must explain more than the drive to be named for an order that either may have."""
COUNTED = 0.5
"""Part of an order that counting must leave of it, for it to be one of the flank."""
ALIKE = 9.0
"""Chi-square below which an order of both flanks is the same."""


class Rolled(NamedTuple):
    """What contact tells of the flanks.

    Args:
        contacts: the data.
        lines: the orders looked at.
        fits: of the active and of the reverse flank, of the same orders; ``None`` where the flank was not seen.
    """

    contacts: Contacts
    lines: Lines
    fits: tuple[Fit | None, Fit | None]

    @property
    def level(self) -> float:
        """Chance below which an order of a flank is taken for real."""
        return LEVEL / (2 * len(self.lines.all))

    def half_count(self, line: Line) -> float:
        """Return how far the zero of a record's angle may be off in terms of an order's phase [rad].

        Args:
            line: the order.
        """
        return 0.5 * line.order * self.contacts.quanta[line.gear]


def roll(contacts: Contacts) -> Rolled:
    """Find and fit the orders of both flanks.

    Args:
        contacts: of the records.
    """
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
    """Give orders that either gear may have to the loose one where that leaves clearly less over.

    The angles of both gears differ by the displacement itself, which tells large orders apart, but not small ones: on
    one flank by its own waves, from flank to flank by the backlash. What on the loose gear moves both flanks alike
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
    """Return how much chi-square a fit has less than another, by the noise at an order."""
    weight = contact.weight * (old.kept & new.kept)
    left = float((weight * (old.rest**2 - new.rest**2)).sum())
    return left / max(0.5 * float(weight.sum()) * floor**2, 1e-300)


def amplitude_and_phase(
    phasor: complex, block: np.ndarray, half_count: float, freedom: float
) -> tuple[Parameter, Parameter]:
    """Return amplitude and phase of an order with 95 % intervals.

    Noise makes amplitudes too large on average; that is taken off. The phase counts from the zero of the record's
    angle, which counts of the encoder leave open by half of one.

    Args:
        phasor: amplitude·exp(i·phase) [m].
        block: covariance of its parts [m²], (2, 2).
        half_count: of the encoder in terms of the phase [rad].
        freedom: degrees of freedom of the covariance.

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

    Args:
        deviation: of the normal error.
        half: largest other error.

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
    """Return the places of the orders that are told, the strongest first.

    Args:
        rolled: the flanks.
        sizes: amplitude of each fitted order [m].
        real: which of them are significant.
    """
    return [int(place) for place in np.argsort(-sizes) if real[place]][:STRONGEST]


def counted(fitted: Fit) -> np.ndarray:
    """Return which of the fitted orders the drive's counting makes, size and phase alike, (p,).

    Args:
        fitted: a flank.
    """
    return np.abs(fitted.phasors - fitted.counted) < COUNTED * np.abs(fitted.phasors)


def cycle(teeth: tuple[int, int]) -> int:
    """Return the turns of the drive after which the same teeth meet again.

    Args:
        teeth: of drive and loose gear.

    >>> cycle((19, 37)), cycle((90, 90))
    (37, 1)
    """
    return teeth[1] // gcd(*teeth)


def goodness(rolled: Rolled) -> dict[str, object]:
    """Return how well the flanks are known, as JSON can hold it.

    Args:
        rolled: the flanks.
    """
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
            "noise_floor_m": float(np.median(fitted.floor)),
            "bins_left_out": float(1.0 - fitted.kept.mean()),
            "scatter_of_turns_over_floor": fitted.scatter,
        }
    made["either_gear"] = [
        [line.name, rolled.lines.alike[line].name] for line in _fitted(rolled) if line in rolled.lines.alike
    ]
    return made


def _fitted(rolled: Rolled) -> tuple[Line, ...]:
    return next(fitted.lines for fitted in rolled.fits if fitted is not None)


def warnings(rolled: Rolled) -> list[str]:
    """Return what is to be known before relying on the orders.

    Args:
        rolled: the flanks.
    """
    contacts, told = rolled.contacts, []
    turns = min(contact.turns for contact in contacts.flanks if contact is not None)
    mesh = cycle(contacts.teeth)
    either = [
        f"{line.name} may be {rolled.lines.alike[line].name}" for line in _fitted(rolled) if line in rolled.lines.alike
    ]
    if either:
        more = "" if turns >= mesh else f"; {mesh} turns tell more of them apart"
        told.append(f"orders of both gears that come out alike: {', '.join(either)}{more}")
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
    """Return the place of a flank over a turn of the drive by the orders found: angle [rad] and place [m].

    Args:
        rolled: the flanks.
        flank: 0 active, 1 reverse.
        points: of the curve.
    """
    theta = np.linspace(0.0, 2.0 * pi, points)
    fitted = rolled.fits[flank]
    assert fitted is not None
    place = np.full(points, np.mean(list(fitted.offsets.values())))
    ratio = rolled.contacts.teeth[0] / rolled.contacts.teeth[1]
    for line, phasor in zip(fitted.lines, fitted.phasors, strict=True):
        place += (phasor * np.exp(1j * line.order * theta * (ratio if line.gear else 1.0))).real
    return theta, place


def effect(kind: str, line: Line, phasor: complex, extra: str = "") -> list[str]:
    """Return an effect of one order as lines of TOML.

    Args:
        kind: of the effect.
        line: the order.
        phasor: amplitude·exp(i·phase) [m].
        extra: another line.
    """
    size, phase = 1e6 * abs(phasor), np.degrees(np.angle(phasor))
    made = ["[[effect]]", f'kind = "{kind}"', f"order = {line.order}", f'amplitude = "{size:.6g} um"']
    made.append(f'phase = "{phase:.5g} deg"')
    if kind == "transmission_error":
        made.append(f'gear = "{GEARS[line.gear]}"')
    return [*made, extra] if extra else made

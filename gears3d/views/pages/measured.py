"""The page of a measured record: sensors first, then displacement, impacts, flights, flanks and limits, with plots."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.files import write_text
from gears3d.measured.drive_motion import told
from gears3d.measured.segmentation import contact_orders
from gears3d.measured.segmentation.orders import STRAY, resolved
from gears3d.measured.segmentation.results import ROWS, within
from gears3d.recording import FLANKS
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, each_alone, harmonics
from gears3d.views.pages import engine
from gears3d.views.pages.charts import MOST_POINTS, NANOMETRE, QUANTA, TICK, impact_table, knots, speed_histogram, whole
from gears3d.views.pages.engine import Claim, Head, Key, Picture
from gears3d.views.pages.run import REGIMES
from gears3d.views.plots.numbers import Figure, figure, kind_of, plain, sized, spread

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement, Segments

# Meaning of the methods of evaluating an encoder.
READ_AS = {
    "edges": "counts last longer than samples: the times at which the counter changes are used",
    "samples": "counts are shorter than samples: every sample is used, shifted by 0.5 counts",
    "smooth": "no quantisation is visible: every sample is used as it is",
}
CHANNELS = {"theta_drive_rad": "drive gear", "theta_loose_rad": "loose gear", "time_s": "clock"}


class Found(NamedTuple):
    """A finding of the gate, as a row of a table.

    Args:
        kind: word that ``--correct`` takes.
        where: channel in words.
        size: how large.
        evidence: observation.
        remedy: what to do, or correction that was made.
        tone: ``corrected``, ``open`` or ``fatal``.
    """

    kind: str
    where: str
    size: Figure
    evidence: str
    remedy: str
    tone: str


def findings(summary: dict[str, Any]) -> list[Found]:
    """Return what the gate found, open findings first."""
    rows = []
    for one in summary["quality"].get("findings", []):
        remedy = one["remedy"]
        if one["corrected"]:
            tone, remedy = "corrected", "corrected on request, before the analysis"
        else:
            tone = "fatal" if one["fatal"] else "open"
            if one["correctable"]:
                remedy = f"--correct {one['kind']}" + (f", {remedy}" if remedy else "")
        channel = CHANNELS.get(one["channel"]) or str(one["channel"])
        rows.append(Found(one["kind"], channel, sized(one["size"], one["unit"]), one["evidence"], remedy, tone))
    return sorted(rows, key=lambda row: row.tone == "corrected")


def sensor_verdict(rows: list[Found]) -> str:
    """Return the result of the sensor gate in one sentence."""
    still = [row for row in rows if row.tone != "corrected"]
    done = len(rows) - len(still)
    fixed = f"{done} {'fault was' if done == 1 else 'faults were'} corrected on request" if done else ""
    if not rows:
        return "Sensors and clock: no fault was found."
    if not still:
        return f"Sensors and clock: {fixed}, no other fault was found."
    kinds = ", ".join(dict.fromkeys(row.kind for row in still))
    text = f"Caution: sensor faults that were not corrected affect all results: {kinds}"
    return text + (f"; {fixed}." if fixed else ".")


def sensor_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return sampling, encoders and noise as lines of a table."""
    quality = summary["quality"]
    rate = Figure(f"{plain(quality['sample_rate_Hz'])}\N{NO-BREAK SPACE}Hz", quality["sample_rate_Hz"])
    lines = [
        Claim("sample_rate_Hz", "sampling", rate, f"{quality['samples']} samples"),
        Claim(
            "jitter",
            "jitter of the clock",
            figure(quality["jitter"], "ratio", 2),
            "largest, relative to the sampling interval",
        ),
    ]
    if motion := summary.get("drive_motion"):
        rpm = 30.0 / np.pi * motion["mean_rad_s"]["value"]
        mean = Figure(f"{plain(rpm, 4)}\N{NO-BREAK SPACE}rpm", motion["mean_rad_s"]["value"])
        lines.append(Claim("drive_motion", "measured motion of the drive", mean, told(motion)))
    for gear, one in quality["encoders"].items():
        counts = one["counts_per_revolution"]
        shown = Figure("not visible") if counts is None else Figure(f"{counts:.0f}", float(counts))
        how = READ_AS.get(one["read_as"], f"evaluated as {one['read_as']}")
        spread = f"standard deviation of a reading {plain(1e6 * one['sigma_rad'], 3)} µrad; {how}"
        lines.append(Claim(f"encoders.{gear}", f"encoder counts per revolution, {gear} gear", shown, spread))
    meanings = {
        "noise_m": ("noise of a reading", "displacement along the line of action"),
        "noise_in_contact_m": (
            "noise in contact",
            "of averaged readings, about the flank; only larger separations count as flights",
        ),
        "averaged_over_s": ("averaging time", "limited by the velocity jumps of the path"),
    }
    for key, (name, meaning) in meanings.items():
        lines.append(Claim(key, name, figure(quality[key], kind_of(key), 3), meaning))
    return lines


# Duration of impacts, in samples, below which a limit is stated.
SAMPLES = 4.0


def limits(found: Measurement) -> list[str]:
    """Return the limits of the record, one sentence each."""
    summary, hits = found.summary, found.recording.impacts
    if summary["status"] == "unexplained":
        seen = summary["visible"]
        span, speed = figure(seen["displacement_range_m"], "length", 3).text, seen["drive_speed_mean_rad_s"]
        ratio = "unknown" if seen["ratio_loose_over_drive"] is None else f"{seen['ratio_loose_over_drive']:.6g}"
        return [
            "Impacts, regime, contact and backlash are withheld: free flights and contact do not explain the motion.",
            f"The displacement has a range of {span}; the loose gear turns {ratio} times as fast as the drive gear, "
            f"{seen['ratio_of_base_radii']:.6g} by the rig; the drive gear turns at {speed:.5g} rad/s on average.",
        ]
    lowest = figure(summary["quality"]["flight_height_min_m"], "length", 3).text
    stated = [
        f"Bounces lower than {lowest} cannot be distinguished from contact; mean speeds exclude impacts after them."
    ]
    if summary["flanks"]["backlash_m"] is None:
        stated.append(
            "There was no impact on the reverse flank: its position, its orders and the backlash are unknown."
        )
    unseen = int(np.count_nonzero(~np.isfinite(hits["rebound_m_s"])))
    if unseen:
        stated.append(
            f"No rebound was observed after {unseen} of {len(hits['rebound_m_s'])} impacts: unknown (NaN), not 0."
        )
    bare = [flank for flank, one in summary["durations"].items() if one["impacts"] and not one["resolved"]]
    if bare:
        stated.append(
            f"No impact on the {' and the '.join(bare)} flank is long enough to be resolved: "
            "only an upper bound is stated."
        )
    step = 1.0 / summary["quality"]["sample_rate_Hz"]
    brief = [name for name, one in summary["durations"].items() if one["resolved"] and one["median_s"] < SAMPLES * step]
    if brief:
        stated.append(
            f"Impacts on the {' and the '.join(brief)} flank last about as long as a sample "
            f"({figure(step, 'time', 3).text}): filtering of the record, also by a "
            "delay correction, increases them by a similar amount."
        )
    if found.recording.meta.get("teeth_from") == "record" and "tooth_drive" in hits:
        stated.append(
            "Teeth are numbered from the first angle of the record (no index mark): numbers differ between records."
        )
    if not found.recording.meta.get("period_s"):
        stated.append(
            "The period of the drive's fluctuation is unknown (no --rig with harmonics): no phases are stated."
        )
    touched = summary["contacts_seen"]
    quiet = [flank for flank, orders in summary["contact_orders"].items() if touched[flank] and not orders]
    if quiet:
        stated.append(f"On the {' and the '.join(quiet)} flank no order exceeds the noise, or contact is too short.")
    stated.append(
        "Orders are determined at the gear angles of contact only. If the fluctuation is synchronous with the "
        "revolution, these angles repeat, and orders may be confused with each other."
    )
    return stated


def impact_lines(found: Measurement) -> list[Claim]:
    """Return the impacts of both flanks as lines of a table."""
    summary, hits = found.summary, found.recording.impacts
    lines = []
    for code, flank in enumerate(FLANKS):
        mine = hits["flank"] == code
        if not mine.any():
            continue
        speed, spread = summary[f"{flank}_velocity_mean_m_s"], summary[f"{flank}_velocity_std_m_s"]
        text = figure(None if speed is None else abs(speed), "velocity").text
        scatter = "" if spread is None else f"standard deviation {figure(spread, 'velocity', 3).text}; "
        lines.append(
            Claim(
                f"{flank}_impacts",
                f"impacts, {flank} flank",
                figure(int(mine.sum())),
                "all that could be distinguished",
            )
        )
        name = f"mean impact speed, {flank} flank"
        meaning = f"{scatter}excludes impacts after very low bounces"
        lines.append(Claim(f"{flank}_mean", name, Figure(text, speed), meaning))
        both = mine & np.isfinite(hits["rebound_m_s"]) & (hits["testifies"] == 1) & (hits["velocity_m_s"] != 0)
        if both.any():
            ratio = np.abs(hits["rebound_m_s"][both] / hits["velocity_m_s"][both])
            low, high = np.quantile(ratio, (0.25, 0.75))
            what = (
                f"median of {both.sum()} impacts with observed rebound; quartiles {plain(low, 3)} and {plain(high, 3)}"
            )
            name = f"rebound speed over approach speed, {flank} flank"
            lines.append(Claim(f"{flank}_ratio", name, figure(float(np.median(ratio)), digits=3), what))
    return lines


def duration_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return how long impacts last, as lines of a table."""
    lines = []
    for flank, one in summary["durations"].items():
        if one["resolved"]:
            what = f"median of {one['resolved']} resolved impacts out of {one['impacts']}"
            shown = figure(one["median_s"], "time", 3)
        elif one["max_median_s"] is not None:
            shown = figure(one["max_median_s"], "time", 3)
            shown = Figure(f"< {shown.text}", shown.value)
            what = f"none of {one['impacts']} impacts is resolved; median of their upper bounds (95 %)"
        else:
            continue
        lines.append(Claim(f"durations.{flank}", f"duration, {flank} flank", shown, what))
    return lines


def durations(found: Measurement) -> dict[str, dict[str, Any]]:
    """Return how long impacts last by flank, as ``durations`` of ``summary.json`` has it."""
    hits, out = found.segments.impacts, {}
    for code, flank in enumerate(FLANKS):
        mine = hits["flank"] == code
        lasted, most = hits["duration_s"][mine], hits["duration_max_s"][mine]
        seen = np.isfinite(lasted)
        out[flank] = {
            "impacts": int(mine.sum()),
            "resolved": int(seen.sum()),
            "median_s": float(np.median(lasted[seen])) if seen.any() else None,
            "quartiles_s": [float(q) for q in np.quantile(lasted[seen], (0.25, 0.75))] if seen.any() else None,
            "max_median_s": float(np.median(most[np.isfinite(most)])) if np.isfinite(most).any() else None,
        }
    return out


def flight_lines(found: Measurement) -> list[Claim]:
    """Return the flights as lines of a table."""
    cut, table = found.summary["cut"], found.segments.flights
    lines = [Claim("whole_flights", "complete flights", figure(cut["whole_flights"]), "from contact loss to impact")]
    if cut["whole_flights"]:
        share = cut["testifying"] / cut["whole_flights"]
        what = f"{plain(100 * share, 3)} %; they pass the goodness-of-fit test (p > 0.1 %), the others are excluded"
        lines += [
            Claim("testifying", "used for identification", figure(cut["testifying"]), what),
            Claim(
                "chi2_median", "χ² per degree of freedom, median", figure(cut["chi2_median"], digits=3), "1 is expected"
            ),
            Claim(
                "height",
                "largest height",
                figure(float(table["height_m"].max()), "length"),
                "from the flank where the flight began",
            ),
            Claim(
                "lasting",
                "duration, median",
                figure(float(np.median(table["end_s"] - table["start_s"])), "time"),
                f"longest: {figure(float((table['end_s'] - table['start_s']).max()), 'time').text}",
            ),
        ]
    slowing = cut["deceleration_median_rad_s2"]
    if slowing is not None:
        shown = Figure(f"{plain(slowing)}\N{NO-BREAK SPACE}rad/s²", slowing)
        lines.append(Claim("deceleration", "deceleration in flight, median", shown, _torque(found, slowing)))
    if cut["slope_1_s"]:
        one = cut["slope_1_s"]
        shown = Figure(f"{plain(one['value'], 3)} ± {plain(one['sigma'], 2)}\N{NO-BREAK SPACE}1/s", one["value"])
        lines.append(
            Claim("slope_1_s", "change of deceleration with speed", shown, "within flights; positive for viscous drag")
        )
    return lines


def _torque(found: Measurement, slowing: float) -> str:
    inertia = found.recording.meta.get("inertia_kg_m2")
    if inertia is None:
        return "of the loose gear: drag torque over inertia"
    torque = plain(slowing * inertia, 3)
    return f"of the loose gear: a drag torque of {torque} N·m with the rig's inertia of {plain(inertia, 3)} kg·m²"


# Name and meaning of the reasons why an interval without contact is not used.
WHY_NOT = {
    "too_short": ("too short", "fewer readings than a parabola needs"),
    "no_blow": ("no approach", "not a flight: the interval without contact ends without an approach speed"),
    "cut_off": ("truncated", "reaches the begin or end of the record"),
    "no_testimony": ("poor fit", "kept, but it fails the goodness-of-fit test and is not used for identification"),
}


def discarded(summary: dict[str, Any]) -> list[Claim]:
    """Return excluded intervals and their counts as lines of a table; empty where the gears stay in contact."""
    cut = summary["cut"]
    every = cut["whole_flights"] + sum(cut["dropped"].values())
    lines: list[Claim] = []
    if not every:
        return lines
    for why, count in {**cut["dropped"], "no_testimony": cut["whole_flights"] - cut["testifying"]}.items():
        name, meaning = WHY_NOT[why]
        share = f" ({plain(100 * count / every, 2)} %)"
        lines.append(Claim(f"dropped.{why}", name, Figure(f"{count}{share}", float(count)), meaning))
    return lines


def _no_backlash(summary: dict[str, Any]) -> str:
    if summary["status"] == "unexplained":
        return "withheld: free flights and contact do not explain the motion"
    return "no impact on the reverse flank"


def flank_lines(summary: dict[str, Any]) -> list[Claim]:
    """Return backlash and strongest orders as lines of a table."""
    backlash = summary["flanks"]["backlash_m"]
    lines = []
    if backlash is None:
        lines.append(Claim("backlash_m", "backlash", Figure("unknown"), _no_backlash(summary)))
    else:
        low, high = (figure(end, "length", 6).text for end in backlash["ci95"])
        shown = figure(backlash["value"], "length", 5)
        lines.append(Claim("backlash_m", "backlash", shown, f"mean over gear angles; 95 % interval {low} to {high}"))
    for flank, orders in summary["contact_orders"].items():
        for k, one in enumerate(orders[:6]):
            meaning = f"± {figure(one['sigma_m'], 'length', 2).text} (standard deviation), phase "
            meaning += f"{plain(np.degrees(one['phase_rad']), 3)}°"
            name = f"order {one['order']} of the {one['gear']} gear, {flank} flank"
            lines.append(Claim(f"contact_orders.{flank}.{k}", name, figure(one["amplitude_m"], "length"), meaning))
    return lines


def render(found: Measurement, files: tuple[str, ...] = (), strip: Picture | None = None) -> str:
    """Return the page of a measured record as HTML that opens without a network.

    Args:
        found: of a record; its summary has ``contact_orders`` and ``durations``
            (:func:`orders_told`, :func:`durations`).
        files: names of files in the same folder.
        strip: pictures of the mesh over a period.
    """
    summary, rows, data = found.summary, findings(found.summary), blocks(found)
    made = {key: summary.get(key) for key in ("version", "command")} | {
        "inputs": (summary.get("provenance") or {}).get("inputs", [])
    }
    return engine.render(
        "measured.html.j2",
        head(found, rows),
        made,
        files,
        data,
        sentence=sensor_verdict(rows),
        found=[("", row) for row in rows],
        sensors=sensor_lines(summary),
        impacts=impact_lines(found),
        durations=duration_lines(summary),
        flights=flight_lines(found),
        discarded=discarded(summary),
        flanks=flank_lines(summary),
        limits=limits(found),
        period=bool(found.recording.meta.get("period_s")),
        resolved=any(one["resolved"] for one in summary["durations"].values()),
        spectra={gear: list(flanks) for gear, flanks in data["spectra"].items()},
        withheld=summary["status"] == "unexplained",
        has_impacts=bool(len(found.recording.impacts["time_s"])),
        has_flights=bool(len(found.segments.flights["start_s"])),
        strip=strip,
    )


def write(path: str | Path, found: Measurement, files: tuple[str, ...] = (), strip: Picture | None = None) -> Path:
    """Write the page of a measured record under a temporary name and rename it.

    Args:
        path: the file, e.g. ``report.html``.
        found: as for :func:`render`.
        files: as for :func:`render`.
        strip: as for :func:`render`.

    Raises:
        InputError: it cannot be written.
    """
    return write_text(path, render(found, files, strip))


def head(found: Measurement, rows: list[Found]) -> Head:
    """Return question, answer and key numbers: regime, backlash, impacts, speeds, noise."""
    summary, meta = found.summary, found.recording.meta
    backlash, withheld = summary["flanks"]["backlash_m"], summary["status"] == "unexplained"
    keys = [Key("regime", figure(summary["regime"]), key="regime")]
    if backlash is not None:
        shown, interval = _backlash(backlash)
        keys.append(Key("backlash", shown, interval, "backlash_m"))
    keys.append(Key("impacts", figure(summary["impacts"]), key="impacts"))
    for flank in FLANKS:
        speed, scatter = summary[f"{flank}_velocity_mean_m_s"], summary[f"{flank}_velocity_std_m_s"]
        text = figure(None if speed is None else abs(speed), "velocity").text
        width = "" if scatter is None else f"± {figure(scatter, 'velocity', 3).text} (standard deviation of impacts)"
        name = f"mean impact speed, {flank} flank"
        keys.append(Key(name, Figure(text, speed), width, f"{flank}_velocity_mean_m_s", flank))
    keys.append(Key("noise of a reading", figure(summary["quality"]["noise_m"], "length"), key="noise_m"))
    open_ = [row for row in rows if row.tone != "corrected"]
    return Head(
        "measured record", str(meta.get("title") or Path(str(summary.get("file") or "Measured record")).name),
        "When were the flanks in contact, how did they meet, and are the sensors sound?",
        f"{answer(summary)} {sensor_verdict(rows)}", [key for key in keys if key.figure.text != "–"],
        "bad" if withheld or any(row.tone == "fatal" for row in rows) else "open" if open_ else "good",
        source=str(meta.get("source") or ""),
    )  # fmt: skip


def _backlash(told: dict[str, Any]) -> tuple[Figure, str]:
    low, high = told["ci95"]
    return spread(told["value"], low, high, "m")


def answer(summary: dict[str, Any]) -> str:
    """Return regime, sizes and how many flights support them in a few sentences."""
    if summary["status"] == "unexplained":
        said = summary["warnings"][0]
        return f"{said[:1].upper()}{said[1:]}."
    cut, backlash = summary["cut"], summary["flanks"]["backlash_m"]
    text = REGIMES.get(str(summary["regime"]), "Regime unknown")
    if backlash is not None:
        shown, interval = _backlash(backlash)
        text += f"; the backlash is {shown.text} {interval}"
    speeds = {flank: summary[f"{flank}_velocity_mean_m_s"] for flank in FLANKS}
    known = [
        f"{figure(abs(one), 'velocity').text} on the {flank} flank" for flank, one in speeds.items() if one is not None
    ]
    if known:
        text += f"; the mean impact speed is {' and '.join(known)}"
    if cut["whole_flights"]:
        text += f". {cut['testifying']} of {cut['whole_flights']} complete free flights pass the goodness-of-fit test"
    return f"{text}."


# Order up to which the noise floor is drawn.
HIGHEST = 400
# Bins of the angle in a wave of the highest order, at least.
FINE = 32
# Regularisation, relative to the number of readings, of orders that few contact angles determine poorly.
RIDGE = 1e-4
# Points in contact below which no orders are reported.
FEWEST = 50


def orders_told(found: Measurement) -> dict[str, list[dict[str, Any]]]:
    """Return the orders of both gears by flank, as ``contact_orders`` of ``summary.json`` has them."""
    told = {}
    for flank, name in enumerate(FLANKS):
        if _enough(found, flank):
            table = contact_orders(found, flank)
            told[name] = [
                {
                    "gear": GEARS[int(table["gear"][k])],
                    "order": int(table["order"][k]),
                    **{key: float(table[key][k]) for key in ("amplitude_m", "sigma_m", "phase_rad", "share")},
                }
                for k in range(len(table["order"]))
            ]
        else:
            told[name] = []
    return told


def spectra(found: Measurement) -> dict[str, Any]:
    """Return the residual at every order without the significant orders."""
    left: dict[str, dict[str, list[float]]] = {}
    for flank, name in enumerate(FLANKS):
        if not _enough(found, flank):
            continue
        for gear, floor in _floors(found, flank, found.summary["contact_orders"][name]).items():
            left.setdefault(gear, {})[name] = [float(f"{value:.3g}") for value in floor]
    return left


def _enough(found: Measurement, flank: int) -> bool:
    return len(_near(found, flank)) >= FEWEST


def _near(found: Measurement, flank: int) -> np.ndarray:
    cut = found.segments
    return within(cut.path.time, cut.contacts, cut.path.width, flank)


def _floors(found: Measurement, flank: int, taken: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the amplitude of the residual at each order of each gear [m]."""
    path = found.segments.path
    near = _near(found, flank)
    some = near[:: max(len(near) // ROWS, 1)]
    angles = dict(zip(GEARS, (path.drive[some], path.loose[some]), strict=True))
    x = np.linspace(-0.5, 0.5, len(some))
    waves = [harmonics(angles[one["gear"]], [one["order"]]) for one in taken]
    columns = np.hstack([np.stack([np.ones_like(x), x, x * x], axis=1), *waves])
    rest = path.place[some] - columns @ np.linalg.lstsq(columns, path.place[some], rcond=None)[0]
    limit = STRAY * robust_deviation(rest)
    rest = np.clip(rest, -limit, limit)
    highest = dict(zip(GEARS, resolved(path.drive, path.loose), strict=True))
    return {
        gear: np.abs(each_alone(angles[gear], rest, min(top, HIGHEST), RIDGE, FINE)[0][1:])
        for gear, top in highest.items()
        if top > 1
    }


# Quantum of each column of impacts, at most 10 % of any measurement error.
IMPACTS = {
    **QUANTA,
    "time_sigma_s": 1e-9,
    "velocity_sigma_m_s": 1e-8,
    "rebound_sigma_m_s": 1e-8,
    "duration_s": 1e-8,
    "duration_sigma_s": 1e-9,
    "duration_max_s": 1e-8,
    "testifies": 1.0,
}
# Quantum of each column of flights.
FLIGHTS = {
    "start_s": 1e-7,
    "end_s": 1e-7,
    "left": 1.0,
    "struck": 1.0,
    "velocity_m_s": 1e-7,
    "height_m": 1e-10,
    "deceleration_rad_s2": 1e-5,
    "deceleration_sigma_rad_s2": 1e-6,
    "omega_loose_rad_s": 1e-5,
    "chi2": 1e-4,
    "testifies": 1.0,
}
# Tolerance of the drawn line, in standard deviations of the noise.
DEVIATIONS = 3.0
# Readings drawn in the period that is magnified.
READINGS = 6000
# Flights in it where the drive has no period.
FLIGHTS_SHOWN = 6


def blocks(found: Measurement) -> dict[str, Any]:
    """Return the blocks by name."""
    recording, cut = found.recording, found.segments
    lines = path_lines(cut)
    time = np.cumsum(lines["time"]) * TICK
    return {
        "traces": lines,
        "walls": _walls(cut, time),
        "impacts": impact_table(recording, {name: q for name, q in IMPACTS.items() if name in recording.impacts}),
        "twin_impacts": None,
        "errors": None,
        "histogram": speed_histogram(recording, None),
        "about": {
            "period": recording.meta.get("period_s"),
            "settle": recording.meta.get("settle_s"),
            "mode": None,
            "height": found.summary["quality"]["flight_height_min_m"],
            "model": "measured",
        },
        "close": close_up(found),
        "flights": {name: whole(cut.flights[name], quantum) for name, quantum in FLIGHTS.items()},
        "spectra": spectra(found),
        "orders": found.summary["contact_orders"],
    }


def path_lines(cut: Segments, most: int = MOST_POINTS) -> dict[str, Any]:
    """Return the measured path, simplified within its noise, with velocity jumps and states."""
    path, shift = cut.path, cut.flanks.active[0]
    at, place = _corners(cut)
    ticks, first = np.unique(np.rint(np.append(at, path.time) / TICK).astype(np.int64), return_index=True)
    place = np.append(place, path.place)[first] - shift
    corner = first < len(at)
    speed = cut.track.steady.curve.derivative()(np.clip(ticks * TICK, path.time[0], path.time[-1]))
    some = np.linspace(0, len(ticks) - 1, min(len(ticks), 1500)).astype(int)
    start = np.union1d(some, np.flatnonzero(corner))
    fine = max(DEVIATIONS * path.noise, 1e-4 * float(np.ptp(place)), NANOMETRE)
    scaled = np.array([place / fine, speed / max(2e-3 * float(np.ptp(speed)), 1e-6)])
    slack, kept = 1.0, np.arange(len(ticks))
    while len(ticks) > 2:
        kept = knots(ticks.astype(float), scaled, start, slack, max(most, len(start)))
        if len(kept) <= max(most, len(start)) or slack > 1e6:
            break
        slack *= 2.0
    ticks = ticks[kept]
    middles = 0.5 * TICK * (ticks + np.append(ticks[1:], ticks[-1]))
    return {
        "tick": TICK,
        "time": np.diff(ticks, prepend=0).tolist(),
        "run": {"displacement_m": _steps(place[kept], NANOMETRE), "omega_drive_rad_s": _steps(speed[kept], 1e-6)},
        "twin": None,
        "states": "".join(str(int(state)) for state in cut.states(middles)),
    }


def _corners(cut: Segments) -> tuple[np.ndarray, np.ndarray]:
    """Return moments at which the path touches or leaves a flank [s], and where that is [m]."""
    flights, impacts = cut.flights, cut.impacts
    time = np.concatenate([impacts["time_s"] + TICK, flights["start_s"], flights["end_s"]])
    flank = np.concatenate([impacts["flank"], flights["left"], flights["struck"]])
    inside = (time > cut.path.time[0]) & (time < cut.path.time[-1])
    low, high = _flanks_at(cut, time[inside])
    return time[inside], np.where(flank[inside] == 1, high, low)


def _flanks_at(cut: Segments, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    known = cut.track
    return cut.flanks.places(time, *known.angles(time))


def _steps(values: np.ndarray, quantum: float) -> dict[str, Any]:
    rounded = np.rint(values / quantum).astype(np.int64)
    return {"quantum": quantum, "steps": np.diff(rounded, prepend=0).tolist()}


def _walls(cut: Segments, time: np.ndarray) -> dict[str, Any]:
    low, high = (ends - cut.flanks.active[0] for ends in _flanks_at(cut, time))
    struck = bool(np.isfinite(high).all())
    return {
        "quantum": NANOMETRE,
        "moving": True,
        "complete": True,
        "active": _steps(low, NANOMETRE)["steps"],
        "reverse": _steps(high, NANOMETRE)["steps"] if struck else None,
    }


def close_up(found: Measurement) -> dict[str, Any]:
    """Return the readings of one period in the middle of the record, with flanks and states."""
    cut = found.segments
    known, shift = cut.track, cut.flanks.active[0]
    start, end = _window(found)
    all_of = np.flatnonzero((known.time >= start) & (known.time <= end))
    every = -(-len(all_of) // READINGS) or 1
    some = all_of[::every]
    time = known.time[some]
    drive, loose, place = known.part(some)
    low, high = cut.flanks.places(time, drive, loose)

    def micrometres(values: np.ndarray) -> list[float]:
        return (1e6 * (values - shift)).round(3).tolist()

    return {
        "start": start,
        "end": end,
        "time": (time - start).round(7).tolist(),
        "place": micrometres(place),
        "low": micrometres(low),
        "high": micrometres(high) if np.isfinite(high).all() else None,
        "state": "".join(str(int(state)) for state in cut.states(time)),
        "every": every,
        "sigma": 1e6 * known.noise,
    }


def _window(found: Measurement) -> tuple[float, float]:
    """Return begin and end of a period that shows what is typical [s]."""
    cut = found.segments
    begin, end = float(cut.track.time[0]), float(cut.track.time[-1])
    starts, ends = cut.flights["start_s"], cut.flights["end_s"]
    period = found.recording.meta.get("period_s")
    if not len(starts):
        width = min(period or 0.1 * (end - begin), end - begin)
        return 0.5 * (begin + end - width), 0.5 * (begin + end + width)
    near = slice(len(starts) // 3, max(2 * len(starts) // 3, len(starts) // 3 + 1))
    one = near.start + int(np.argmax(cut.flights["height_m"][near]))
    if not period:
        last = min(one + FLIGHTS_SHOWN - 1, len(starts) - 1)
        period = 1.1 * float(ends[last] - starts[one])
    width = min(1.05 * period, end - begin)
    first = float(np.clip(starts[one] - 0.05 * width, begin, end - width))
    return first, first + width

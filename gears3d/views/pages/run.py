"""The page of a run: what was simulated, results, comparison with the rigid model, error budget."""

from __future__ import annotations

import re
import shlex
import tomllib
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.files import write_text
from gears3d.provenance import provenance
from gears3d.signals import times_of, window
from gears3d.units import parse as quantity
from gears3d.units import show
from gears3d.views.camera import camera, section_svg
from gears3d.views.pages import engine
from gears3d.views.pages.charts import blocks, contacts, crossings
from gears3d.views.pages.engine import Claim, Head, Key, Picture
from gears3d.views.plots.numbers import Figure, figure, kind_of, plain, pretty
from gears3d.views.plots.section import widening

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

# Name and meaning of each number of the comparison.
COMPARISON = {
    "mode": (
        "compared as",
        "trajectory: impact by impact. distribution: only statistics of the impacts are compared, because the motion "
        "is chaotic and two correct simulations diverge after a few impacts.",
    ),
    "impacts_compared": ("impacts compared", "impacts of the rigid model after flights higher than the limit below"),
    "impacts_matched": ("matched", "of these, also found in the run, on the same flank at the same time"),
    "impacts_missed": ("missed", "in the rigid model but not in the run; 0 is ideal"),
    "impacts_invented": ("spurious", "in the run but not in the rigid model; 0 is ideal"),
    "velocity_error_median": ("impact speed, median error", "50 % of the impact speeds have a smaller error"),
    "velocity_error_p95": (
        "impact speed, 95th percentile of the error",
        "5 % of the impact speeds have a larger error",
    ),
    "velocity_bias": (
        "impact speed, bias",
        "mean error with its sign; positive: the run has faster impacts than the rigid model",
    ),
    "phase_error_median_cycles": ("time of impact, median error", "in periods of the drive's fluctuation"),
    "flight_height_min_m": ("minimum flight height", "lower bounces are not compared"),
    "regime_equal": ("same regime", "run and rigid model have the same pattern of motion"),
}

# Name and meaning of the numbers where distributions are compared, not single impacts.
DISTRIBUTION = {
    "impacts_compared": (
        "impacts in the rigid model",
        "not matched one by one; after flights higher than the limit below",
    ),
    "velocity_error_median": (
        "impact speed, median",
        "difference of the medians of run and rigid model, larger value of both flanks",
    ),
    "velocity_error_p95": (
        "impact speed, 95th percentile",
        "difference of run and rigid model, larger value of both flanks",
    ),
    "velocity_bias": (
        "impact speed, mean",
        "difference; positive: faster impacts in the run, larger value of both flanks",
    ),
    "phase_error_median_cycles": (
        "mean phase of the impacts",
        "difference of run and rigid model, larger value of both flanks",
    ),
}

RATIOS = ("velocity_error_median", "velocity_error_p95", "velocity_bias")

# What the parts of the error budget come from, by how their names begin.
BUDGET = {
    "facet": "flat facets in place of the involute, for collision hulls only",
    "hull_quantisation": "resolution at which Bullet stores the vertices of a hull",
    "hull_margins": "Bullet's collision margins, one per body",
    "raw_minus_refined": "gap that Bullet reports for the hulls minus the gap of the true flanks",
    "raw_allowed": "limit of this difference; a larger one stops the run",
    "location": "largest residual gap at an impact located on the true flanks",
    "step": "finite time step: none, as events end steps",
    "total": "largest error of a gap in this run: hulls only select the teeth, gaps are evaluated on the true flanks",
}

# The same for Bullet's own contact, where no impact is placed on the true flanks.
NATIVE = {
    "facet": "flat facets in place of the involute: they are the contact surface and tilt the contact normal",
    "raw_minus_refined": "gap of the hulls in contact minus the gap of the true flanks",
    "total": "largest error of a gap in this run: the hulls are the contact surface; errors of rebound direction are "
    "not included",
}
# Parts that do not apply to Bullet's own contact.
NATIVE_WITHOUT = ("location", "step")


def comparison_lines(comparison: dict[str, Any] | None) -> list[Claim]:
    r"""Return the comparison with the twin as lines of a table.

    >>> comparison_lines({"velocity_bias": -0.00021})[0].figure
    Figure(text='−0.021\xa0%', value=-0.00021)
    """
    given = comparison or {}
    known = {**COMPARISON, **DISTRIBUTION} if given.get("mode") == "distribution" else COMPARISON
    keys = [key for key in COMPARISON if key in given] + [key for key in given if key not in COMPARISON]
    lines = []
    for key in keys:
        name, meaning = known.get(key, (key.replace("_", " "), ""))
        if not isinstance(given[key], dict | list) and (given[key] is not None or known is COMPARISON):
            lines.append(Claim(key, name, figure(given[key], "ratio" if key in RATIOS else kind_of(key)), meaning))
    return lines


def budget_lines(budget: dict[str, Any] | None, native: bool = False) -> list[Claim]:
    r"""Return the error budget as lines of a table, all in lengths along the line of action.

    >>> budget_lines({"facets": 1.2e-7})[0].figure.text
    '120\xa0nm'
    """
    lines = []
    meanings = {**BUDGET, **NATIVE} if native else BUDGET
    for key, value in (budget or {}).items():
        if native and key in NATIVE_WITHOUT:
            continue
        if isinstance(value, dict):
            inner = budget_lines(value, native)
            lines += [one._replace(key=f"{key}.{one.key}", name=f"{key}: {one.name}") for one in inner]
            continue
        meaning = next((text for begin, text in meanings.items() if key.startswith(begin)), "")
        is_length = isinstance(value, float) and not key.endswith(("_count", "_ratio", "_s"))
        name = key.removesuffix("_m").replace("_", " ")
        lines.append(Claim(key, name, figure(value, "length" if is_length else "", 3), meaning))
    return lines


def common_ground(summary: dict[str, Any]) -> str:
    """Return in a few sentences what run and rigid model have in common, and what their agreement proves."""
    parts = [
        "The rigid model is independent code: it integrates one equation of motion between two walls, without solids."
    ]
    if summary.get("model") == "bullet" and summary.get("contact") == "native":
        parts.append(
            "The run moved rigid bodies in PyBullet with the contact of Bullet: flat facets and quantised hulls touch "
            "and tilt the contact normals as the gears rotate, so rebounds scatter. This causes most of the "
            "differences below; located contact avoids it."
        )
    elif summary.get("model") == "bullet":
        parts.append(
            "The run moved rigid bodies in PyBullet and located every contact on the true flank surfaces. Agreement of "
            "both verifies the location of contacts."
        )
    parts.append(
        "Both use the drag and the restitution of the scenario: agreement does not validate these for a test rig."
    )
    return " ".join(parts)


def verdict(comparison: dict[str, Any] | None) -> str:
    """Return in one sentence how well run and rigid model agree."""
    if not comparison:
        return (
            "The result is not verified: no second model was run "
            "(runs with --model bullet are compared with the rigid model)."
        )
    missed, invented = comparison.get("impacts_missed"), comparison.get("impacts_invented")
    count, median = comparison.get("impacts_compared"), comparison.get("velocity_error_median")
    if comparison.get("mode") == "distribution":
        return (
            "The motion is chaotic: run and rigid model are compared by the statistics of their impacts, not impact by "
            "impact."
        )
    matched = comparison.get("impacts_matched")
    text = f"Verification: the run reproduces {matched} of {count} impacts of the independent rigid model"
    text += f" ({missed} missed, {invented} spurious)"
    if median is not None:
        p95 = figure(comparison.get("velocity_error_p95"), "ratio", 3).text
        text += f"; impact speeds differ by {figure(median, 'ratio', 3).text} (median) and {p95} (95th percentile)"
    return text + "."


class Line(NamedTuple):
    """One line of the table of what was simulated.

    Args:
        group: section of the scenario.
        name: the quantity in words.
        value: its value with unit.
    """

    group: str
    name: str
    value: str


# Names of the keys of a scenario.
NAMES = {
    "gears": "Gears",
    "gears.module": "module (normal)",
    "gears.pressure_angle": "pressure angle",
    "gears.helix_angle": "helix angle",
    "gears.face_width": "face width",
    "gears.drive": "drive gear",
    "gears.loose": "loose gear",
    "mount": "Mounting",
    "mount.backlash": "backlash along the line of action",
    "mount.centre_distance": "centre distance",
    "motion": "Drive motion",
    "motion.mean": "mean speed",
    "motion.harmonics": "fluctuation",
    "motion.record": "measured motion",
    "motion.bandwidth": "bandwidth of smoothing",
    "drag": "Drag",
    "drag.torque": "Coulomb torque on the loose gear",
    "impact": "Impact",
    "impact.restitution": "coefficient of restitution",
    "impact.stick_velocity": "no rebound below",
    "start": "Start",
    "start.state": "flank touching at the start",
    "run": "Run",
    "run.duration": "duration",
    "run.settle": "excluded as settling",
    "run.output_rate": "output rate",
    "run.seed": "random seed",
    "sensors": "Sensors",
    "effect": "Effects",
    "expect": "Expected",
}


PASSED_OVER = ("format", "title", "source", "extends")


def parse(document: str) -> dict[str, Any]:
    """Return a scenario's text as a dictionary; empty where it is not valid TOML."""
    try:
        return tomllib.loads(document)
    except tomllib.TOMLDecodeError:
        return {}


def table(document: str) -> list[Line]:
    r"""Return every value of a scenario as a line of a table.

    >>> table('[mount]\nbacklash = "250 um"')
    [Line(group='Mounting', name='backlash along the line of action', value='250 µm')]
    """
    lines = []
    for section, content in sorted(parse(document).items(), key=_place_of):
        if section in PASSED_OVER:
            continue
        group = NAMES.get(section, section)
        if section == "effect":
            lines += [Line(group, words_of(str(one.get("kind", "?"))), inline(one, ("kind",))) for one in content]
        elif isinstance(content, dict):
            lines += [
                Line(group, NAMES.get(f"{section}.{key}", words_of(key)), inline(value))
                for key, value in sorted(content.items(), key=lambda item: _place_of((f"{section}.{item[0]}", None)))
                if value not in ({}, [])
            ]
        else:
            lines.append(Line(group, words_of(section), inline(content)))
    return lines


def _place_of(item: tuple[str, Any]) -> int:
    order = list(NAMES)
    return order.index(item[0]) if item[0] in order else len(order)


def inline(value: Any, without: tuple[str, ...] = ()) -> str:
    """Return a TOML value as running text.

    >>> inline([{"amplitude": "20 rpm", "frequency": "3 Hz"}])
    'amplitude 20 rpm, frequency 3 Hz'
    >>> inline({"value": "0.22 N m", "uncertainty": "5 %"})
    '0.22 N m ± 5 %'
    """
    if isinstance(value, dict):
        if value.keys() == {"value", "uncertainty"}:
            return f"{value['value']} ± {value['uncertainty']}"
        return ", ".join(_named(key, one) for key, one in value.items() if key not in without)
    if isinstance(value, list):
        return "; ".join(inline(one) for one in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return pretty(str(value).replace("_sided", "-sided").replace("_", " "))


def _named(key: str, value: Any) -> str:
    return f"{value} teeth" if key == "teeth" else f"{words_of(key)} {inline(value)}"


def words_of(key: str) -> str:
    """Return a key as words."""
    return key.replace("_", " ")


def sentence(document: str) -> str:
    r"""Return two or three sentences that describe the scenario.

    >>> sentence('[motion]\nmean = "30 rpm"')
    'The drive gear rotates at a mean speed of 30 rpm. The loose gear has no load torque.'
    """
    data = parse(document)
    gears, motion = data.get("gears", {}), data.get("motion", {})
    parts = [_gears(gears, data.get("mount", {})), _motion(motion), _loose(data)]
    return " ".join(part for part in parts if part)


def rig_sentence(document: str) -> str:
    r"""Return the gears, drag and restitution of a rig in one or two sentences, without motion and effects.

    >>> rig_sentence('[drag]\ntorque = "0.2 N m"')
    'The loose gear is unloaded except for a drag torque of 0.2 N·m.'
    """
    data = parse(document)
    parts = [_gears(data.get("gears", {}), data.get("mount", {})), _loose({**data, "effect": []})]
    return " ".join(part for part in parts if part)


def _gears(gears: dict[str, Any], mount: dict[str, Any]) -> str:
    teeth = [gears.get(one, {}).get("teeth") for one in ("drive", "loose")]
    if None in teeth:
        return ""
    kind = "helical" if re.search(r"[1-9]", str(gears.get("helix_angle", 0)).split(" ")[0]) else "spur"
    module = f" of module {_length(gears['module'])}" if "module" in gears else ""
    gap = (
        f"a backlash of {_length(mount['backlash'])}"
        if "backlash" in mount
        else f"a centre distance of {inline(mount['centre_distance'])}"
        if "centre_distance" in mount
        else "backlash"
    )
    return f"Two {kind} gears{module} with {teeth[0]} and {teeth[1]} teeth mesh with {gap}."


def _length(text: Any) -> str:
    """Return a length of a scenario in the unit in which it is read best."""
    try:
        return pretty(show(quantity(text, "length"), "length", 4))
    except InputError:  # with an uncertainty
        return inline(text)


def _motion(motion: dict[str, Any]) -> str:
    if "record" in motion:
        return f"The drive gear follows a measured motion ({inline(motion['record'])})."
    if "mean" not in motion:
        return ""
    text = f"The drive gear rotates at a mean speed of {inline(motion['mean'])}"
    waves = [_harmonic(one) for one in motion.get("harmonics", [])]
    if waves:
        text += " with a fluctuation of " + " and ".join(waves)
    return text + "."


def _harmonic(one: dict[str, Any]) -> str:
    how = f"at {inline(one['frequency'])}" if "frequency" in one else f"at order {inline(one.get('order', '?'))}"
    return f"{inline(one.get('amplitude', '?'))} {how}"


def _loose(data: dict[str, Any]) -> str:
    drag, impact = data.get("drag", {}), data.get("impact", {})
    if "torque" in drag:
        text = f"The loose gear is unloaded except for a drag torque of {inline(drag['torque'])}"
    else:
        text = "The loose gear has no load torque"
    if "restitution" in impact:
        text += f"; the coefficient of restitution is {inline(impact['restitution'])}"
    extra = [words_of(str(one.get("kind", "?"))) for one in data.get("effect", [])]
    if extra:
        text += "; additional effects: " + ", ".join(extra)
    return text + "."


# Meaning of each regime.
REGIMES = {
    "contact": "The active flanks stay in contact: the loose gear does not rattle",
    "single_sided": "The loose gear bounces on one flank (single-sided impacts) and never crosses the backlash",
    "double_sided": "The loose gear rattles: it crosses the backlash and impacts both flanks (double-sided impacts)",
}


# Name and meaning of each result.
LINES = {
    "regime": ("regime", "contact, single-sided or double-sided impacts, after settling"),
    "motion": ("periodicity", "1T repeats every period of the drive's fluctuation, 2T every second one, and so on"),
    "impacts": ("impacts", "after settling; very low bounces are not counted"),
    "impacts_per_period": ("impacts per period", "per period of the fluctuation of the drive speed"),
    "active_impacts": ("impacts on the active flank", ""),
    "active_velocity_mean_m_s": (
        "mean impact velocity, active flank",
        "negative by convention: towards the active flank",
    ),
    "active_velocity_std_m_s": ("standard deviation", "of these, over all bounces"),
    "reverse_impacts": ("impacts on the reverse flank", ""),
    "reverse_velocity_mean_m_s": ("mean impact velocity, reverse flank", "positive by convention"),
    "reverse_velocity_std_m_s": ("standard deviation", "of these, over all bounces"),
    "active_restitution": (
        "effective restitution, active flank",
        "square root of the kinetic energy after over before the impact",
    ),
    "reverse_restitution": ("effective restitution, reverse flank", "same definition"),
    "active_energy_J_s": ("power lost in impacts, active flank", "kinetic energy of the relative motion, per second"),
    "reverse_energy_J_s": ("power lost in impacts, reverse flank", "same definition"),
    "excitation": (
        "excitation Λ",
        "inertia torque of the fluctuation over the base drag, without effects; rigid teeth lose contact above 1",
    ),
}


# Shares of time.
SHARES = {
    "active_share": "in permanent contact with the active flank",
    "reverse_share": "in permanent contact with the reverse flank",
    "flight_share": "in flight, bounces included",
}


def _speed_figure(velocity: float | None) -> Figure:
    """Return a velocity as a speed; its bare value keeps the sign."""
    if velocity is None:
        return figure(None)
    return Figure(figure(abs(velocity), "velocity").text, velocity)


def lines(scenario: Scenario, recording: Recording, summary: dict[str, Any]) -> list[Claim]:
    """Return the table of results."""
    found = [
        Claim(key, name, figure(summary.get(key), kind_of(key)), meaning) for key, (name, meaning) in LINES.items()
    ]
    found = [line for line in found if line.figure.text != "–"]
    return found + _times(scenario, recording)


def _times(scenario: Scenario, recording: Recording) -> list[Claim]:
    """Return how long flights and contacts last and where the time is spent, after settling."""
    table = contacts(recording, scenario.rows(), scenario.rig().backlash)
    if table is None:
        return []
    start, end = window(recording.signals, recording.meta)
    told = times_of(recording.impacts, table, start, end)
    found = []
    for name, flights in crossings(recording, table, start).items():
        if len(flights):
            found += _crossing_lines(name, *flights.T)
    if not found and told["flights"]:
        meaning = f"the longest of {told['flights']} flights, from contact loss to the next impact"
        found.append(Claim("flight_longest_s", "longest flight", figure(told["flight_longest_s"], "time"), meaning))
        highest = figure(told["flight_height_max_m"], "length")
        if highest.value is not None:
            found.append(
                Claim(
                    "flight_height_max_m", "highest flight", highest, "largest distance from the flank where it began"
                )
            )
    for name in ("active", "reverse"):
        if told[f"{name}_contacts"]:
            key = f"{name}_contact_mean_s"
            meaning = f"mean of {told[f'{name}_contacts']}, from the last bounce to contact loss"
            found.append(Claim(key, f"contact on the {name} flank", figure(told[key], "time"), meaning))
    for key, name in SHARES.items():
        if told[key] is not None:
            found.append(Claim(key, f"time {name}", figure(told[key], "ratio", 3), ""))
    return found


def _crossing_lines(flank: str, times: np.ndarray, speeds: np.ndarray) -> list[Claim]:
    low, high = (figure(float(one), "time", 3).text for one in (times.min(), times.max()))
    slow, fast = (figure(float(one), "velocity", 3).text for one in (speeds.min(), speeds.max()))
    return [
        Claim(
            f"crossing_{flank}_m_s",
            f"first impact after a crossing, {flank} flank",
            figure(float(speeds.mean()), "velocity"),
            f"mean speed of {len(speeds)} impacts, without the bounces that follow; range {slow} to {fast}",
        ),
        Claim(
            f"crossing_{flank}_s",
            f"flight across, to the {flank} flank",
            figure(float(times.mean()), "time"),
            f"mean of {len(times)} flights across the backlash; range {low} to {high}",
        ),
    ]


def expectations(summary: dict[str, Any]) -> list[tuple[str, Figure, Figure, bool]]:
    """Return the expectations of the scenario: name, expected, found, whether it was met."""
    return [
        (key.replace("_", " "), figure(one["expected"]), figure(one["found"]), bool(one["met"]))
        for key, one in (summary.get("expect") or {}).items()
    ]


def wall_lines(summary: dict[str, Any]) -> list[tuple[str, Figure, Figure]]:
    """Return the wall times: name, time, speed as a multiple of real time."""
    reached = summary.get("reached_s") or 0.0
    return [
        (name, figure(float(t), "time", 3), figure(reached / t if t else None, digits=3))
        for name, t in (summary.get("wall_s") or {}).items()
    ]


def command(scenario: Scenario, summary: dict[str, Any]) -> str:
    """Return the command that repeats the run."""
    if summary.get("command"):
        return str(summary["command"])
    words = ["gears3d", "run", str(scenario.path or "scenario.toml")]
    if summary.get("model") not in (None, "bullet"):
        words += ["--model", str(summary["model"])]
    if summary.get("contact") == "native":
        words += ["--contact", "native"]
    return shlex.join(words)


def render(
    *,
    scenario: Scenario,
    recording: Recording,
    twin: Recording | None = None,
    summary: dict[str, Any],
    strip: Picture | None = None,
    files: tuple[str, ...] = (),
) -> str:
    """Return the page of a run as HTML that opens without a network.

    Args:
        scenario: that was simulated.
        recording: result of the run.
        twin: result of the rigid model, if it ran.
        summary: content of ``summary.json``.
        strip: pictures of the mesh over a period.
        files: names of files in the same folder.
    """
    data = blocks(scenario, recording, twin, summary)
    grouped = groupby(table(scenario.document), lambda line: line.group)
    made = {
        "version": summary.get("version"),
        "command": command(scenario, summary),
        "inputs": provenance([scenario.path])["inputs"],
    }
    return engine.render(
        "run.html.j2",
        head(scenario, summary),
        made,
        files,
        data,
        **{key: summary.get(key) for key in ("seed", "model", "contact")},
        partial=summary.get("status") != "complete",
        reached=figure(summary.get("reached_s"), "time"),
        duration=figure(recording.meta.get("duration_s"), "time"),
        sentence=sentence(scenario.document),
        verdict=verdict(summary.get("comparison")),
        question=[(group, list(lines)) for group, lines in grouped],
        outcome=lines(scenario, recording, summary),
        expect=expectations(summary),
        comparison=comparison_lines(summary.get("comparison")),
        shared=common_ground(summary),
        budget=budget_lines(summary.get("error_budget"), summary.get("contact") == "native"),
        wall=wall_lines(summary),
        document=scenario.document,
        mesh=mesh(scenario.pair()),
        paired=data["errors"] is not None,
        has_twin=twin is not None,
        has_impacts=bool(len(recording.impacts["time_s"])),
        strip=strip,
    )


def write(path: str | Path, **about: Any) -> Path:
    """Write the page of a run under a temporary name and rename it.

    Args:
        path: the file, e.g. ``report.html``.
        about: for :func:`render`.

    Raises:
        InputError: it cannot be written.
    """
    return write_text(path, render(**about))


def mesh(pair: Pair) -> Picture:
    """Return the mesh of a pair at true scale, and with its backlash drawn wider."""
    gap, factor = figure(pair.backlash, "length").text, widening(pair)
    words = f"Transverse section at true scale, and with the backlash of {gap} drawn {factor:g} times as wide"
    angle = plain(float(np.degrees(pair.working_pressure_angle)))
    caption = (
        "Transverse section, drive gear on the left. Blue: active flanks in contact; grey: gaps of a free flight. "
        f"Pressure angle α_wt {angle}°, contact ratio {plain(pair.contact_ratio)}, backlash {gap}: true to scale, and "
        f"right with teeth thinned until it is {factor:g} times as wide."
    )
    return Picture(section_svg(pair), words, caption)


def over_a_period(seen: Recording | Measurement, scenario: Scenario) -> Picture | None:
    """Return the mesh over a period in pictures; ``None`` where a recording is too short for them."""
    try:
        taken = camera(seen, scenario)
    except InputError:
        return None
    begin, lasts = taken.span
    what = "a period; " if scenario.motion.harmonics else ""
    caption = (
        f"From {begin:.6g} s over {1e3 * lasts:.4g} ms, {what}gap drawn {taken.look.factor:g} times its width. "
        "More pictures, and videos: gears3d camera."
    )
    return Picture(taken.svg(), taken.words(), caption)


def _periodicity(motion: str | None) -> Figure:
    """Return the name of the motion."""
    return Figure("not determined: run too short") if motion == "too_short" else figure(motion)


def head(scenario: Scenario, summary: dict[str, Any]) -> Head:
    """Return question, answer and key numbers: regime, impacts per period, speeds, agreement with the rigid model."""
    comparison = summary.get("comparison") or {}
    keys = [
        Key("regime", figure(summary.get("regime")), key="regime"),
        Key("periodicity", _periodicity(summary.get("motion")), key="motion"),
        Key("impacts per period", figure(summary.get("impacts_per_period"), digits=3), key="impacts_per_period"),
    ]
    for flank in ("active", "reverse"):
        scatter = summary.get(f"{flank}_velocity_std_m_s")
        width = "" if scatter is None else f"± {figure(scatter, 'velocity', 3).text} (standard deviation of impacts)"
        name, key = f"mean impact speed, {flank} flank", f"{flank}_velocity_mean_m_s"
        keys.append(Key(name, _speed_figure(summary.get(key)), width, key, flank))
    error, p95 = (figure(comparison.get(f"velocity_error_{one}"), "ratio", 3) for one in ("median", "p95"))
    below = "" if p95.value is None else f"95 % below {p95.text}"
    paired = comparison.get("mode") != "distribution"
    name = "impact speed error, median (compared with rigid model)"
    keys.append(Key(name, error, below if paired else "", "comparison.velocity_error_median"))
    wrong = [comparison.get(key) for key in ("impacts_missed", "impacts_invented")]
    unmet = any(not one["met"] for one in (summary.get("expect") or {}).values())
    bad = unmet or any(wrong) or summary.get("status") != "complete"
    return Head(
        "run", scenario.title or "Untitled scenario",
        "How does the loose gear move, and is the simulation verified?",
        f"{answer(summary)} {verdict(summary.get('comparison'))}".strip(),
        [key for key in keys if key.figure.text != "–"], "bad" if bad else "good" if comparison else "open",
        source=scenario.source,
    )  # fmt: skip


def answer(summary: dict[str, Any]) -> str:
    """Return regime, number and speeds of the impacts in a sentence."""
    if summary.get("status") == "partial" and summary.get("regime") is None:
        return f"The run ended at {summary['reached_s']:.4g} s, less than one period after settling: no regime."
    text, per_period = REGIMES.get(str(summary.get("regime")), ""), summary.get("impacts_per_period")
    speeds = {flank: summary.get(f"{flank}_velocity_mean_m_s") for flank in ("active", "reverse")}
    told = [f"{_speed_figure(speed).text} on the {flank} flank" for flank, speed in speeds.items() if speed is not None]
    if text and per_period and told:
        text += f", with {figure(per_period, digits=3).text} impacts per period; the mean impact speed is "
        text += " and ".join(told)
    return f"{text}." if text else ""

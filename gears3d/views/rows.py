"""Results as rows of text, (name, value): for terminals, notebooks and pages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.views.pages.engine import Key
from gears3d.views.plots.numbers import SUFFIXES, Figure, figure, kind_of, sized, spread

if TYPE_CHECKING:
    from gears3d.comparison import Comparison
    from gears3d.diagnosis.planner import Aim, MeasurementPlan, Option, Run
    from gears3d.identify import Identified
    from gears3d.recording import Recording
    from gears3d.simulation.excitation import Assessment
    from gears3d.sweep import Done

# Descriptions of motions whose name is not enough.
MOTIONS = {"too_short": "too short to determine the period", "quasi_periodic": "quasi-periodic"}


def regime_line(summary: dict[str, Any]) -> str:
    """Return regime and motion in words."""
    if summary["regime"] is None:
        return "not determined: less than one period after settling"
    motion = summary.get("motion")
    words = [str(summary["regime"]).replace("_", " "), MOTIONS.get(str(motion), motion)]
    return ", ".join(word for word in words if word)


def impacts_line(summary: dict[str, Any]) -> str:
    """Return the number of impacts, in total and per period."""
    per_period = summary.get("impacts_per_period")
    text = str(summary["impacts"])
    return text if per_period is None else f"{text} ({per_period:.3g} per period)"


def comparison_rows(found: Comparison) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value)."""
    verdict = "the same" if found.regime_equal else "different"
    regimes = " and ".join(dict.fromkeys(regime.replace("_", " ") for regime in found.regimes))
    lines = [("mode", found.mode), ("regime", f"{verdict} ({regimes})")]
    if found.mode == "trajectory":
        lines.append(("impacts", f"{found.impacts_matched} of {found.impacts_compared} matched"))
        lines.append(("", f"{found.impacts_missed} missed, {found.impacts_invented} invented"))
    else:
        lines.append(("impacts", f"{found.impacts_compared} in the reference, not paired"))
    median, p95, bias = found.velocity_error_median, found.velocity_error_p95, found.velocity_bias
    if median is not None and p95 is not None and bias is not None:
        what = "95 % below" if found.mode == "trajectory" else "of the 95th percentile"
        lines.append(("impact speed error", f"median {_percent(median)}, {what} {_percent(p95)}"))
        lines.append(("", f"bias {_percent(bias, '+')}"))
    if found.phase_error_median_cycles is not None:
        lines.append(("phase error", f"{found.phase_error_median_cycles:.2g} cycles"))
    for test in found.tests:
        word = "different" if test.different else "no difference found"
        power = f"; minimum detectable effect {_percent(test.detectable)}" if test.detectable else ""
        lines.append((test.quantity.replace(".", " "), f"{word} (p = {test.p_value:.2g}{power})"))
    if found.rate_ratio is not None:
        value, low, high = found.rate_ratio
        lines.append(("impacts per time, ratio", f"{value:.3f} ({low:.3f} to {high:.3f})"))
    lines.append(("counted", f"impacts after free flights higher than {found.flight_height_min_m * 1e6:.3g} µm"))
    return lines


def _percent(value: float, sign: str = "") -> str:
    return f"{100 * value:{sign}.2g} %"


def spectra_of(recording: Recording, count: int = 5) -> dict[str, Any]:
    """Return the strongest lines of the spectra of a recording, as JSON can hold them."""
    from gears3d.recording.record import spectra
    from gears3d.signals import lines

    out: dict[str, Any] = {}
    for name, one in spectra(recording).items():
        at = "frequency_Hz" if name == "frequency" else "order"
        out[name] = one and {
            "quantity": "displacement_m",
            f"resolution{'_Hz' if name == 'frequency' else ''}": one.resolution,
            "lines": [{at: where, "amplitude_m": high} for where, high in lines(one, count)],
        }
    return out


def recording_rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value); unknown values are excluded."""
    lines = [("regime", regime_line(found)), ("impacts after settling", impacts_line(found))]
    exponent, deviation = found["lyapunov_1_s"], found["lyapunov_std_1_s"]
    if exponent is not None:
        spread = f" ± {deviation:.2g}" if deviation is not None else ""
        lines.append(("largest Lyapunov exponent", f"{exponent:.3g}{spread} 1/s, of the {found['lyapunov_from']}"))
    for flank in ("active", "reverse"):
        lines += _flank(found, flank)
    if found["energy_J_s"] is not None:
        lines.append(("power dissipated by impacts", f"{found['energy_J_s'] * 1e3:.3g} mW"))
    if found["excitation"] is not None:
        lines.append(("excitation Λ, base drag", f"{found['excitation']:.3g}"))
    if found["flights"]:
        longest, high = found["flight_longest_s"] * 1e3, found["flight_height_max_m"]
        top = f", {high * 1e6:.4g} µm high" if high is not None else ""
        lines.append(("free flights", f"{found['flights']}, the longest {longest:.4g} ms{top}"))
    if found["flight_share"] is not None:
        parts = [f"{found[f'{one}_share']:.1%} {one}" for one in ("active", "reverse", "flight")]
        exact = "" if found["durations_from"] == "contacts" else " (from samples)"
        lines.append(("time", ", ".join(parts) + exact))
    return lines + _lines(found["spectra"])


def _flank(found: dict[str, Any], flank: str) -> list[tuple[str, str]]:
    speed = found[f"{flank}_velocity_mean_m_s"]
    if speed is None:
        return []
    square = found[f"{flank}_velocity_mean_square_m2_s2"]
    text = f"{abs(speed) * 1e3:.4g} mm/s mean, {square**0.5 * 1e3:.4g} mm/s rms"
    restitution, across = found[f"{flank}_restitution"], found[f"{flank}_crossing_mean_s"]
    if restitution is not None:
        text += f", restitution {restitution:.3g}"
    if across is not None:
        text += f"; crossings of the backlash last {across * 1e3:.4g} ms"
        hard = found[f"{flank}_crossing_velocity_mean_m_s"]
        text += f" and end with {abs(hard) * 1e3:.4g} mm/s" if hard is not None else ""
    return [(f"{flank} flank", text)]


def _lines(spectra: dict[str, Any]) -> list[tuple[str, str]]:
    names = {"frequency": "lines", "order_drive": "orders of the drive gear", "order_loose": "orders of the loose gear"}
    out = []
    for key, name in names.items():
        one = spectra[key]
        if one and one["lines"]:
            at, unit = ("frequency_Hz", " Hz") if key == "frequency" else ("order", "")
            shown = ", ".join(f"{line[at]:.4g}{unit} {line['amplitude_m'] * 1e6:.3g} µm" for line in one["lines"])
            out.append((name, shown))
    return out


def measurement_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value)."""
    from gears3d.measured.drive_motion import told

    quality, flights, flanks = summary["quality"], summary["cut"], summary["flanks"]
    lines = [
        ("record", f"{quality['samples']} samples, {quality['duration_s']:.6g} s, {quality['sample_rate_Hz']:.6g} Hz")
    ]
    for gear, one in quality["encoders"].items():
        counts = one["counts_per_revolution"]
        what = (
            f"{counts:.0f} counts per revolution, read as {one['read_as']}" if counts else "quantisation not detected"
        )
        lines.append((f"encoder, {gear}", what))
    if summary["status"] == "unexplained":
        return [("explained", "no: impacts, regime and backlash are withheld"), *lines, *_visible(summary)]
    lines.append(("noise", f"{_um(quality['noise_m'])} per reading, {_um(quality['noise_in_contact_m'])} in contact"))
    lines.append(("detected free flights", f"higher than {_um(quality['flight_height_min_m'])}"))
    if flanks["backlash_m"] is None:
        lines.append(("backlash", "not measured: no contact with the reverse flank"))
    else:
        low, high = flanks["backlash_m"]["ci95"]
        lines.append(("backlash", f"{_um(flanks['backlash_m']['value'])} (95 %: {1e6 * low:.5g} to {1e6 * high:.5g})"))
    for place, orders in flanks["orders"].items():
        strong = sorted(orders, key=lambda one: -one["amplitude_m"])[:3]
        shown = ", ".join(
            f"{_um(one['amplitude_m'])} at order {one['order']} of the {one['gear']}"
            + (" (in step with the fluctuation: may be part of the mean)" if one.get("in_step") else "")
            for one in strong
        )
        lines.append((f"{place}, orders", shown))
    lines.append(("drive", told(summary["drive_motion"])))
    lines.append(("regime", str(summary["regime"]).replace("_", " ")))
    for name in ("active", "reverse"):
        speed = summary[f"{name}_velocity_mean_m_s"]
        mean = "" if speed is None else f", mean {1e3 * speed:.4g} mm/s"
        lines.append((f"impacts, {name}", f"{summary[f'{name}_impacts']}{mean}"))
    lines.append(
        ("free flights", f"{flights['whole_flights']} complete, {flights['testifying']} pass the goodness-of-fit test")
    )
    dropped = ", ".join(f"{count} {why.replace('_', ' ')}" for why, count in flights["dropped"].items() if count)
    lines.append(("excluded", dropped or "nothing"))
    slowing = flights["deceleration_median_rad_s2"]
    if slowing is not None:
        lines.append(("deceleration in free flight", f"{slowing:.4g} rad/s^2 (median)"))
    return lines


def _um(length: float) -> str:
    return f"{1e6 * length:.4g} um"


def _visible(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines of a record that is not explained: what it shows without a segmentation."""
    seen = summary["visible"]
    lines = [("noise", f"{_um(summary['quality']['noise_m'])} per reading")]
    ratio, gears = seen["ratio_loose_over_drive"], seen["ratio_of_base_radii"]
    shown = "not known" if ratio is None else f"{ratio:.6g}"
    lines.append(("ratio, loose over drive", f"{shown} in the record, {gears:.6g} of the rig"))
    lines.append(("mean speed, drive", f"{seen['drive_speed_mean_rad_s']:.5g} rad/s"))
    lines.append(
        ("displacement, range", f"{_um(seen['displacement_range_m'])}, drift {_um(seen['drift_m_s'])} per second")
    )
    strong = [f"{_um(one['amplitude_m'])} at order {one['order']} of the {one['gear']}" for one in seen["orders"][:3]]
    lines.append(("displacement, orders", ", ".join(strong) or "none exceeds the noise"))
    return lines


def assessment_rows(found: Assessment) -> Iterator[tuple[str, str, str]]:
    """Return the table's lines: name, symbol, value."""
    from gears3d.units import show

    yield "mass on the line of action", "m", show(found.mass_kg, "mass")
    for part in found.drag:
        gate = "" if part["acts"] == "always" else f" ({part['acts']} only)"
        yield f"drag at the mean speed: {part['source']}{gate}", "", show(part["torque_N_m"], "torque")
    yield "drag in contact", "Td", show(found.drag_torque_N_m, "torque")
    yield "drag on the line of action", "F", show(found.drag_force_N, "force")
    yield "deceleration by the drag alone", "Td/J", show(found.deceleration_rad_s2, "acceleration")
    yield "backlash", "j", show(found.backlash_m, "length")
    if found.backlash_narrowest_m != found.backlash_m:
        yield "backlash at its narrowest", "", show(found.backlash_narrowest_m, "length")
    for wave in found.harmonics:
        speed, frequency = show(wave.amplitude_rad_s, "speed"), show(wave.frequency_Hz, "frequency")
        yield f"{wave.source}: {speed} at {frequency}", "", ""
        yield "  amplitude on the line of action", "H", show(wave.stroke_m, "length")
        yield "  excitation", "Λ", f"{wave.excitation:.4g}"
        yield "  dimensionless backlash", "j/H", f"{wave.backlash_dimensionless:.4g}"
        threshold = show(wave.threshold_amplitude_rad_s, "speed", 4), show(wave.threshold_frequency_Hz, "frequency", 4)
        yield "  threshold Λ = 1", "", f"{threshold[0]} at this frequency, {threshold[1]} at this amplitude"
    yield "largest deceleration of the combined motion", "", show(found.deceleration_largest_rad_s2, "acceleration")
    yield "excitation of the combined motion", "Λ", f"{found.excitation_total:.4g}"


def law_rows(found: Identified) -> list[tuple[str, str]]:
    """Return the parameters of a law with their 95 % intervals."""
    rows = [("law", found.law)]
    for name, one in found.parameters.items():
        shown, interval = spread(one.value, one.low, one.high, one.unit)
        rows.append((name, f"{shown.text} {interval}"))
    return rows


# Parameters of laws in words, where the name is not enough.
PARAMETERS = {
    "coulomb": "Coulomb torque",
    "viscous": "viscous coefficient",
    "restitution": "coefficient of restitution",
    "standard_deviation": "scatter of the restitution",
}


def parameter_words(name: str) -> str:
    """Return the name of a parameter in words."""
    return PARAMETERS.get(name, name.replace("_", " "))


# Measures of fit in words, where the name is not enough.
GOODNESS = {
    "residual_over_noise": "residual over noise of single readings",
    "p_structure": "p-value: residual without pattern",
    "chi2": "χ² per degree of freedom",
    "held_out": "held-out loss (smaller is better)",
    "pairs": "pairs of approach and rebound used",
    "approach_m_s": "approach speeds",
    "points": "readings used",
    "errors_over_stated": "scatter over stated errors",
}


def goodness_rows(goodness: dict[str, Any], place: str = "") -> list[tuple[str, str]]:
    """Return how well a law fits and predicts, as rows; long lists and what was not determined are omitted."""
    rows = []
    for key, value in goodness.items():
        words = key.removesuffix(next((end for end, _ in SUFFIXES if key.endswith(end)), "")).replace("_", " ")
        name = f"{place}{GOODNESS.get(key, words)}"
        if key == "held_out" and isinstance(value, dict):
            losses = ", ".join(f"{law} {loss:.3g}" for law, loss in value.items() if loss is not None)
            rows.append((name, losses))
        elif isinstance(value, dict) and "value" in value:
            low, high = value.get("ci95") or (value["value"], value["value"])
            shown, interval = spread(value["value"], low, high, value.get("unit", ""))
            rows.append((name, f"{shown.text} {interval}"))
        elif isinstance(value, dict) and not place:
            rows += goodness_rows(value, f"{name}: ")
        elif isinstance(value, list) and len(value) == 2 and all(isinstance(one, float) for one in value):
            rows.append((name, " to ".join(figure(one, kind_of(key)).text for one in value)))
        elif value is not None and not isinstance(value, dict | list):
            rows.append((name, figure(value, kind_of(key)).text))
    return rows


def sweep_answer(done: Done) -> tuple[str, str, list[Key]]:
    """Return title, answer and key numbers of a sweep: regimes, and the range of the impact speeds."""
    from gears3d.signals.impacts import REGIMES
    from gears3d.sweep.dataset import open_dataset
    from gears3d.sweep.drawing import axes_of

    with open_dataset(done.place) as data:
        varied = []
        for name in axes_of(data):
            values, attrs = data[name].values, data[name].attrs
            unit = attrs.get("units", "1")
            ends = f"{values.min():.4g} to {values.max():.4g}" + (f" {unit}" if unit != "1" else "")
            varied.append((str(attrs.get("long_name", name)), ends))
        parts, keys, count = [], [], done.counts.get("done", 0)
        if "regime" in data:
            codes = data["regime"].values.ravel()
            codes = codes[np.isfinite(codes)].astype(int)
            told = {REGIMES[code].replace("_", " "): int((codes == code).sum()) for code in np.unique(codes)}
            parts += [f"{name} at {times} of {codes.size} points" for name, times in told.items()]
            keys += [Key(f"points: {name}", figure(times)) for name, times in told.items()]
        for flank in ("active", "reverse"):
            if (name := f"{flank}_velocity_mean_m_s") in data and np.isfinite(data[name].values).any():
                speeds = np.abs(data[name].values[np.isfinite(data[name].values)])
                low, high = (figure(float(end), "velocity", 3).text for end in (speeds.min(), speeds.max()))
                ends = f"{low} at all points" if low == high else f"{low} to {high}"
                keys.append(Key(f"mean impact speed, {flank} flank", Figure(ends), tone=flank))
                parts.append(f"mean impact speed on the {flank} flank {ends}")
    title = "Sweep over " + (" and ".join(name for name, _ in varied) or "its cases")
    over = " and ".join(f"{name} from {ends}" for name, ends in varied)
    what = "; ".join(parts) if parts else f"{count} of {done.plan.size} points done"
    answer = f"{what[:1].upper()}{what[1:]}{f', for {over}' if over else ''}."
    return title, answer, keys


def plan_answer(found: MeasurementPlan) -> str:
    """Return what the runs of a plan come to, a sentence for each kind of encoders."""
    told = []
    for option in found.options:
        runs, lasts = len(option.runs), sum(one.duration for one in option.runs)
        many = f"{runs} run{'s' if runs != 1 else ''}, {figure(lasts, 'time').text} in all"
        lost = [one.name for one in option.aims if not one.possible]
        short = [one.name for one in option.aims if one.possible and not one.reached]
        word = f"{many}, reach{'' if runs != 1 else 'es'} all that is asked for" if option.reached else many
        word += f"; not reached: {', '.join(short)}" if short else ""
        word += f"; not observable, or not separable, in any of these runs: {', '.join(lost)}" if lost else ""
        told.append(f"With encoders of {option.encoder}: {word}.")
    return " ".join(told)


def plan_rows(option: Option) -> list[tuple[str, str]]:
    """Return the runs for one kind of encoders, and what they come to, as (name, value)."""
    rows = [("encoders", str(option.encoder))]
    for k, run in enumerate(option.runs, 1):
        rows.append((f"run {k}", f"{run.name}, {figure(run.duration, 'time').text}"))
        rows += [(f"   {name}", f"{alone} alone, {both} with those before") for name, alone, both in interval_rows(run)]
        rows += [(f"   {name}", f"{value:.3g} sigma apart, alone") for name, value in run.apart.items()]
    rows += [aim_row(one) for one in option.aims]
    return [*rows, ("no further run", option.ended)] if option.ended else rows


def interval_rows(run: Run) -> Iterator[tuple[str, str, str]]:
    """Yield name and 95 % interval of each parameter, from a run alone, and from it and those before it."""
    for kind, own in run.alone.items():
        for name, one in own.items():
            both = run.together.get(kind, {}).get(name)
            yield f"{kind} {name}", _half(one), _half(both) if both is not None else ""


def _half(one: Any) -> str:
    """Return half of an interval with its unit."""
    half = 0.5 * (one.high - one.low)
    return f"± {sized(half, one.unit).text}" if np.isfinite(half) else "not observable"


def aim_row(one: Aim) -> tuple[str, str]:
    """Return what all runs come to for one cause, or one pair of sets."""
    pair = " or " in one.name
    if not one.possible:
        return one.name, "not separable in any of these runs" if pair else "not observable in any of these runs"
    word = "reached" if one.reached else "not reached"
    if pair:
        return one.name, f"{one.value:.3g} sigma apart, {one.asked:.3g} asked for: {word}"
    value, asked = (figure(each, "ratio", 3).text for each in (one.value, one.asked))
    return one.name, f"{value} of its unit size shows at 5 sigma, {asked} asked for: {word}"

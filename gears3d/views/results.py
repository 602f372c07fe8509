"""Results of every kind as a folder, a page and a picture: the one way in which they leave gears3d."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import UsageError
from gears3d.files import replacing, write_picture, write_text
from gears3d.provenance import provenance
from gears3d.results import Result
from gears3d.runs.folder import refuse_foreign
from gears3d.views.pages.engine import Key
from gears3d.views.plots.numbers import figure, spread

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.bench import Drops, Rundown, StaticError, Thresholds
    from gears3d.comparison import Comparison, ModelVerdict
    from gears3d.diagnosis import Diagnosis, MeasurementPlan
    from gears3d.identify import Identified
    from gears3d.measured.segmentation import Measurement
    from gears3d.recording import Recording
    from gears3d.simulation.excitation import Assessment
    from gears3d.sweep import Done
    from gears3d.views.camera import Strip
    from gears3d.views.sheet import DataSheet


def save(
    result: Any, folder: Path, *, scenario: Any = None, command: str = "", inputs: Iterable[str | Path | None] = ()
) -> Path:
    """Write a folder with the page, the numbers, the data and a picture.

    Args:
        result: of any kind.
        folder: created if missing; files of these names in it are replaced.
        scenario: written as ``scenario.toml`` if given.
        command: for the provenance.
        inputs: files that went in, for the provenance.

    Returns:
        The folder.

    Raises:
        InputError: it cannot be written.
    """
    told = contents(result)
    if told.name == "summary" and folder.exists():
        refuse_foreign(folder)  # summary.json marks a folder that a later run may replace
    made = provenance(inputs, command)
    for name, write in told.tables.items():
        with replacing(folder / name) as unfinished:
            write(unfinished)
    if scenario is not None:
        write_text(folder / "scenario.toml", scenario.document)
    if told.draw is not None:
        write_picture(folder / (told.picture or f"{told.name}.png"), told.draw)
    text = json.dumps({**told.data, "provenance": made}, indent=2, ensure_ascii=False, allow_nan=False)
    write_text(folder / f"{told.name}.json", text + "\n")
    files = [f"{told.name}.json", *told.tables, *told.present, *(["scenario.toml"] if scenario is not None else [])]
    write_text(folder / "report.html", _page(told, made, tuple(files)))
    return folder


def report(result: Any, command: str = "") -> str:
    """Return the page of a result.

    Args:
        result: of any kind.
        command: for the provenance.
    """
    return _page(contents(result), provenance((), command), ())


def page(result: Any, made: dict[str, Any], files: tuple[str, ...]) -> str:
    """Return the page of a result with its provenance and links to files in the same folder."""
    return _page(contents(result), made, files)


def plot(result: Any, file: Path | None = None) -> Figure:
    """Return a result as a picture, and write it if a file is named.

    Args:
        result: of any kind.
        file: ends in ``.png``, ``.svg`` or ``.pdf``.

    Raises:
        UsageError: there is nothing to draw, or the ending is another.
        InputError: the file cannot be written.
    """
    from gears3d.errors import UsageError

    draw = contents(result).draw
    if draw is None:
        raise UsageError(f"{type(result).__name__}: there is nothing to draw")
    figure = draw()
    if file is not None:
        write_picture(file, lambda: figure)
    return figure


# Bytes of a picture up to which a page has it as lines; a larger one becomes pixels.
MOST_VECTOR = 400_000


def _page(told: Contents, made: dict[str, Any], files: tuple[str, ...]) -> str:
    """Return the page: charts where the pictures are lines, points and bands, else the first picture itself."""
    from gears3d.views.pages import engine
    from gears3d.views.pages.charts import charts_of

    if told.page is not None:
        return told.page(made, files)
    head = engine.Head(told.about, told.title, told.question, told.answer, told.keys, told.tone, told.verdict,
                       told.source, [note[:1].upper() + note[1:] for note in told.notes if note])  # fmt: skip
    charts: dict[str, Any] = {}
    pictures = []
    for number, draw in enumerate([] if told.draw is None else [told.draw, *told.more]):
        figure = draw()
        if (found := charts_of(figure)) is None:
            pictures.append(engine.Picture(_saved(figure), told.words or told.question))
        else:
            charts |= {f"{number}-{name}": chart for name, chart in found.items()}
    return engine.render(
        "result.html.j2", head, made, files, charts=charts, pictures=pictures, words=told.words or told.question,
        rows=[(name, value) for name, value in told.rows if value],
        trust=[(name, value) for name, value in told.trust if value], snippet=told.snippet,
    )  # fmt: skip


def _saved(figure: Figure) -> str | bytes:
    """Return a figure as SVG text, or as PNG where that is large."""
    file = BytesIO()
    figure.savefig(file, format="svg")
    if len(file.getvalue()) <= MOST_VECTOR:
        return file.getvalue().decode()
    file = BytesIO()
    figure.savefig(file, format="png", dpi=130)
    return file.getvalue()


Writer = Callable[[Path], object]


@dataclass(frozen=True)
class Contents:
    """Content of a result.

    Args:
        name: stem of its JSON file and its picture.
        about: what it is, two words.
        title: of the page.
        question: that it answers, a sentence.
        answer: a sentence.
        rows: numbers as text, (name, value).
        data: what JSON can hold.
        draw: gives its picture; ``None`` without one.
        words: description of the picture.
        tables: writers of its data, by file name.
        notes: what weakens it, a sentence each.
        keys: key numbers of the answer.
        trust: what supports it and what was excluded, (name, value).
        tone: ``good``, ``open`` or ``bad``.
        verdict: in a word or two, where it has a name.
        more: give further pictures of its page.
        present: names of files that its folder has already.
        snippet: TOML for a scenario.
        source: of the scenario.
        picture: name of its picture; ``name`` with ``.png`` if empty.
        page: gives its own page for provenance and file names; the common page is used without.
    """

    name: str
    about: str
    title: str
    question: str
    answer: str
    rows: Sequence[tuple[str, str]]
    data: dict[str, Any]
    draw: Callable[[], Figure] | None = None
    words: str = ""
    tables: Mapping[str, Writer] = field(default_factory=dict)
    notes: Sequence[str] = ()
    snippet: str = ""
    source: str = ""
    picture: str = ""
    page: Callable[[dict[str, Any], tuple[str, ...]], str] | None = None
    keys: Sequence[Key] = ()
    trust: Sequence[tuple[str, str]] = ()
    tone: str = ""
    verdict: str = ""
    more: Sequence[Callable[[], Figure]] = ()
    present: Sequence[str] = ()


@dataclass(frozen=True)
class Told(Result):
    """A result of a verb that has no class of its own.

    Args:
        contents: of it.
    """

    contents: Contents


def contents(result: Any) -> Contents:
    """Return the content of a result.

    Args:
        result: of a class that is listed in ``KINDS``.

    Raises:
        UsageError: it is of no such class.
    """
    for one in type(result).__mro__:
        if one.__name__ in KINDS:
            return KINDS[one.__name__](result)
    raise UsageError(f"{type(result).__name__} is not a result that has a report")


def _words(text: str | None) -> str:
    return str(text or "").replace("_", " ")


def _signals(recording: Recording) -> dict[str, Writer]:
    from gears3d.recording.files import IMPACTS, SIGNALS, write_parquet

    return {
        SIGNALS: lambda path: write_parquet(recording.signals, recording.meta, path),
        IMPACTS: lambda path: write_parquet(recording.impacts, recording.meta, path),
    }


def _table(columns: Mapping[str, Any]) -> Writer:
    def write(path: Path) -> None:
        with path.open("w", newline="", encoding="utf-8") as file:
            out = csv.writer(file)
            out.writerow(columns)
            out.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))

    return write


def recording(result: Recording) -> Contents:
    """Return the content of a recording: what its motion is."""
    from gears3d.recording import describe
    from gears3d.views.plots.pictures import recording_picture
    from gears3d.views.rows import impacts_line, recording_rows, regime_line, spectra_of

    found = {**describe(result), "spectra": spectra_of(result)}
    has_path = "displacement_m" in result.signals
    return Contents(
        "summary",
        "recording",
        str(result.meta.get("title") or "Recording"),
        "How does the loose gear move, and how do the flanks meet?",
        f"{regime_line(found)}; impacts after settling: {impacts_line(found)}.",
        recording_rows(found),
        found,
        (lambda: recording_picture(result)) if has_path else None,
        "Displacement over the last periods, Poincaré sections, return map and spectra of the displacement",
        _signals(result),
        source=str(result.meta.get("source") or ""),
        keys=[
            Key("regime", figure(found["regime"])),
            Key("impacts per period", figure(found["impacts_per_period"], digits=3)),
            *(Key(f"mean impact speed, {flank} flank", figure(abs(found[f"{flank}_velocity_mean_m_s"]), "velocity"),
                  tone=flank)
              for flank in ("active", "reverse") if found[f"{flank}_velocity_mean_m_s"] is not None),
        ],
    )  # fmt: skip


def comparison(result: Comparison) -> Contents:
    """Return the content of a comparison."""
    from gears3d.comparison import picture
    from gears3d.views.rows import comparison_rows

    tested, reference = result.tested, result.reference
    draw = None if tested is None or reference is None else lambda: picture(result, tested, reference)
    size = result.velocity_error_median
    error = "" if size is None else f"; median error of impact speeds {100.0 * size:.2g} %"
    if result.mode == "trajectory":
        counts = f"{result.impacts_matched} of {result.impacts_compared} impacts matched"
    else:
        different = [test.quantity.replace(".", " ") for test in result.tests if test.different]
        counts = f"distributions differ: {', '.join(different)}" if different else "no difference of distributions"
    return Contents(
        "comparison",
        "comparison",
        "Comparison of two recordings",
        "Do both recordings move in the same way?",
        f"Regime {'the same' if result.regime_equal else 'different'}; {counts}{error}.",
        comparison_rows(result),
        result.details(),
        draw,
        "Displacement of both recordings, and the impact speeds of one over those of the other",
        notes=result.notes,
        keys=[
            Key("same regime", figure(result.regime_equal)),
            Key("impacts matched", figure(result.impacts_matched)),
            Key("impact speed error, median", figure(size, "ratio", 3)),
        ],
        tone="good" if result.regime_equal and not (result.impacts_missed or result.impacts_invented) else "open",
    )


def model(result: ModelVerdict) -> Contents:
    """Return the content of a verdict on a user's own model."""
    from gears3d.comparison.verdict import rows_of
    from gears3d.views.plots.pictures import verdict_picture

    return Contents(
        "verdict", "model check", str(result.reference.meta.get("title") or "Own lumped model"),
        "Does the model simulate the scenario as the rigid model does?",
        result.sentence[:1].upper() + result.sentence[1:] + ".", rows_of(result.findings), result.to_dict(),
        lambda: verdict_picture(result), "Displacement of model and rigid model, and differences over tolerance",
        _signals(result.tested), tone="good" if result.verdict == "equal" else "bad",
        verdict=result.verdict.replace("_", " "),
    )  # fmt: skip


def law(result: Identified) -> Contents:
    """Return the content of an identified law."""
    from gears3d.identify import picture_of
    from gears3d.views.rows import goodness_rows, law_rows, parameter_words

    name = LAWS.get(result.law, _words(result.law.replace("+", " and ")))
    keys = []
    for each, one in result.parameters.items():
        shown, interval = spread(one.value, one.low, one.high, one.unit)
        keys.append(Key(parameter_words(each), shown, interval))
    told = ", ".join(f"{key.name} {key.figure.text} {_aside(key.interval)}" for key in keys[:2])
    own = told if name in told else f"{name}: {told}"
    answer = f"{own[:1].upper()}{own[1:]}." if told else f"No law: {name}."
    noise = result.goodness.get("residual_over_noise")
    if noise is not None:
        fits = "the law fits within the noise" if noise <= 1.5 else "more than noise remains"
        answer += f" The residual is {noise:.3g} times the noise of single readings: {fits}."
    return Contents(
        "law", "identification", f"Identified: {name}",
        "Which law do the measurements follow, and how well are its parameters known?", answer, law_rows(result),
        result.to_dict(), lambda: picture_of(result), "Data, identified law with its 95 % band, and residual",
        {"law.toml": lambda path: path.write_text(result.snippet, encoding="utf-8")}, result.warnings, result.snippet,
        keys=keys[:6], trust=goodness_rows(result.goodness), tone="open" if result.warnings or not keys else "good",
    )  # fmt: skip


def _aside(interval: str) -> str:
    return interval if interval.startswith("±") else f"({interval})"


# Laws in words.
LAWS = {
    "coulomb": "Coulomb drag, independent of speed",
    "viscous": "viscous drag, proportional to speed",
    "coulomb+viscous": "Coulomb and viscous drag",
    "coulomb+power": "Coulomb drag and a power of the speed",
    "constant": "constant coefficient of restitution",
    "transmission_error": "transmission error of both flanks",
}


def assessment(result: Assessment) -> Contents:
    """Return the content of an assessment before any simulation."""
    from gears3d.views.plots.pictures import regime_map
    from gears3d.views.rows import assessment_rows

    expected = result.expected
    why = f": {expected.why}" if expected.why else ""
    lost = "Contact is lost" if result.excitation_total > 1.0 else "Contact is not lost"
    rows = [(f"{name.strip()} {symbol}".strip(), value) for name, symbol, value in assessment_rows(result)]
    return Contents(
        "excitation",
        "excitation",
        result.title or "Excitation",
        "Is contact lost, and which regime is to be expected?",
        f"{lost} (excitation Λ = {result.excitation_total:.4g}); expected regime: {figure(expected.regime).text}{why}.",
        rows,
        result.to_dict(),
        lambda: regime_map(result, result.title),
        "Map of regimes over excitation and dimensionless backlash with the operating point",
        notes=result.notes,
        keys=[
            Key("excitation", figure(result.excitation_total)),
            Key("expected regime", figure(expected.regime)),
            Key("drag in contact", figure(result.drag_torque_N_m, "torque")),
            Key("backlash", figure(result.backlash_m, "length")),
        ],
    )


def sheet(result: DataSheet) -> Contents:
    """Return the content of the data sheet of a pair."""
    from gears3d.views.sheet import drawing, rows, tables

    lines = [
        (f"{name} {symbol}".strip(), " | ".join(dict.fromkeys(texts)))
        for _, name, symbol, texts in rows(result.quantities)
    ]
    return Contents(
        "sheet",
        "data sheet",
        result.title or "Gear pair",
        "What is the geometry of the pair, in the terms of ISO 21771?",
        f"{result.pair.drive.teeth} and {result.pair.loose.teeth} teeth, backlash {1e6 * result.pair.backlash:.4g} µm "
        "along the transverse line of action.",
        lines,
        {"title": result.title, "source": result.source, "sheet": tables(result.quantities)},
        lambda: drawing(result.pair, result.title, result.speed),
        "Transverse section of the mesh, plane of action and sliding speed",
        source=result.source,
        keys=[
            Key("backlash", figure(result.pair.backlash, "length")),
            Key("contact ratio", figure(result.pair.contact_ratio)),
            Key("centre distance", figure(result.pair.centre_distance, "length", 6)),
        ],
    )


def measurement(result: Measurement) -> Contents:
    """Return the content of a segmented record, which has a page of its own."""
    from gears3d.views.pages.measured import durations, orders_told, render
    from gears3d.views.pages.run import over_a_period
    from gears3d.views.plots.pictures import measurement_picture
    from gears3d.views.rows import measurement_rows

    summary = {
        "file": "",
        "durations": durations(result),
        "contact_orders": orders_told(result),
        **result.summary,
        "version": None,
        "command": None,
    }
    summary["quality"] = {"findings": [], **summary["quality"]}
    strip = None if result.rig is None else over_a_period(result, result.rig)

    def page(made: dict[str, Any], files: tuple[str, ...]) -> str:
        from dataclasses import replace

        told = {**summary, "version": made["version"], "command": made["command"], "provenance": made}
        return render(replace(result, summary=told), files, strip)

    withheld = summary["status"] == "unexplained"
    regime = "withheld" if withheld else _words(summary["regime"])
    return Contents(
        "summary",
        "measured record",
        str(result.recording.meta.get("title") or summary["file"] or "Measured record"),
        "When were the flanks in contact, and how did they meet?",
        f"Regime: {regime}.",
        measurement_rows(summary),
        {key: value for key, value in summary.items() if key not in ("version", "command")},
        lambda: measurement_picture(result),
        "Displacement with flanks, contacts and free flights",
        _signals(result.recording),
        picture="measured.png",
        page=page,
    )


def diagnosis(result: Diagnosis) -> Contents:
    """Return the content of a diagnosis, which has a page of its own."""
    from gears3d.diagnosis import extended_text
    from gears3d.views.pages.diagnosed import render, sentence
    from gears3d.views.plots.pictures import diagnosis_picture

    told = result.to_dict()
    return Contents(
        "diagnosis",
        "diagnosis",
        result.extended.title or "Diagnosis",
        "Where do the records deviate from the rig, and why?",
        sentence(result, told),
        [(one.kind, one.evidence) for one in result.causes],
        told,
        lambda: diagnosis_picture(result),
        "Held-out error of rig and extended rig, and minimum detectable effects by place",
        {"extended.toml": lambda path: path.write_text(extended_text(result), encoding="utf-8")},
        [note.text for note in result.notes],
        page=lambda made, files: render(result, made, files),
    )


def measurement_plan(result: MeasurementPlan) -> Contents:
    """Return the content of a plan of runs to measure, each a scenario file."""
    from gears3d.views.plots.pictures import plan_picture
    from gears3d.views.rows import plan_answer, plan_rows

    scenarios = dict(result.scenarios())
    tables: dict[str, Writer] = {
        name: (lambda path, text=one.document: path.write_text(text, encoding="utf-8"))
        for name, one in scenarios.items()
    }
    excluded = [f"{name}: {why}" for option in result.options for name, why in option.excluded.items()]
    shown = any(run.reaches for option in result.options for run in option.runs)
    return Contents(
        "plan", "measurement plan", result.rig.title or "Runs to measure",
        "Which runs make the causes known, and how well?", plan_answer(result),
        [row for option in result.options for row in plan_rows(option)], result.to_dict(),
        (lambda: plan_picture(result)) if shown else None,
        "Smallest size that is seen at 5 sigma, in % of the unit size, over the number of runs",
        tables, notes=[f"not possible: {one}" for one in dict.fromkeys(excluded)],
        tone="good" if any(one.reached for one in result.options) else "open", source=result.rig.source,
    )  # fmt: skip


def static_error(result: StaticError) -> Contents:
    """Return the content of slow revolutions in the engine."""
    from gears3d.bench import static_picture

    told = result.to_dict()
    rows = [
        (about, f"mean {1e6 * told[name]['mean_m']:.4g} µm, "
         f"peak to peak {1e6 * (told[name]['largest_m'] - told[name]['smallest_m']):.4g} µm")
        for name, about in (("phi", "active flank φ"), ("psi", "reverse flank ψ"), ("backlash", "backlash b"))
    ]  # fmt: skip
    curves = {f"{name}_m": curve for name, curve in result.curves().items()}
    return Contents(
        "summary", "virtual test", "Slow revolutions",
        "What are the transmission errors of both flanks, and the backlash?",
        f"Backlash: {rows[2][1]}.", rows, told, lambda: static_picture(result),
        "Transmission errors of both flanks and backlash over the angle of the drive gear",
        {"record.parquet": result.record.write, "ste.csv": _table({"theta_drive_rad": result.theta, **curves})},
        picture="ste.png",
    )  # fmt: skip


def rundown(result: Rundown) -> Contents:
    """Return the content of a coast-down in the engine."""
    from gears3d.identify import picture_of
    from gears3d.views.rows import law_rows

    told = result.to_dict()
    columns = {"time_s": result.time, "theta_loose_rad": result.theta, "omega_loose_rad_s": result.omega}
    return Contents(
        "summary", "virtual test", "Coast-down", "Which drag decelerates the loose gear?",
        f"Standstill after {told['stands_after_s']:.4g} s; drag: {result.found.law}.", law_rows(result.found), told,
        lambda: picture_of(result.found), "Drag torque over speed with its 95 % band, and the residual",
        {"record.parquet": result.record.write, "rundown.csv": _table(columns)}, snippet=result.found.snippet,
        picture="rundown.png",
    )  # fmt: skip


def thresholds(result: Thresholds) -> Contents:
    """Return the content of sweeps to contact loss in the engine."""
    from gears3d.bench import threshold_picture

    rows = [
        (f"{one.frequency:g} Hz", f"Λ* {one.up:.4g} up, {one.down:.4g} down, predicted {one.predicted:.4g}")
        for one in result.sweeps
    ]
    return Contents(
        "summary", "virtual test", "Threshold of contact loss", "At which excitation is contact lost?",
        "; ".join(f"{name}: {value}" for name, value in rows) + ".", rows, result.to_dict(),
        lambda: threshold_picture(result), "Opening of the gap over excitation in sweeps up and down",
        {f"record-{one.frequency:g}Hz.parquet": one.record.write for one in result.sweeps},
        picture="threshold.png",
    )  # fmt: skip


def drops(result: Drops) -> Contents:
    """Return the content of drop tests in the engine."""
    from gears3d.bench import drop_picture

    rows = [
        (f"{flank} flank", f"e = {rest:.4f} {slope:+.4g} s/m · v, scatter {scatter:.2g}")
        for flank, (rest, slope, scatter) in result.laws.items()
    ]
    names = ("asked_m_s", "flank", "velocity_m_s", "rebound_m_s", "impulse_N_s", "tooth_drive", "tooth_loose")
    table = {**{name: result.table[name] for name in names}, "restitution": result.restitution}
    return Contents(
        "summary", "virtual test", "Drop test", "What is the coefficient of restitution of each flank?",
        "; ".join(f"{name}: {value}" for name, value in rows) + ".", rows, result.to_dict(),
        lambda: drop_picture(result), "Restitution over impact speed by flank", {"drop.csv": _table(table)},
        picture="drop.png",
    )  # fmt: skip


def strip(result: Strip) -> Contents:
    """Return the content of pictures of the mesh."""
    from gears3d.views.camera.strip import strip as draw

    begin, lasts = result.span
    return Contents(
        "camera", "camera", result.subject.title or "Gears in mesh", "What do the teeth in mesh do over this time?",
        f"From {begin:.6g} s over {1e3 * lasts:.4g} ms; the gap is drawn {result.look.factor:g} times its width.",
        [], result.to_dict(), lambda: draw(result.subject, result.look, result.shots, result.periods), result.words(),
        picture="strip.png",
    )  # fmt: skip


def swept(result: Done) -> Contents:
    """Return the content of a sweep; its dataset stays in its folder."""
    from gears3d.sweep.drawing import all_pictures
    from gears3d.sweep.run import duration
    from gears3d.views.rows import sweep_answer

    plan, counts = result.plan, result.counts
    grid = " x ".join(f"{size} {name}" for name, size in plan.dims)
    bad = ", ".join(f"{count} {_words(word)}" for word, count in counts.items() if word != "done" and count)
    drawn = all_pictures(result.place)
    title, answer, keys = sweep_answer(result)
    name, first = next(iter(drawn.items()), ("", None))
    return Contents(
        "result", "sweep", title, "How do regime and impacts change over the varied values?", answer,
        [("points", f"{plan.size} ({grid})"), ("periods of each", str(plan.periods)), ("model", plan.model)],
        {"points": plan.size, **counts, "dims": dict(plan.dims), "key": plan.key, "wall_s": result.seconds},
        first, "Results over the varied values", picture=f"{name}.png" if name else "", keys=keys,
        trust=[("points done", f"{counts.get('done', 0)} of {plan.size}"), ("not done", bad or "none"),
               ("wall time", duration(result.seconds))],
        tone="open" if bad else "good", source=plan.scenario().title, more=[*drawn.values()][1:], present=("sweep.nc",),
    )  # fmt: skip


# Classes of results by name, so that no package is loaded for a result of another kind.
KINDS: dict[str, Callable[[Any], Contents]] = {
    "Recording": recording,
    "Comparison": comparison,
    "ModelVerdict": model,
    "Identified": law,
    "Assessment": assessment,
    "DataSheet": sheet,
    "Measurement": measurement,
    "Diagnosis": diagnosis,
    "MeasurementPlan": measurement_plan,
    "StaticError": static_error,
    "Rundown": rundown,
    "Thresholds": thresholds,
    "Drops": drops,
    "Done": swept,
    "Strip": strip,
    "Told": lambda result: result.contents,
}

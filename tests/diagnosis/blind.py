"""Blind tests of the diagnosis: what is hidden in which records, and what a diagnosis made of it."""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomlkit

from gears3d.diagnosis import diagnose
from gears3d.errors import InputError
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import Scenario, load
from gears3d.verification.challenge import ASKED, KINDS, UNKNOWN, Plan, hide, plan, reveal, space, taking
from gears3d.verification.challenge.hiding import DURATION, bench, excite
from tests.diagnosis import observer

ANGLES = ("theta_drive_rad", "theta_loose_rad")
FINE, NOISY = 0.003, 0.015
"""Noise of both encoders together, as shares of the gap: what is asked of good benches, and of ordinary ones."""
COARSE = 8192
"""Counts of an encoder of 2048 lines (Kadmiri et al. 2012)."""
LIMITS = (0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Sizes, as shares of the unit size, over which the limit of detection is looked for."""


@dataclass(frozen=True)
class Case:
    """One blind test.

    Args:
        part: which sort of tests it belongs to.
        seed: of the challenge.
        hidden: kinds; none hides nothing, None lets the seed decide.
        options: of :func:`gears3d.verification.challenge.plan`.
        bench: name of what is done to the bench; one of ``BENCHES`` or nothing.
        without: stage of the diagnosis that is left out; one of ``STAGES`` or nothing.
    """

    part: str
    seed: int
    hidden: tuple[str, ...] | None = ()
    options: tuple[tuple[str, float], ...] = ()
    bench: str = ""
    without: str = ""

    @property
    def name(self) -> str:
        """Return what tells it from others."""
        hidden = "seed" if self.hidden is None else "+".join(self.hidden) or "nothing"
        less = [f"without {self.without}"] if self.without else []
        return " ".join([self.part, hidden, str(self.seed), *(f"{k}={v}" for k, v in self.options), *less])

    def plan(self) -> Plan:
        """Return the plan of the challenge."""
        options: dict[str, Any] = dict(self.options)
        return BENCHES[self.bench](self.seed, self.hidden, options)


def _chaotic(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """Gears of bright steel: what rebounds so hard never settles."""
    return plan(seed, hidden, rig=_rig(seed, {"impact.restitution": 0.75}), **options)


def _coarse(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    return plan(seed, hidden, rig=_rig(seed, {"sensors.counts_per_revolution": COARSE}), **options)


def _below(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """Fluctuation too small for contact ever to be lost."""
    return _swung(plan(seed, hidden, **options), lambda sine: [{**sine, "amplitude": _times(sine["amplitude"], 0.1)}])


def _harmonic(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """A drive that the rig says to swing at twice and three times its frequency, too."""

    def richer(sine: dict[str, str]) -> list[dict[str, str]]:
        more = [(2, 0.3, "40 deg"), (3, 0.15, "-70 deg")]
        return [sine] + [
            {"amplitude": _times(sine["amplitude"], size), "frequency": _times(sine["frequency"], n), "phase": phase}
            for n, size, phase in more
        ]

    return _swung(plan(seed, hidden, **options), richer)


def _one_speed(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """Records of one mean speed, so that torques over speed are alike; their fluctuations differ."""
    made = plan(seed, hidden, **options)
    mean = f"{made.rig.motion.mean!r} rad/s"
    return replace(made, conditions=tuple({**c, "motion.mean": mean} for c in made.conditions))


def _one_to_one(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """Gears of equal teeth, whose orders are alike."""
    gears = {"gears.drive.teeth": 90, "gears.loose.teeth": 90, "gears.module": "3.5 mm", "gears.helix_angle": "0 deg"}
    heavy = {"gears.loose.inertia": "0.07 kg m^2", "drag.torque": "0.4 N m"}
    return plan(seed, hidden, rig=_rig(seed, gears | heavy), **options)


def _rig(seed: int, change: dict[str, Any]) -> Scenario:
    """Return the bench of a seed with a change."""
    streams = [np.random.default_rng([seed, stream]) for stream in range(1, 3)]
    rig = load(bench(streams[0])).with_(change)
    return rig.with_(excite(rig, streams[1]))


def _swung(made: Plan, change: Callable[[dict[str, str]], list[dict[str, str]]]) -> Plan:
    """Return a plan with other harmonics of the drive in every record."""
    each = tuple({**c, "motion.harmonics": change(c["motion.harmonics"][0])} for c in made.conditions)
    return replace(made, conditions=each)


def _times(text: str, factor: float) -> str:
    number, unit = text.split(" ", 1)
    return f"{float(number) * factor!r} {unit}"


def _driven(seed: int, hidden: Any, options: dict[str, Any]) -> Plan:
    """Four records at four speeds, whose drive has harmonics of 5 % at orders 1 and 2 of its shaft as well."""
    made = plan(seed, hidden, **{**options, "records": 4})

    def with_orders(condition: dict[str, Any]) -> dict[str, Any]:
        sine, turn = condition["motion.harmonics"][0], float(condition["motion.mean"].split()[0]) / (2.0 * np.pi)
        small = _times(sine["amplitude"], 0.05)
        more = [{"amplitude": small, "frequency": f"{n * turn!r} Hz", "phase": f"{70 * n} deg"} for n in (1, 2)]
        return {**condition, "motion.harmonics": [sine, *more]}

    return replace(made, conditions=tuple(with_orders(one) for one in made.conditions))


def soil(folder: Path, seed: int) -> None:
    """Add dirt to the records of a folder, and take out of their map what it says of their motion.

    1/f noise of 0.1 to 2 % of the backlash, interpolation errors once and twice a line of 0.1 to 1 % of a line, jitter
    of 2 % of the sampling interval, and a clock that is 30 ppm fast.

    Args:
        folder: of the challenge.
        seed: of the dirt.
    """
    rig, random = load(folder / "rig.toml"), np.random.default_rng([seed, 77])
    values, lines = rig.rig(), float(rig.sensors.drive.counts_per_revolution or 4096) / 4.0
    coloured, wrong = values.backlash * 1e-3 * 20.0 ** random.random(), 1e-3 * 10.0 ** random.random()
    for file in sorted(folder.glob("record-*.parquet")):
        table = pq.read_table(file)
        time = table["time_s"].to_numpy()
        late = 0.02 * (time[1] - time[0]) * random.standard_normal(len(time))
        columns = {name: table[name].to_numpy() for name in table.column_names}
        for name, radius in zip(ANGLES, (values.base_radius_drive, values.base_radius_loose), strict=True):
            angle = columns[name]
            for times in (1, 2):
                turn = times * lines * angle + random.uniform(0.0, 2.0 * np.pi)
                columns[name] = columns[name] + wrong * 2.0 * np.pi / lines * np.sin(turn) / times
            columns[name] = columns[name] + np.gradient(angle, time) * late
            columns[name] = columns[name] + coloured / radius * _pink(random, len(time))
        columns["time_s"] = time * (1.0 + 30e-6)
        pq.write_table(pa.table(columns, metadata=table.schema.metadata), file)
    chart = folder / "record.toml"
    document = tomlkit.parse(chart.read_text(encoding="utf-8"))
    for one in document.get("record", []):
        one.pop("condition", None)
    chart.write_text(tomlkit.dumps(document), encoding="utf-8")


def _pink(random: np.random.Generator, count: int) -> np.ndarray:
    """Return noise of unit root mean square whose power falls with the frequency, (count,)."""
    spectrum = np.fft.rfft(random.standard_normal(count))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, count)
    return noise / noise.std()


BENCHES: dict[str, Callable[[int, Any, dict[str, Any]], Plan]] = {
    "": lambda seed, hidden, options: plan(seed, hidden, **options),
    "chaotic": _chaotic, "coarse": _coarse, "below": _below, "harmonic": _harmonic,
    "dirt": _driven, "one speed": _one_speed, "one to one": _one_to_one,
}  # fmt: skip
"""What may be done to a bench before anything is hidden: from seed, kinds and options to the plan."""


def cases(part: str, first: int, count: int) -> Iterator[Case]:
    """Return the blind tests of a part.

    Args:
        part: one of ``PARTS``.
        first: seed of the first.
        count: of each sort.

    >>> [case.name for case in cases("short", 100, 2)]
    ['short nothing 100 duration=3.0 noise=0.003', 'short nothing 101 duration=3.0 noise=0.015']
    """
    for k in range(count):
        yield from PARTS[part](part, first + k, ("noise", NOISY if k % 2 else FINE))


def _kinds(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    yield from (Case(part, seed, (kind,), (noise,)) for kind in (*KINDS, *ASKED))


def _unknown(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    yield from (Case(part, seed, (kind,), (noise,)) for kind in UNKNOWN)


SETTINGS: dict[str, tuple[tuple[str, float], ...]] = {
    "0.3 % noise": (("noise", FINE),),
    "1.5 % noise": (("noise", NOISY),),
    "a quarter of the length": (("noise", FINE), ("duration", 0.25 * DURATION)),
    "two speeds": (("noise", FINE), ("records", 2)),
}
"""Records for which limits of detection are looked for."""
SOME = (12, 4)
"""Of so many seeds in turn, from every hundred on, how many are for the settings after the first."""


def _limits(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    """Yield every kind, its size by the seed; in all settings for some seeds."""
    first, *others = SETTINGS.values()
    for k, kind in enumerate(KINDS):
        yield Case(part, seed, (kind,), (("size", LIMITS[(seed + k) % len(LIMITS)]), *first))
        for setting in others if seed % 100 % SOME[0] < SOME[1] else ():
            yield Case(part, seed, (kind,), (("size", LIMITS[(seed + k) % len(LIMITS)]), *setting))


JUDGING = "what is left judging causes"
"""The stage that is there for causes outside the catalogue: without it they are tried, too."""
STAGES: dict[str, tuple[tuple[str, Any], ...]] = {
    "cutting anew": (("pitch_error.RESEGMENTATIONS", 0),),
    "leaving out what is far off": (("search.FAR", (np.inf,)),),
    "scatter of restitution as noise": (("search.with_own_noise", list),),
    JUDGING: (("residual_tests.drop_contradicted", lambda found, left: list(found.fit.causes)),),
    "the bar for small causes": (("causes.SMALLEST", 0.0),),
}  # fmt: skip
"""Stages of the diagnosis that an ablation leaves out, one at a time: names in its modules, and what stands there."""


def _ablated(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    for stage in ("", *STAGES):
        foreign = UNKNOWN if stage in ("", JUDGING) else ()
        yield from (Case(part, seed, (kind,), (noise,), without=stage) for kind in (*KINDS, *foreign))
        yield Case(part, seed, (), (noise,), without=stage)


TWO = tuple(
    pair
    for pair in combinations(
        ("eccentricity", "backlash_offset", "drag_viscous", "drag_coulomb", "restitution_offset", "encoder_skew",
         "drag_position", "encoder_eccentricity"), 2
    )
    if pair not in {("drag_viscous", "drag_coulomb")}
)  # fmt: skip
"""Pairs of causes that can be told apart in these records."""


def _pairs(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    yield Case(part, seed, TWO[seed % len(TWO)], (("size", 0.15), noise))


ALIKE: dict[str, tuple[tuple[str, ...], tuple[tuple[str, float], ...], str]] = {
    "torques over speed, at one speed": (("drag_viscous", "drag_power"), (), "one speed"),
    "a torque over the difference of speeds": (("drag_differential",), (), ""),
    "order 1 of either gear, at 1:1": (("eccentricity", "transmission_error"), (), "one to one"),
    "drag and restitution, in one record of 3 s": (
        ("drag_coulomb", "restitution_offset"), (("records", 1), ("duration", 3.0)), ""),
    "oil and restitution, in one record of 3 s": (
        ("oil_film", "restitution_speed"), (("records", 1), ("duration", 3.0)), ""),
}  # fmt: skip
"""What records may not tell apart: kinds that are hidden in turn, options of the plan, and the bench."""


def _alike(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    for kinds, options, where in ALIKE.values():
        yield Case(part, seed, (kinds[seed // 2 % len(kinds)],), (*options, noise), where)


def _null(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    length = (("duration", 3.0),) if part == "short" else ()
    yield Case(part, seed, (), (*length, noise), part if part in BENCHES else "")


def _anywhere(part: str, seed: int, noise: tuple[str, float]) -> Iterator[Case]:
    """Yield a rig of the operating space: nothing hidden in one of seven, else some causes at once."""
    random, many = np.random.default_rng([seed, 43]), int(part.removeprefix("space") or 1)
    rig = _rig_of(part, seed)
    assert rig is not None
    able = [kind for kind in KINDS if taking.fits(rig, kind)]
    if many == 1:
        yield Case(part, seed, () if random.uniform() < 1.0 / 7.0 else (str(random.choice(able)),))
        return
    places = [[kind for kind in place if kind in able] for place in PLACES]
    chosen = [str(random.choice(places[int(k)])) for k in random.permutation(len(places)) if places[int(k)]]
    if "tooth_compliance" in chosen[:many]:  # compliant teeth rebound by their damping: no restitution can be seen
        chosen = [kind for kind in chosen if not kind.startswith("restitution")]
    yield Case(part, seed, tuple(chosen[:many]))


PLACES: tuple[tuple[str, ...], ...] = (
    ("drag_coulomb", "drag_viscous", "drag_power", "drag_position", "drag_drift", "drag_differential", "mesh_drag"),
    ("restitution_offset", "restitution_speed", "restitution_asymmetry", "restitution_scatter"),
    ("backlash_offset", "backlash_variation"),
    ("eccentricity", "transmission_error", "pitch_error"),
    ("encoder_eccentricity", "encoder_skew"),
    ("oil_film", "tooth_compliance"),
)
"""Kinds by where they act; several causes at once come from different places."""


PARTS: dict[str, Callable[[str, int, tuple[str, float]], Iterator[Case]]] = {
    "kinds": _kinds, "unknown": _unknown, "two": _pairs, "limits": _limits, "ablation": _ablated, "sets": _alike,
    **dict.fromkeys(("space", "space0", "space2", "space3", "space4", "space6"), _anywhere),
    **dict.fromkeys(("nothing", "chaotic", "coarse", "below", "harmonic", "short", "dirt"), _null),
}  # fmt: skip
"""Sorts of blind tests."""
NULLS = ("nothing", "chaotic", "coarse", "below", "harmonic", "short")
"""Those in which nothing is hidden."""


def _setting(case: Case) -> str:
    """Return the name of what is particular about a test among others of its part."""
    if case.part == "sets":
        own = (case.options[:-1], case.bench)
        return next(
            (k for k, (kinds, *how) in ALIKE.items() if {*(case.hidden or ())} <= {*kinds} and tuple(how) == own), ""
        )
    return next((k for k, v in SETTINGS.items() if v == case.options[1:]), "")


@contextmanager
def leaving_out(stage: str) -> Iterator[None]:
    """Leave out a stage of the diagnosis for a while."""
    with ExitStack() as stack:
        for name, other in STAGES.get(stage, ()):
            stack.enter_context(patch(f"gears3d.diagnosis.{name}", other))
        yield


TUNED, TESTED = 20, 1020
"""Sobol sequences of the rigs for tuning and, from seed 100 on, for tests."""
SAMPLES = 200_000
"""Samples of a record of the operating space at most: a diagnosis reads up to eight of them."""


def _rig_of(part: str, seed: int) -> space.Rig | None:
    """Return the rig of the operating space of a test, where it is one of those."""
    if not part.startswith("space"):
        return None
    return space.draw(seed + 1, TESTED if seed >= 100 else TUNED)[seed]


def facts_of(rig: space.Rig) -> dict[str, Any]:
    """Return the factors of a rig over which the maps are drawn."""
    first = rig.conditions[0]
    return {
        "falls per period": 1.0 / (first.frequency * rig.fall), "excitation": max(c.excitation for c in rig.conditions),
        "counts per backlash": rig.counts_per_backlash, "noise over backlash": rig.noise_share, "ratio": rig.ratio,
        "order": first.order or 0.0, "records": len(rig.conditions), "restitution": rig.restitution,
        "revolutions": first.mean * first.duration / (2.0 * np.pi), "dirt": len(rig.dirt),
    }  # fmt: skip


def play(case: Case) -> dict[str, Any]:
    """Hide, diagnose, open the answer, and return what came of it as JSON can hold it.

    Args:
        case: the test.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        within = _rig_of(case.part, case.seed)
        if within is None:
            made = case.plan()
            hide(made, folder)
        else:
            made = taking.plan(within, case.hidden or (), samples=SAMPLES, **dict(case.options))
            hide(made, folder, observe=taking.observer(within), stated=False)
        if case.bench == "dirt":
            soil(folder, case.seed)
        rig, began, admitted = load(folder / "rig.toml"), time.process_time(), []
        try:
            admitted = [admit(file, rig, chart) for file, chart in files_of([folder / "record.toml"])]
            with leaving_out(case.without):
                told = diagnose(admitted, rig).to_dict()
        except InputError as error:
            told = {"verdict": "not_decidable", "causes": [], "remaining": {"structure": "none"}, "refused": str(error)}
        took = time.process_time() - began
        (folder / "diagnosis.json").write_text(json.dumps(told), encoding="utf-8")
        score = reveal(folder, folder / "diagnosis.json")
        answer = score.pop("answer")
        sees = observer.seen(admitted, answer["effects"], answer.get("zeros")) if within else {}
    return {
        "name": case.name, "part": case.part, "seed": case.seed, "records": len(made.conditions),
        "used": len(told.get("records", ())),
        "setting": _setting(case), "without": case.without,
        "hidden": [one["kind"] for one in answer["effects"]] + [one["name"] for one in answer["unknown"]],
        "size": answer["size"], "noise": answer["noise"], "visible": answer["visible"],
        "causes": [{"kind": one["kind"], "or": [each["kind"] for each in one.get("alternatives", [])],
                    "probability": one["probability"]} for one in told["causes"]],
        "posterior": told.get("posterior", []),
        "structure": told["remaining"]["structure"], "refused": told.get("refused"),
        "gain": (told.get("heldout") or {}).get("gain"), "splits": len((told.get("heldout") or {}).get("splits", ())),
        "seconds": took, "facts": facts_of(within) if within else {}, "sees": sees, **score,
    }  # fmt: skip

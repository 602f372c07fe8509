"""A challenge: bench and records drawn from a seed, effects hidden, played out, written with the sealed answer.

Records are taken at several speeds and amplitudes, in random order.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import UsageError, did_you_mean
from gears3d.files import write_text
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.verification.challenge.causes import ASKED, KINDS, UNKNOWN, Foreign, draw_foreign, quantity
from gears3d.verification.challenge.causes import draw as draw_cause
from gears3d.verification.challenge.machine import machine, values
from gears3d.verification.challenge.motion import happen
from gears3d.verification.challenge.physics import moved
from gears3d.verification.challenge.scoring import close
from gears3d.verification.challenge.sensing import arbitrary_zeros, delay, reading, sway, wander

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

SIZES = (0.1, 0.5)  # Sizes of hidden effects as shares of their unit size
RECORDS = "record.toml"
# Where encoders count from: marks that all records have in common, or anywhere in each
ZEROS = ("common", "arbitrary")
# Mean speeds of the records over the rig's: a decade tells a slope from a curve, and speed from time
SPEEDS = (0.3, 0.6, 1.0, 1.6, 2.4)
# Λ of the records: one barely rattles and stays on its flanks, the others cross the gap at different speeds
EXCITATIONS = (4.0, 1.3, 6.0, 3.0, 8.0)
DURATION = 12.0  # Of a record [s]
RATE = 50e3  # Samples a second [Hz]
NOISE = 0.002  # Of both encoders together, as a share of the gap


@dataclass(frozen=True)
class Plan:
    """What is going to be hidden, and in which records.

    Args:
        seed: of all that was drawn.
        rig: the bench without the effects.
        conditions: of each record.
        effects: tables of ``[[effect]]``.
        unknown: causes outside the catalogue.
        size: as a share of the unit size.
        noise: of both encoders together, as a share of the gap.
        zeros: what the encoders read of drive and loose gear where the bench has 0, record by record [rad]; without
            any, every record counts from the marks of the bench.
    """

    seed: int
    rig: Scenario
    conditions: tuple[dict[str, Any], ...]
    effects: tuple[dict[str, Any], ...]
    unknown: tuple[Foreign, ...]
    size: float
    noise: float
    zeros: tuple[tuple[float, float], ...] = ()

    def told(self) -> dict[str, Any]:
        """Return the answer as JSON can hold it: kinds and parameters in SI."""
        full = self.rig.with_({"effect": [*_tables(self.rig), *self.effects]})
        hidden = [values(effect) for effect in full.effects[len(self.rig.effects) :]]
        others = [{"name": u.name, **u.parameters, "coordinates": list(u.coordinates)} for u in self.unknown]
        visible = not (self.effects and all(map(self._blind, self.effects, hidden)))
        about = {"size": self.size, "noise": self.noise, "ratio": self._ratio()}
        about |= {"zeros": [list(pair) for pair in self.zeros]} if self.zeros else {}
        return {"seed": self.seed, "effects": hidden, "unknown": others, "visible": visible, **about}

    def _ratio(self) -> list[int]:
        return [self.rig.gears.drive.teeth, self.rig.gears.loose.teeth]

    def _blind(self, written: dict[str, Any], effect: dict[str, Any]) -> bool:
        """Whether an effect leaves no trace in any angle.

        Friction of rigid flanks; a negative pitch deviation where neighbouring teeth carry almost always.
        """
        if effect["kind"] == "pitch_error":
            return moved(machine(self.rig.with_({"effect": [written]}))) < self.noise * self.rig.pair().backlash
        return effect["kind"] == "mesh_friction" and all(e.kind != "tooth_compliance" for e in self.rig.effects)

    def digest(self) -> str:
        """Return sixteen digits that tell this plan from others, rounding of platforms left out."""

        def rounded(value: Any) -> Any:
            if isinstance(value, dict):
                return {key: rounded(each) for key, each in value.items()}
            if isinstance(value, list | tuple):
                return [rounded(each) for each in value]
            return f"{value:.4g}" if isinstance(value, float) else value

        drawn = {**self.told(), "visible": True}  # what is to be seen of it follows from the rest
        facts = [drawn, list(self.conditions), _facts(self.rig)]
        return hashlib.sha256(json.dumps(rounded(facts), sort_keys=True).encode()).hexdigest()[:16]


def _facts(rig: Scenario) -> list[float]:
    pair = rig.pair()
    numbers = [pair.drive.base_radius, pair.loose.base_radius, pair.backlash, rig.drag.torque, rig.impact.restitution]
    return [*map(float, numbers), float(rig.gears.loose.inertia or 0.0), float(rig.run.duration)]


def _tables(rig: Scenario) -> list[dict[str, Any]]:
    import tomllib

    return tomllib.loads(rig.document).get("effect", [])


def plan(
    seed: int,
    effects: Sequence[str] | None = None,
    *,
    rig: Scenario | None = None,
    size: float | None = None,
    noise: float | None = None,
    duration: float | None = None,
    records: int = len(SPEEDS),
    zero: str = "common",
) -> Plan:
    """Draw a challenge.

    Args:
        seed: the same seed and arguments draw the same challenge.
        effects: kinds to hide; ``()`` hides nothing, ``("unknown",)`` a cause outside the catalogue; without it the
            seed decides.
        rig: the bench; drawn unless given.
        size: of the effects as a share of their unit size; drawn from 0.1 to 0.5 unless given.
        noise: of both encoders together, as a share of the gap.
        duration: of a record, s.
        records: how many.
        zero: ``"common"`` for encoders that count from the same marks in all records, ``"arbitrary"`` for such that
            begin anywhere in each.

    Raises:
        UsageError: a kind, or a sort of zero, is not known.
    """
    if zero not in ZEROS:
        raise UsageError(f"--zero: there is no {zero!r}; {did_you_mean(zero, ZEROS)}")
    streams = [np.random.default_rng([seed, stream]) for stream in range(5)]
    which, for_bench, for_motion, cause, for_records = streams
    kinds = tuple(effects) if effects is not None else _which(which)
    catalogue = (*KINDS, *ASKED)
    known = [*catalogue, "unknown", *UNKNOWN]
    for kind in kinds:
        if kind not in known:
            raise UsageError(f"--effect: there is no kind {kind!r}; {did_you_mean(kind, known)}")
    drawn = rig is None
    base = load(bench(for_bench)) if rig is None else rig
    if duration is not None:
        base = base.with_({"run.duration": f"{duration!r} s"})
    if drawn or not base.motion.harmonics:
        base = base.with_(excite(base, for_motion))
    if drawn and "mesh_friction" in kinds:
        base = base.with_({"effect": [_soft(base)]})
    size = float(which.uniform(*SIZES)) if size is None else size
    hidden = tuple(draw_cause(kind, base, size, cause) for kind in kinds if kind in catalogue)
    strange = [str(which.choice(list(UNKNOWN))) if k == "unknown" else k for k in kinds if k not in catalogue]
    unknown = tuple(draw_foreign(name, base, size, cause) for name in strange)
    each = tuple(conditions(base, for_records, records))
    zeros = arbitrary_zeros(base.sensors, records, np.random.default_rng([seed, 12])) if zero == "arbitrary" else ()
    return Plan(seed, base, each, hidden, unknown, size, NOISE if noise is None else noise, zeros)


def _which(random: np.random.Generator) -> tuple[str, ...]:
    """What a seed hides: nothing, a cause outside the catalogue (one in seven each), or one of the kinds."""
    choice = random.uniform()
    if choice < 2.0 / 7.0:
        return () if choice < 1.0 / 7.0 else ("unknown",)
    return (str(random.choice(KINDS)),)


def _soft(rig: Scenario) -> dict[str, Any]:
    """Teeth that deform by 3 % of the backlash under the drag, for what shows with such teeth only."""
    force = rig.drag.torque / rig.pair().loose.base_radius
    stiff = force / (0.03 * rig.pair().backlash)
    mass = float(rig.gears.loose.inertia or 0.0) / rig.pair().loose.base_radius ** 2
    damping = 0.3 * (stiff * mass) ** 0.5
    return {
        "kind": "tooth_compliance",
        "stiffness": quantity(float(f"{stiff:.4g}"), "N/m"),
        "damping": quantity(float(f"{damping:.4g}"), "N s/m"),
    }


def bench(random: np.random.Generator) -> dict[str, Any]:
    """Draw a rig: gears, backlash, drag, restitution and encoders of a bench as the papers have them."""
    teeth = ((90, 90, 3.5, 0.0), (47, 61, 2.5, 0.0), (31, 53, 3.0, 0.0), (37, 29, 2.75, 20.0))
    drive, loose, module, helix = teeth[int(random.integers(len(teeth)))]
    radius = 0.5e-3 * module * loose * 0.94
    backlash = float(f"{random.uniform(150e-6, 350e-6):.3g}")
    inertia = float(f"{3.2 * radius**2 * random.uniform(0.8, 1.25):.4g}")
    drag = float(f"{inertia / radius * random.uniform(0.4, 1.2):.3g}")
    counts = int(2.0 ** (6 + int(2.0 * pi * radius / (1e-3 * backlash) / 64).bit_length()))
    return {
        "format": 1,
        "title": f"Bench {drive}:{loose}",
        "gears": {
            "module": f"{module} mm",
            "helix_angle": f"{helix} deg",
            "face_width": "15 mm",
            "drive": {"teeth": drive},
            "loose": {"teeth": loose, "inertia": quantity(inertia, "kg m^2")},
        },
        "mount": {"backlash": quantity(backlash, "m")},
        "motion": {"mean": "60 rpm"},
        "drag": {"torque": quantity(drag, "N m")},
        "impact": {"restitution": round(float(random.uniform(0.25, 0.55)), 2)},
        "run": {"duration": f"{DURATION} s", "settle": "0 s", "output_rate": f"{RATE} Hz"},
        "sensors": {"sample_rate": f"{RATE} Hz", "counts_per_revolution": counts},
    }


def excite(rig: Scenario, random: np.random.Generator) -> dict[str, Any]:
    """Return a motion that makes a rig rattle: a fluctuation slow against the fall across the gap, a fitting mean."""
    force, frequency = _scales(rig)
    frequency *= random.uniform(0.85, 1.2)
    largest = max(EXCITATIONS) * force / (2.0 * pi * frequency) / rig.pair().drive.base_radius
    mean = 4.5 * largest * random.uniform(1.0, 1.4)
    sine = {"amplitude": f"{0.5 * largest:.5g} rad/s", "frequency": f"{frequency:.4g} Hz"}
    return {"motion.mean": f"{mean:.5g} rad/s", "motion.harmonics": [sine]}


def _scales(rig: Scenario) -> tuple[float, float]:
    """Deceleration under the drag [m/s²], and a frequency at which some ten falls fill a period [Hz]."""
    pair = rig.pair()
    inertia = float(rig.gears.loose.inertia or 0.0)
    decelerated = (rig.drag.torque or 0.2 * inertia) * pair.loose.base_radius / inertia
    return decelerated, 0.1 / sqrt(2.0 * pair.backlash / decelerated)


def conditions(rig: Scenario, random: np.random.Generator, records: int = len(SPEEDS)) -> list[dict[str, Any]]:
    """Return what differs between the records of a rig: mean speed and amplitude, in random order."""
    force, _ = _scales(rig)
    sine = rig.motion.harmonics[0]
    made = []
    for i in range(records):
        share = SPEEDS[i % len(SPEEDS)] * random.uniform(0.95, 1.05)
        mean = share * rig.motion.mean
        size = EXCITATIONS[i % len(EXCITATIONS)] * random.uniform(0.93, 1.08)
        speed = size * force / (2.0 * pi * sine.frequency) / rig.pair().drive.base_radius
        swing = {"amplitude": f"{min(speed, 0.8 * abs(mean)):.5g} rad/s", "frequency": f"{sine.frequency!r} Hz"}
        made.append({"motion.mean": f"{mean:.5g} rad/s", "motion.harmonics": [swing]})
    order = random.permutation(records)
    return [made[i] for i in order]


def observe(plan: Plan, number: int, progress: Callable[[float], None] | None = None) -> Recording:
    """Play one record of a plan out and return what the encoders wrote down.

    Args:
        plan: from :func:`plan`.
        number: of the record, from 0.
        progress: called now and then with the time done [s].
    """
    scenario = plan.rig.with_({**plan.conditions[number], "effect": [*_tables(plan.rig), *plan.effects]})
    sensors, facts = scenario.sensors, [values(effect) for effect in scenario.effects]
    rows = [row for cause in plan.unknown for row in cause.rows]
    second = next((cause.second for cause in plan.unknown if cause.second), ())
    late = {gear: delay(facts, gear) for gear in ("drive", "loose")}
    seed = plan.seed * 1009 + number
    how = {"rate": sensors.sample_rate, "seed": seed, "progress": progress}
    happened = happen(scenario, rows, second, late=late["loose"], late_drive=late["drive"], **how)
    random = np.random.default_rng([seed, 11])
    noise = plan.noise * plan.rig.pair().backlash / np.sqrt(2.0)
    radii = {"drive": plan.rig.pair().drive.base_radius, "loose": plan.rig.pair().loose.base_radius}
    read = {"time_s": happened.time}
    for gear, radius in radii.items():
        angle = wander(facts, gear, happened.signals[f"theta_{gear}_rad"])
        for cause in plan.unknown:
            if cause.mount and gear == "loose":
                angle = sway(angle, 1.0 / sensors.sample_rate, *cause.mount)
        read[f"theta_{gear}_rad"] = reading(angle, getattr(sensors, gear), noise / radius, random)
        if plan.zeros:
            read[f"theta_{gear}_rad"] += plan.zeros[number][gear == "loose"]
    about = {"sample_rate_Hz": sensors.sample_rate}
    about |= {f"counts_per_revolution_{gear}": getattr(sensors, gear).counts_per_revolution for gear in radii}
    return Recording(read, meta={"encoders": about})


def hide(
    plan: Plan,
    out: str | Path,
    track: Callable[[str, float], Callable[[float], None]] | None = None,
    observe: Callable[[Plan, int, Callable[[float], None] | None], Recording] = observe,
    stated: bool = True,
) -> dict[str, Any]:
    """Write a challenge: its records, ``record.toml``, ``rig.toml``, and the answer, sealed.

    Args:
        plan: from :func:`plan`.
        out: folder.
        track: gives for a name and a total what is called with the time done.
        observe: plays one record out; as :func:`observe`.
        stated: whether the map states the motion of each record.

    Returns:
        What ``challenge.json`` holds: files with their hashes, the hash of the sealed answer.

    Raises:
        InputError: it cannot be written.
    """
    folder = Path(out)
    names, files = [], {}
    for number in range(len(plan.conditions)):
        name = f"record-{number + 1}.parquet"
        tick = track(name, plan.rig.run.duration) if track else None
        observe(plan, number, tick).write(folder / name)
        names.append(name)
    write_text(folder / "rig.toml", plan.rig.document)
    write_text(folder / RECORDS, _map(names, plan.conditions if stated else [{} for _ in names], bool(plan.zeros)))
    for name in [*names, "rig.toml", RECORDS]:
        files[name] = hashlib.sha256((folder / name).read_bytes()).hexdigest()
    sealed = close(plan.told())
    write_text(folder / "answer.sealed", sealed)
    about = {"format": 1, "records": names, "rig": "rig.toml", "map": RECORDS, "files": files}
    about["answer_sha256"] = hashlib.sha256(sealed.encode()).hexdigest()
    write_text(folder / "challenge.json", json.dumps(about, indent=2) + "\n")
    return about


def _map(names: Sequence[str], conditions: Sequence[dict[str, Any]], anywhere: bool) -> str:
    """Return the map of the records: each file with its condition."""
    import tomlkit

    document = tomlkit.document()
    document["format"] = 1
    records = tomlkit.aot()
    for name, condition in zip(names, conditions, strict=True):
        table = tomlkit.table()
        table["file"] = name
        motion = {key.removeprefix("motion."): value for key, value in condition.items() if "motion" in key}
        if anywhere:
            table |= {gear: {"zero": "arbitrary"} for gear in ("drive", "loose")}
        if motion:
            table["condition"] = {"motion": motion}
        records.append(table)
    document["record"] = records
    return tomlkit.dumps(document)

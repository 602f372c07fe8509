"""Responses: regime and repetition, the impacts that encoders resolve, durations and impulses of impacts."""

from __future__ import annotations

from math import pi

import numpy as np

from gears3d.laws.contact import dimensionless_impulse, equivalent_mass
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.excitation import drive_amplitude, excitation
from gears3d.verification.papers.measures.registry import measure

COUNT = 2 * pi / 8192  # one count of the encoders of Kadmiri et al. 2012 [rad]; lower flights are not resolved


@measure
def outcome(case: Case, of: str) -> float | str:
    """Return an entry of the run's summary."""
    found = case.outcome[of]
    return found if isinstance(found, int | float) else str(found)


@measure
def repetition(case: Case) -> str:
    """Return ``"repeats"`` if the motion does after whatever number of periods, else its name."""
    name = case.outcome["motion"]
    return "repeats" if name is None or name.endswith("T") else name


@measure
def strongest_line(case: Case, begin: float, end: float) -> float:
    """Return the frequency of the strongest line of the displacement between two times [Hz]."""
    run = case.run.between(begin, end)
    place = run.signals["displacement_m"]
    amplitude = np.abs(np.fft.rfft((place - place.mean()) * np.hanning(len(place))))
    return float(np.fft.rfftfreq(len(place), run.time[1] - run.time[0])[int(np.argmax(amplitude))])


def resolved(case: Case) -> dict[str, np.ndarray]:
    """Return the settled impacts after flights above one encoder count, and their phases ``cycle`` [cycles]."""
    scenario, hits = case.scenario, case.run.impacts
    kept = (hits["time_s"] >= scenario.run.settle) & (hits["flight_height_m"] > COUNT * case.rig.base_radius_drive)
    found = {column: values[kept] for column, values in hits.items()}
    found["cycle"] = np.mod(found["time_s"] * scenario.motion.harmonics[0].frequency, 1.0)
    return found


def settled_periods(case: Case) -> float:
    """Return the number of periods of the drive after settling."""
    scenario = case.scenario
    return (scenario.run.duration - scenario.run.settle) * scenario.motion.harmonics[0].frequency


@measure
def resolved_impacts(case: Case) -> float:
    """Return the number of resolved impacts in a period."""
    return len(resolved(case)["time_s"]) / settled_periods(case)


@measure
def resolved_flanks(case: Case) -> str:
    """Return on which flanks impacts are resolved: ``"both"``, ``"one"`` or ``"none"``."""
    return ("none", "one", "both")[len(set(resolved(case)["flank"].tolist()))]


@measure
def alternation(case: Case) -> float:
    """Return the share of resolved impacts that are followed by one on the other flank."""
    return float((np.diff(resolved(case)["flank"]) != 0).mean())


@measure
def repeated_impacts(case: Case) -> float:
    """Return the number of resolved impacts in a period that follow one on the same flank."""
    return int((np.diff(resolved(case)["flank"]) == 0).sum()) / settled_periods(case)


@measure
def impulse_ratio(case: Case) -> float:
    """Return the mean resolved impulse on the reverse flank over that on the active flank, without signs."""
    hits = resolved(case)
    active, reverse = (np.abs(hits["impulse_N_s"][hits["flank"] == flank]).mean() for flank in (0, 1))
    return float(reverse / active)


@measure
def phase_scatter(case: Case) -> float:
    """Return the larger circular standard deviation of the phases of resolved impacts on one flank [cycles]."""
    hits = resolved(case)
    means = [abs(np.exp(2j * pi * hits["cycle"][hits["flank"] == flank]).mean()) for flank in (0, 1)]
    return float(max(np.sqrt(-2 * np.log(mean)) / (2 * pi) for mean in means))


def durations(case: Case, stiffness: float) -> np.ndarray:
    """Return how long compliant flanks push in impacts faster than 20 mm/s [s]; longer contacts are permanent."""
    mass = equivalent_mass(case.rig.inertia, case.rig.base_radius_loose)
    damping = 2 * 0.28 * float(np.sqrt(stiffness * mass))
    effect = {"kind": "tooth_compliance", "stiffness": f"{stiffness!r} N/m", "damping": f"{damping!r} N s/m"}
    run, backlash = case.with_({"effect": [effect]}).run, case.rig.backlash
    s, v = run.signals["displacement_m"], run.signals["velocity_m_s"]
    active = (s < 0) & (stiffness * s + damping * v < 0)
    reverse = (s > backlash) & (stiffness * (s - backlash) + damping * v > 0)
    change = np.flatnonzero(np.diff((active | reverse).astype(int))) + 1
    begins, ends = change[:-1], change[1:]
    lasted = run.time[ends] - run.time[begins]
    impact = (active | reverse)[begins] & (np.abs(v[begins]) > 0.02) & (run.time[begins] > 0.2)
    return lasted[impact & (lasted < 2 * np.pi * np.sqrt(mass / stiffness))]


@measure
def impact_duration(case: Case, stiffness: float, of: str = "mean") -> float:
    """Return the ``mean`` or ``std`` of the durations of impacts on compliant flanks [s]."""
    return float(getattr(durations(case, stiffness), of)())


def at_excitation(case: Case, wanted: float, run: str) -> Case:
    """Return the scenario ``run`` with mean speed, drag and period of a case, at another excitation."""
    scenario = case.scenario
    amplitude = scenario.motion.harmonics[0].amplitude * wanted / excitation(case)
    return case.bench.case(
        run,
        {
            "motion.mean": f"{scenario.motion.mean!r} rad/s",
            "drag.torque": f"{case.rig.drag_torque!r} N m",
            "motion.harmonics": [{"amplitude": f"{amplitude:.6f} rad/s", "order": 2, "phase": "90 deg"}],
        },
    )


def impulses(case: Case, wanted: float, run: str, alike: str = "") -> np.ndarray:
    """Return the dimensionless impulses at an excitation, after flights across at least half of the backlash.

    ``alike`` names a case that the backlash is taken from, in terms of the drive's amplitude.
    """
    moved = at_excitation(case, wanted, run)
    size = drive_amplitude(case) * wanted / excitation(case)
    if alike:
        like = case.bench.case(alike)
        last = drive_amplitude(like) * wanted / excitation(like)
        moved = moved.with_({"mount.backlash": f"{100 * size / last:.6f} um"})
    scenario, rig, hits = moved.scenario, moved.rig, moved.run.impacts
    kept = (hits["time_s"] >= scenario.run.settle) & (hits["flight_height_m"] > 0.5 * rig.backlash)
    mass = equivalent_mass(rig.inertia, rig.base_radius_loose)
    return dimensionless_impulse(hits["impulse_N_s"][kept], mass, size, 2 * pi * scenario.motion.harmonics[0].frequency)


@measure
def mean_impulse(case: Case, wanted: float, run: str, alike: str = "") -> float:
    """Return the mean dimensionless impulse at an excitation."""
    return float(np.abs(impulses(case, wanted, run, alike)).mean())

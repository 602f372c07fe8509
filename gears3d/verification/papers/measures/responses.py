"""Excitation of the loose gear against its drag, the threshold of rattle, and responses above it.

Responses are regime and repetition, the impacts that encoders resolve, durations and impulses of impacts, and the nine
pictures of the teeth in one period of Rigaud & Perret-Liaudet 2020, fig. 8. Backlash and phase of these pictures are
not printed; "T = 0.333 ms" is 0.333 s.
"""

from __future__ import annotations

from math import pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.laws.contact import dimensionless_impulse, equivalent_mass
from gears3d.laws.contact import drag_force as force_of
from gears3d.laws.contact import drive_amplitude as amplitude_of
from gears3d.laws.excitation import excitation as excitation_of
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure

if TYPE_CHECKING:
    from gears3d.recording import Recording

STEPS = 12  # of the bisection over a factor of 4: the frequency is found to 0.03 %
COUNT = 2 * pi / 8192  # one count of the encoders of Kadmiri et al. 2012 [rad]; lower flights are not resolved
FRAMES = ("active", "active", "flight", "flight", "reverse", "reverse", "flight", "flight", "active")  # at 0, T/8 ... T
BACKLASHES = range(50, 2001, 50)  # range of the rig [µm]
ORIGINS = np.arange(0.0, 1.0, 0.005)  # phases of the first picture in the period [cycles]


@measure
def drive_amplitude(case: Case) -> float:
    """Return the drive's amplitude along the line of action, of its first harmonic [m]."""
    harmonic = case.scenario.motion.harmonics[0]
    return float(amplitude_of(harmonic.amplitude, case.rig.base_radius_drive, 2 * pi * harmonic.frequency))


@measure
def drag_force(case: Case) -> float:
    """Return the drag along the line of action [N]."""
    return float(force_of(case.rig.drag_torque, case.rig.base_radius_loose))


@measure
def excitation(case: Case) -> float:
    """Return Λ = m·H·ω²/F of the first harmonic."""
    omega = 2 * pi * case.scenario.motion.harmonics[0].frequency
    mass = equivalent_mass(case.rig.inertia, case.rig.base_radius_loose)
    return excitation_of(mass, drive_amplitude(case), omega, drag_force(case))


@measure
def threshold_excitation(case: Case) -> float:
    """Return Λ at which the rigid model loses contact, bisected over the drive's amplitude."""
    from gears3d.lumped.model import model
    from gears3d.lumped.run import run

    def compute() -> float:
        harmonic = case.scenario.motion.harmonics[0]
        low, high = 0.1, 10.0
        for _ in range(20):
            middle = 0.5 * (low + high)
            drive = (middle * harmonic.amplitude, harmonic.frequency, harmonic.phase)
            lost = len(run(model(case.rig, [drive]), 5.0 / harmonic.frequency).impacts)
            low, high = (low, middle) if lost else (middle, high)
        return 0.5 * (low + high) * excitation(case)

    return case.once("threshold", compute)


@measure
def threshold_amplitude(case: Case) -> float:
    """Return the amplitude of the drive's speed at which the rigid model loses contact [rad/s]."""
    return case.scenario.motion.harmonics[0].amplitude * threshold_excitation(case) / excitation(case)


def threshold(case: Case, amplitude: float, way: str = "up", error: str = "") -> float:
    """Return the frequency at which rattle begins (``up``, from contact) or ends (``down``, from flight) [Hz].

    As on the rig of Rigaud & Perret-Liaudet 2020, the frequency is swept at a constant amplitude [rpm]. The sweep is
    a bisection; each step is a run of its own. ``error`` names a scenario whose transmission error is added.
    """

    def search() -> float:
        _ = case.run  # its command belongs to the figure
        scenario = case.scenario
        unit = case.rig.drag_torque / case.rig.inertia / (2 * pi * amplitude * pi / 30)
        low, high = (unit * (0.05 if error else 0.5), unit * 2.0)
        more: dict[str, Any] = {"start.state": "active" if way == "up" else "free", "expect": {}}
        if error:
            more["effect"] = _transmission_errors(case.bench.case(error))
        for _ in range(STEPS):
            case.bench.breathe()
            middle = sqrt(low * high)
            lost = _rattles(scenario.with_({**_swept(amplitude, middle), **more}))
            low, high = (low, middle) if lost else (middle, high)
        return sqrt(low * high)

    return case.once(f"threshold {amplitude} {way} {error}", search)


def _swept(amplitude: float, frequency: float) -> dict[str, Any]:
    return {
        "motion.harmonics": [{"amplitude": f"{amplitude} rpm", "frequency": f"{frequency!r} Hz"}],
        "run.duration": "8 periods",
        "run.settle": "4 periods",
        "run.output_rate": "1 kHz",
    }


def _transmission_errors(case: Case) -> list[dict[str, Any]]:
    return [
        {"kind": "transmission_error", "order": e.order, "amplitude": f"{e.amplitude!r} m", "phase": f"{e.phase!r} rad"}
        for e in case.scenario.effects
    ]


def _rattles(scenario: Any) -> bool:
    from gears3d.signals import counted, window
    from gears3d.simulation import simulate

    run = simulate(scenario, "rigid")
    return counted(run.impacts, *window(run.signals, run.meta))["time_s"].size > 0


@measure
def threshold_frequency(case: Case, amplitude: float) -> float:
    """Return the frequency at which rattle begins at an amplitude of the drive's speed [rpm] [Hz]."""
    return threshold(case, amplitude)


@measure
def swept_excitation(case: Case, amplitude: float, error: str = "") -> float:
    """Return Λ* = J·ω·ΔΩ/Td at the frequency where rattle begins (Rigaud & Perret-Liaudet 2020, eq. (8))."""
    rig = case.rig
    return rig.inertia * 2 * pi * threshold(case, amplitude, error=error) * amplitude * pi / 30 / rig.drag_torque


@measure
def threshold_slope(case: Case, amplitudes: list[float]) -> float:
    """Return the slope of the threshold's frequency over the amplitude, both logarithmic."""
    found = [threshold(case, amplitude) for amplitude in amplitudes]
    return float(np.polyfit(np.log10(amplitudes), np.log10(found), 1)[0])


@measure
def hysteresis(case: Case, amplitudes: list[float]) -> float:
    """Return the largest ratio of the frequency where rattle ends to that where it begins.

    Amplitudes at which the drive would turn back are omitted.
    """
    kept = [each for each in amplitudes if each * pi / 30 < case.scenario.motion.mean]
    return max(threshold(case, each, "down") / threshold(case, each, "up") for each in kept)


@measure
def outcome(case: Case, of: str, sign: int = 1) -> float | str:
    """Return an entry of the run's summary, of which a number may be given the opposite sign."""
    found = case.outcome[of]
    return sign * found if isinstance(found, int | float) else str(found)


@measure
def response(case: Case) -> str:
    """Return after how many periods the response repeats, and how many impacts a period has."""
    return "{motion}, {impacts_per_period:.3g} impacts".format(**case.outcome)


def double_sided(cases: list[Case]) -> list[Case]:
    """Return the cases with impacts on both flanks."""
    return [case for case in cases if case.outcome["regime"] == "double_sided"]


@measure
def faster_flank(cases: list[Case], of: str) -> str:
    """Return the flank of the faster impacts in all double-sided cases, by an entry of the summary, or ``"mixed"``."""
    ratio = [abs(case.outcome[f"active_{of}"] / case.outcome[f"reverse_{of}"]) for case in double_sided(cases)]
    return "active" if min(ratio) > 1.0 else "reverse" if max(ratio) < 1.0 else "mixed"


@measure
def contact_over_flight(case: Case) -> float:
    """Return by which factor flights and the contacts after them differ in duration at most."""
    found = case.outcome
    ratios = [found[f"{flank}_contact_mean_s"] / found[f"{flank}_crossing_mean_s"] for flank in ("active", "reverse")]
    return max(max(ratio, 1.0 / ratio) for ratio in ratios)


@measure
def double_sided_mean(cases: list[Case], of: str) -> float:
    """Return the mean of an entry of the summary over the double-sided cases."""
    return float(np.mean([case.outcome[of] for case in double_sided(cases)]))


def decades(cases: list[Case], of: str, power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return log10 of ω^power·ΔΩ [Hz, rpm] and an entry of the summary [dB], for the double-sided cases."""
    chosen = double_sided(cases)
    harmonics = [case.scenario.motion.harmonics[0] for case in chosen]
    abscissa = np.log10([30 / pi * each.amplitude * each.frequency**power for each in harmonics])
    return abscissa, 10 * np.log10([case.outcome[of] for case in chosen])


@measure
def decibel_slope(cases: list[Case], of: str, power: int) -> float:
    """Return how an entry of the summary rises [dB per decade of ω^power·ΔΩ], over the double-sided cases."""
    return float(np.polyfit(*decades(cases, of, power), 1)[0])


@measure
def rank_correlation(cases: list[Case], of: str, power: int) -> float:
    """Return the rank correlation of an entry of the summary with ω^power·ΔΩ, over the double-sided cases."""
    product, entry = (np.argsort(np.argsort(each)) for each in decades(cases, of, power))
    return float(np.corrcoef(product, entry)[0, 1])


@measure
def lasting_contact(case: Case) -> str:
    """Return whether each crossing ends in a lasting contact with the flank that it reaches."""
    found = case.outcome
    lasting = all(found[f"{flank}_contacts"] >= found[f"{flank}_crossings"] - 1 > 0 for flank in ("active", "reverse"))
    return "contact after each impact" if lasting else "rebounds"


def phases(run: Recording, times: np.ndarray) -> np.ndarray:
    """Return the phases of times in the period of the excitation [cycles], (n,)."""
    return np.mod(times / run.meta["period_s"], 1.0)


@measure
def losses(case: Case) -> np.ndarray:
    """Return the phase of the first loss of the active flank in each settled period [cycles], (n,).

    Impacts on the active flank must have died out by phase 0.15.
    """
    from gears3d.signals import flights

    run = case.run
    meta = run.meta
    found = flights(run.impacts["time_s"], run.impacts["flank"], meta["contacts"])
    left = found.start[(found.left == 0) & (found.end - found.start > 1e-3) & (found.start > meta["settle_s"])]
    cycle, phase = np.floor(left / meta["period_s"]), phases(run, left)
    first = (phase > 0.15) & (phase < 0.5)
    return np.array([phase[first & (cycle == each)].min() for each in np.unique(cycle[first])])


@measure
def loss_advance(cases: list[Case]) -> float:
    """Return by how much the effects of the cases make the loss of the active flank earlier [cycles]."""
    first = cases[0]
    perfect = first.bench.case(first.name, {"effect": [], "run.output_rate": "2 kHz"})
    return float(losses(perfect).mean() - np.concatenate([losses(case) for case in cases]).mean())


@measure
def crossing_velocities(cases: list[Case], flank: str) -> np.ndarray:
    """Return the velocities of the settled impacts after flights across the backlash, of all cases [m/s].

    They are signed as in the paper: positive on the ``active`` flank, negative on the ``reverse`` one.
    """
    code, found = ("active", "reverse").index(flank), []
    for run in (case.run for case in cases):
        hits, meta = run.impacts, run.meta
        across = hits["flight_height_m"] > 0.9 * meta["backlash_m"]
        settled = hits["time_s"] > meta["settle_s"]
        found.append(np.abs(hits["velocity_m_s"][across & settled & (hits["flank"] == code)]))
    return np.concatenate(found) * (1, -1)[code]


@measure
def crossing_change(cases: list[Case], perfect: str, overrides: dict[str, Any]) -> float:
    """Return the larger relative change of the two mean impact speeds from those of a case without effects."""
    before = cases[0].bench.case(perfect, overrides).outcome
    ratios = [
        crossing_velocities(cases, flank).mean() / before[f"{flank}_velocity_mean_m_s"]
        for flank in ("active", "reverse")
    ]
    return float(np.abs(np.abs(ratios) - 1).max())


@measure
def repetition(case: Case) -> str:
    """Return ``"repeats"`` if the motion does after any number of periods, else its name."""
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


@measure
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


def impulses(case: Case, wanted: float, run: str, reference: str = "") -> np.ndarray:
    """Return the dimensionless impulses at an excitation, after flights across at least half of the backlash.

    ``reference`` names a case whose backlash, in terms of the drive's amplitude, is used.
    """
    moved = at_excitation(case, wanted, run)
    size = drive_amplitude(case) * wanted / excitation(case)
    if reference:
        like = case.bench.case(reference)
        last = drive_amplitude(like) * wanted / excitation(like)
        moved = moved.with_({"mount.backlash": f"{100 * size / last:.6f} um"})
    scenario, rig, hits = moved.scenario, moved.rig, moved.run.impacts
    kept = (hits["time_s"] >= scenario.run.settle) & (hits["flight_height_m"] > 0.5 * rig.backlash)
    mass = equivalent_mass(rig.inertia, rig.base_radius_loose)
    return dimensionless_impulse(hits["impulse_N_s"][kept], mass, size, 2 * pi * scenario.motion.harmonics[0].frequency)


@measure
def mean_impulse(case: Case, wanted: float, run: str, reference: str = "") -> float:
    """Return the mean dimensionless impulse at an excitation."""
    return float(np.abs(impulses(case, wanted, run, reference)).mean())


def contacts_of(case: Case) -> tuple[np.ndarray, float]:
    """Return flank, begin and end of the contacts [s], (n, 3), and the period [s], of a run of 7 periods."""
    meta = case.with_({"run.duration": "7 periods", "run.output_rate": "1 kHz"}).run.meta
    return np.array(meta["contacts"]).reshape(-1, 3), meta["period_s"]


def pictured(case: Case, origin: float) -> list[str]:
    """Return what nine pictures would show, the first of them at a phase [cycles]."""
    found, period = contacts_of(case)
    shown = []
    for frame in range(9):
        time = period * (4 + origin + frame / 8)
        there = found[(found[:, 1] <= time) & (time <= found[:, 2]), 0]
        shown.append(("active", "reverse")[int(there[0])] if there.size else "flight")
    return shown


def best_pictures(case: Case) -> tuple[int, int, float]:
    """Return the largest number of pictures that agree, and the first backlash [µm] and origin [cycles] with it."""

    def compute() -> tuple[int, int, float]:
        found = [
            (sum(one == two for one, two in zip(pictured(at, float(origin)), FRAMES, strict=True)), backlash, origin)
            for backlash in BACKLASHES
            for at in [case.with_({"mount.backlash": f"{backlash} um"})]
            for origin in ORIGINS
        ]
        most = max(count for count, _, _ in found)
        _, backlash, origin = next(each for each in found if each[0] == most)
        return most, backlash, float(origin)

    return case.once("pictures", compute)


@measure
def agreeing_pictures(case: Case) -> float:
    """Return how many pictures show the state of the paper, at the best backlash and the best origin."""
    return float(best_pictures(case)[0])


@measure
def tooth_pair(case: Case, frame: int) -> float:
    """Return the number of the tooth pair at the pitch point in a picture, fractions between two."""
    scenario, run = case.scenario, case.run
    origin = best_pictures(case)[2] * scenario.period
    angle = np.interp([origin, origin + frame / 8 * scenario.period], run.time, run.signals["theta_drive_rad"])
    return float(1 + np.diff(angle)[0] * scenario.gears.drive.teeth / (2 * np.pi))


@measure
def state_order(case: Case) -> str:
    """Return the order of the states over a period, from the active flank."""
    found, period = contacts_of(case)
    inside = found[(found[:, 2] > 3 * period) & (found[:, 1] < 4.9 * period)]
    names = [("active", "reverse")[int(flank)] for flank in inside[:, 0]]
    first = names.index("active")
    return ", flight, ".join(names[first : first + 2]) + ", flight"


@measure
def shortest_state(case: Case) -> float:
    """Return the shorter of the mean flight across the backlash and the mean contact, in meshing periods."""
    found: dict[str, Any] = case.outcome
    scenario = case.scenario
    mesh = 2 * np.pi / scenario.motion.mean / scenario.gears.drive.teeth
    means = [
        np.mean([found[f"{flank}_{state}_mean_s"] for flank in ("active", "reverse")])
        for state in ("crossing", "contact")
    ]
    return float(min(means) / mesh)

"""Faulty solids in the engine: a thick tooth, eccentric teeth, and the diagnosis of faults with the perfect rig."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.comparison import compare
from gears3d.gears import Eccentricity, Pair, ToothDeviation
from gears3d.laws import crossing, loss_phases
from gears3d.recording import Recording
from gears3d.scenario import Scenario, load
from gears3d.simulation import record, simulate
from gears3d.verification.validation.check import Check, fig5, swing

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis

EXTRA = 10e-6  # Material on each of the two flanks of the faulty tooth [m]: it is 20 µm thicker


@dataclass(frozen=True)
class ThickTooth:
    """One thick tooth, told to nobody."""

    sound: Recording  # the engine's recording with perfect gears
    faulty: Recording  # the engine's recording with the thick tooth
    twin: Recording  # the untold twin's
    tooth: int  # its number in order of meshing
    moved: tuple[float, float]  # closed-form change of the time of its first impact [s] and of its speed [m/s]

    @property
    def found(self) -> tuple[float, float]:
        """Measured change of the time [s] and the speed [m/s] of the first impact."""
        change = [self.faulty.impacts[name][0] - self.sound.impacts[name][0] for name in ("time_s", "velocity_m_s")]
        return float(change[0]), float(change[1])


def thick_tooth() -> ThickTooth:
    """Run figure 5 with a loose gear whose tooth at the first reverse impact is 20 µm thicker."""
    scenario = fig5()
    sound = simulate(scenario)
    tooth = int(sound.impacts["tooth_loose"][0])
    fault = [ToothDeviation("loose", flank, tooth, EXTRA) for flank in ("active", "reverse")]
    faulty = simulate(scenario, pair=scenario.pair().with_deviations(*fault))
    return ThickTooth(sound, faulty, simulate(scenario, "rigid"), tooth, closed_form(EXTRA))


def closed_form(extra: float) -> tuple[float, float]:
    """Return how the first reverse impact moves when the gap is narrower at its end.

    Args:
        extra: material on the reverse flank [m].

    Returns:
        Change of its time [s] and of its approach speed [m/s].
    """
    scenario = fig5()
    drive, backlash = swing(scenario), scenario.rig().backlash
    phase, _ = loss_phases(drive.excitation)
    sound, faulty = (crossing(drive.speed, drive.omega, drive.pull, phase, gap) for gap in (backlash, backlash - extra))
    return faulty[0] - sound[0], faulty[1] - sound[1]


def check_faults(quick: bool = False) -> Iterator[Check]:
    """Faults that nobody told: the engine finds them, the twin cannot.

    One tooth is made thicker on the solid alone. What its impacts must then do follows in closed form from the
    equations of flight (Rigaud & Perret-Liaudet 2020, eqs 15 and 18) with the backlash less the extra material.
    """
    case = thick_tooth()
    for name, found, expected, unit in zip(("time", "speed"), case.found, case.moved, ("s", "m/s"), strict=True):
        yield Check(
            f"thick tooth: {name} of its impact moves by {expected:.3e} {unit}, relative error",
            abs(found / expected - 1),
            1e-3,
        )
    untold = compare(case.sound, case.twin).to_dict()
    told = compare(case.faulty, case.twin).to_dict()
    yield Check("sound gears against the twin: 95 % of the speed errors", untold["velocity_error_p95"], 0.006)
    yield Check(
        "thick tooth against the untold twin: 95 % of the speed errors", told["velocity_error_p95"], 0.01, at_least=True
    )


OFFSET, PHASE = 40e-6, 0.6  # m and rad


def resting(model: str, gear: str, flank: str) -> Recording:
    """Run a revolution at constant speed with the loose gear resting on one flank."""
    effect = {"kind": "eccentricity", "gear": gear, "offset": f"{OFFSET} m", "phase": f"{PHASE} rad"}
    mean = "60 rpm" if flank == "active" else "-60 rpm"
    scenario = fig5(motion__harmonics=[], motion__mean=mean, drag__torque="5 N m", start__state=flank)
    changes = {"effect": [effect], "run.duration": "1 s", "run.output_rate": "200 Hz"}
    return simulate(scenario.with_(changes), model)


def first_order(pair: Pair, gear: str, flank: str, theta: np.ndarray) -> np.ndarray:
    """Return the displacement at which a flank touches, to the first order of the offset [m].

    Units: ``theta`` [rad], (n,).
    """
    sense = 1.0 if gear == "drive" else -1.0
    lean = sense * pair.working_pressure_angle * (1.0 if flank == "active" else -1.0)
    moved = sense * OFFSET * np.sin(theta + PHASE + lean)
    return moved if flank == "active" else pair.backlash + moved


def check_eccentric(quick: bool = False) -> Iterator[Check]:
    """Eccentric teeth: the engine turns real ones, the twin has their first order, both stand against closed forms.

    The teeth's axis stands off the axis of rotation. Each flank then touches elsewhere by the offset's part along its
    normal, and the backlash changes by twice the offset's part towards the mate times sin αw; the remainder is of
    second order, the offset squared over the length of the path of contact.
    """
    from gears3d.gears import quasi_static

    pair = fig5().pair()
    second = OFFSET**2 / pair.path_length
    for gear in ("drive",) if quick else ("drive", "loose"):
        for flank in ("active", "reverse"):
            case = f"{gear} 40 um eccentric, {flank} flank"
            engine, twin = (resting(model, gear, flank).signals for model in ("bullet", "rigid"))
            for name, signals in (("engine", engine), ("twin", twin)):
                off = signals["displacement_m"] - first_order(pair, gear, flank, signals[f"theta_{gear}_rad"])
                yield Check(f"{case}: {name} off the first order", float(np.abs(off).max()), second, "m")
            exact = quasi_static(pair.with_mounting(Eccentricity(gear, OFFSET, PHASE)), engine["theta_drive_rad"])
            there = exact.phi_active if flank == "active" else exact.phi_reverse + pair.backlash
            off = float(np.abs(engine["displacement_m"] - there).max())
            yield Check(f"{case}: engine off the surfaces rolled without load", off, 1e-11, "m")


BENCH = """
format = 1
title = "Bench 23:37"
[gears]
module = "3 mm"
face_width = "15 mm"
drive = { teeth = 23 }
loose = { teeth = 37, inertia = "0.006 kg m^2" }
[mount]
backlash = "200 um"
[motion]
mean = "200 rpm"
harmonics = [ { amplitude = "24 rpm", frequency = "3.7 Hz" } ]
[drag]
torque = "0.08 N m"
[impact]
restitution = 0.35
[run]
duration = "5 s"
settle = "0 s"
[sensors]
sample_rate = "20 kHz"
counts_per_revolution = 1048576
drive = { noise = "3 urad" }
loose = { noise = "3 urad" }
"""
SPEEDS = ("43 rpm", "97 rpm", "205 rpm")  # Mean speeds of the drive, one record each


class SolidFault(NamedTuple):
    """One fault of the solids."""

    name: str  # in words
    truth: dict[str, Any]  # changes of the bench
    kinds: tuple[str, ...]  # of effects that are the right answer, the first one preferred


def _tooth(number: int, offset: str, flank: str) -> dict[str, Any]:
    return {"kind": "pitch_error", "gear": "drive", "tooth": number, "offset": offset, "flank": flank}


FAULTS = (
    SolidFault(
        "eccentric axis", {"gears.drive.eccentricity": {"offset": "20 um", "phase": "50 deg"}}, ("eccentricity",)
    ),
    SolidFault(
        "thick tooth", {"effect": [_tooth(7, "5 um", "active"), _tooth(7, "-5 um", "reverse")]}, ("pitch_error",)
    ),
    SolidFault("pitch errors", {"effect": [_tooth(5, "5 um", "both"), _tooth(16, "7 um", "both")]}, ("pitch_error",)),
    SolidFault("centre distance", {"mount.backlash": "240 um"}, ("backlash_offset",)),
    SolidFault("misaligned axis", {"mount.misalignment": {"out_of_plane": "0.1 deg"}}, ("backlash_offset",)),
)


class Judged(NamedTuple):
    """How a fault was diagnosed."""

    fault: SolidFault  # that was there
    found: Diagnosis  # by the diagnosis, with its gain in the engine
    truth: Scenario  # scenario that made the data
    # dissipated in the impacts a second by truth, rig and extended rig in the engine [J/s]
    energy: tuple[float, float, float]

    @property
    def right(self) -> bool:
        """Whether the first cause, and no other kind than those of the fault, is named."""
        named = [one.kind for one in self.found.causes]
        return bool(named) and named[0] in self.fault.kinds and set(named) <= set(self.fault.kinds)

    @property
    def gains(self) -> tuple[float | None, float | None, float | None]:
        """On held-out data: of the rigid model over all, of the engine, of the rigid model over the engine's events."""
        told = self.found.to_dict()
        return told["heldout"]["gain"], told["heldout_3d"]["gain"], told["heldout_3d"].get("gain_rigid")


def judged(fault: SolidFault, folder: Path, duration: str = "5 s") -> Judged:
    """Make the data of a fault, diagnose them with the perfect rig, and run the extended rig in the engine.

    The engine's solids are what is wrong; the diagnosis gets encoder records and the nominal scenario.
    """
    from gears3d.diagnosis import diagnose
    from gears3d.measured.checks import admit

    rig = load(BENCH, {"run.duration": duration})
    truth = rig.with_(fault.truth)
    admitted = []
    for k, mean in enumerate(SPEEDS):
        path = folder / f"{k}.parquet"
        record(truth.with_({"motion.mean": mean}), model="bullet", seed=k).write(path)
        admitted.append(admit(path, rig.with_({"motion.mean": mean})))
    found = diagnose(admitted, rig, bodies=True)
    return Judged(fault, found, truth, _energies(truth, rig, found.extended))


def _energies(truth: Scenario, rig: Scenario, extended: Scenario) -> tuple[float, float, float]:
    """Return what impacts dissipate over the first second [J/s]."""
    made = [simulate(one.with_({"run.duration": "1 s"}), "bullet") for one in (truth, rig, extended)]
    mass = rig.rig().inertia / rig.rig().base_radius_loose ** 2
    speeds = [(one.impacts["velocity_m_s"], one.impacts["rebound_m_s"]) for one in made]
    first, second, third = (float(0.5 * mass * (v @ v - r @ r)) for v, r in speeds)
    return first, second, third


def rows(folder: Path, duration: str = "5 s") -> Iterator[Judged]:
    """Diagnose every fault."""
    for fault in FAULTS:
        own = folder / fault.name.replace(" ", "-")
        own.mkdir(parents=True, exist_ok=True)
        yield judged(fault, own, duration)

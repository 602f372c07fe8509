"""Data of faulty solids from the 3D engine, diagnosed with the rig of perfect ones.

The engine's solids are what is wrong: an axis off the teeth's, a thick tooth, teeth out of place, another centre
distance, an axis that leans. Nobody tells the diagnosis; it gets encoder records and the nominal scenario.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from gears3d.diagnosis import Diagnosis, diagnose
from gears3d.measured.checks import admit
from gears3d.scenario import Scenario, load
from gears3d.simulation import record, simulate

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
    """Make the data of a fault, diagnose them with the perfect rig, and run the extended rig in the engine."""
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

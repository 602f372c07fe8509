"""Terms that pages explain: the meaning in one sentence, and the page of the documentation with the theory."""

from __future__ import annotations

DOCS = "https://github.com/gears3d/gears3d/blob/main/docs/"
_GEARS, _CONTACT, _RECORDS, _CAUSES = (
    f"glossary.md#{part}" for part in ("gears-and-motion", "contact", "measurement", "inference")
)
TERMS: dict[str, tuple[str, str]] = {
    "drive gear": ("Driving gear: its motion is imposed.", _GEARS),
    "loose gear": ("Idle (unloaded) gear: it is moved through the mesh and resisted by drag only.", _GEARS),
    "active flank": ("Working flank, on which the drive gear accelerates the loose gear.", _GEARS),
    "reverse flank": ("Non-working flank, on which the drive gear decelerates the loose gear.", _GEARS),
    "displacement": (
        "Position of the loose gear relative to the drive gear along the transverse line of action: 0 where the active "
        "flanks touch, equal to the backlash where the reverse flanks touch.",
        _GEARS,
    ),
    "backlash": (
        "Range of the displacement without contact, along the transverse line of action.",
        "theory/geometry.md",
    ),
    "excitation": (
        "Λ: inertia torque of the fluctuation over the drag torque; with rigid teeth contact is lost above 1.",
        _GEARS,
    ),
    "drag": ("Torque that resists the rotation of the loose gear: bearings, seals, oil.", "theory/identification.md"),
    "regime": (
        "Contact, single-sided impacts (on one flank) or double-sided impacts (on both flanks: rattle).",
        _GEARS,
    ),
    "periodicity": ("1T: the motion repeats every period of the drive's fluctuation; 2T: every second one.", _GEARS),
    "Poincaré section": (
        "Impact velocity over the phase of the fluctuation: few points if periodic, a cloud if chaotic.",
        _GEARS,
    ),
    "Lyapunov exponent": ("Rate at which neighbouring motions separate; positive for a chaotic motion.", _GEARS),
    "impact": ("Short contact that reverses the relative velocity.", _CONTACT),
    "restitution": ("Coefficient of restitution: rebound speed over approach speed.", _CONTACT),
    "free flight": ("Motion between two contacts; only drag acts on the loose gear.", _CONTACT),
    "transmission error": ("Deviation of the displacement in contact from that of perfect involutes.", _CONTACT),
    "order": ("Number of periods per revolution of a gear.", _CONTACT),
    "rigid model": (
        "Independent model with one degree of freedom: the loose gear between two walls.",
        "architecture.md",
    ),
    "error budget": ("Largest errors of the gap by their causes, along the line of action.", "architecture.md"),
    "noise": ("Standard deviation of one reading, as displacement along the line of action.", _RECORDS),
    "goodness-of-fit test": (
        "χ² test of the readings of a flight against free flight; flights with p < 0.1 % are not used.",
        "theory/segmentation.md",
    ),
    "sensor gate": (
        "Checks of rows, clock, units, signs, ratios and counts before any analysis.",
        "howto/sensor-faults.md",
    ),
    "held-out": ("Data that were excluded from the fit and then predicted.", _CAUSES),
    "residual": ("Measurement minus prediction.", _CAUSES),
    "95 %": ("Interval that contains the true value in 95 of 100 repetitions.", _CAUSES),
    "nominal model": ("Scenario of the test rig before any correction.", _CAUSES),
    "extended model": ("Nominal model with the reported causes.", _CAUSES),
    "channel": ("Kind of data that is predicted: flight, contact, impact, loss of contact, drive.", _CAUSES),
    "cause": (
        "Effect of the catalogue whose addition reduces the residuals significantly (Δχ² > 30).",
        "theory/diagnosis.md",
    ),
    "competing hypothesis": ("Another cause that could explain the same data.", "theory/diagnosis.md"),
    "minimum detectable effect": ("Smallest size at which a cause would be reported.", "theory/diagnosis.md"),
}
"""Meaning and page by term."""

"""Figures 5 and 6 of Rigaud & Perret-Liaudet 2020: the responses, over the amplitude and over the frequency."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from gears3d.verification.papers.rigaud_2020 import theory
from gears3d.verification.papers.rigaud_2020.points import PLASTIC, THRESHOLD_SCATTER, plastic, row
from gears3d.verification.papers.rigaud_2020.threshold import threshold

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

FIG5 = {0: "fig5-0rpm", 1.6: "fig5-1.6rpm", 5: "fig5-5rpm", 20: "fig5-20rpm"}
FIG6 = {0.7: "fig6-0.7Hz", 1: "fig6-1Hz", 3: "fig6-3Hz", 5: "fig6-5Hz", 10: "fig6-10Hz"}
"""Scenarios by amplitude [rpm] at 3 Hz, and by frequency [Hz] at 5 rpm."""


def regime(bench: Bench, name: str) -> str:
    """Return the regime of a scenario.

    Args:
        bench: of the papers.
        name: of its file.
    """
    return bench.outcome(f"rigaud-2020/{name}.toml")["regime"]


def light_losses(bench: Bench) -> str:
    """Return whether steady 30 rpm on the flanks of fig. 2 loses contact now and then.

    Args:
        bench: of the papers.
    """
    return "some" if bench.outcome("rigaud-2020/fig12-0rpm.toml")["impacts"] else "none"


def motion(bench: Bench, amplitude: float, frequency: float) -> str:
    """Return after how many periods the response repeats, and how many impacts a period has.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    found = plastic(bench, amplitude, frequency)
    return f"{found['motion']}, {found['impacts_per_period']:.3g} impacts"


def in_the_engine(bench: Bench, name: str, key: str) -> str:
    """Return the regime or the response of a scenario with perfectly plastic impacts, six periods of rigid bodies.

    Args:
        bench: of the papers.
        name: of its file.
        key: ``"regime"`` or ``"motion"``.
    """
    more = {**PLASTIC, "run.duration": "6 periods", "run.output_rate": "2 kHz"}
    found = bench.outcome(f"rigaud-2020/{name}.toml", more, "bullet")
    return found["regime"] if key == "regime" else f"{found['motion']}, {found['impacts_per_period']:.3g} impacts"


def speeds(bench: Bench, amplitude: float, frequency: float) -> tuple[float, float]:
    """Return the mean impact speeds as the paper signs them, active positive, reverse negative [mm/s].

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    found = plastic(bench, amplitude, frequency)
    return -1e3 * found["active_velocity_mean_m_s"], -1e3 * found["reverse_velocity_mean_m_s"]


def with_flanks(bench: Bench, flank: str) -> float:
    """Return the mean impact velocity at 20 rpm and 3 Hz, transmission error of fig. 2 and 150 µm backlash [mm/s].

    Args:
        bench: of the papers.
        flank: ``"active"`` (positive as in the paper) or ``"reverse"`` (negative).
    """
    active = flank == "active"
    return float(1e3 * theory.speeds(bench, 20, 3, 0 if active else 1, "150 um").mean()) * (1 if active else -1)


def faster_flank(bench: Bench, amplitude: float, frequency: float) -> str:
    """Return which flank is struck faster.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    active, reverse = speeds(bench, amplitude, frequency)
    return "active" if active > -reverse else "reverse"


def magnitudes(bench: Bench, amplitude: float, frequency: float) -> str:
    """Return whether every flight and the contact after it last as long as each other within a factor of ten.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    found = plastic(bench, amplitude, frequency)
    ratios = [found[f"{flank}_contact_mean_s"] / found[f"{flank}_crossing_mean_s"] for flank in ("active", "reverse")]
    return "same order" if all(0.1 < ratio < 10 for ratio in ratios) else "other order"


_fig5, _fig6 = partial(row, figure="fig. 5"), partial(row, figure="fig. 6")
_VELOCITY = (
    "the backlash of this run is not printed; 250 µm of fig. 2 gives 31.2 and −30.9 mm/s. 150 µm gives 22.3 and −22.0: "
    "no backlash alone explains flanks that differ by a tenth. With 150 µm and the transmission error of fig. 2 both "
    "are met, see below"
)
_BOTH = (
    "the backlash is chosen so that the active flank gets its 22.3 mm/s, and this flank is the check. The mesh "
    "order acts with the square of the speed: the active flank is left near 50 rpm, early, and the gear arrives slow; "
    "the reverse flank is left near 10 rpm, as without it. But the same mesh order breaks the threshold (fig. 4)"
)
_INERTIA = (
    "the inertia is not printed: 0.0695 kg m² is what the threshold of 1.6 rpm at 3 Hz asks for (fig. 5), so this one "
    "is the check"
)
_MEANS = "printed scatter of Λ*"


def _claims5() -> list[Any]:
    words = {0: "contact", 1.6: "single_sided", 5: "double_sided", 20: "double_sided"}
    claims = []
    for amplitude, name in FIG5.items():
        more: dict[str, Any] = {}
        if amplitude == 1.6:
            more["recorded"] = "disagrees"
            more["note"] = (
                "Λ = 0.998 with the inertia used, which is not printed: perfect flanks just hold. With the "
                "transmission error of fig. 2 the light impacts are there (fig. 12, 1.6 rpm)"
            )
        text = f"regime at {amplitude:g} rpm, 3 Hz"
        claims.append(_fig5(quantity=text, published=words[amplitude], compute=partial(regime, name=name), **more))
    return claims


def _pairs(figure: Any, points: list[tuple[float, float]]) -> list[Any]:
    """Return the rows that every double-sided point has."""
    claims = []
    for amplitude, frequency in points:
        place = {"amplitude": amplitude, "frequency": frequency}
        at = f"at {amplitude:g} rpm, {frequency:g} Hz"
        one, two, three = (partial(each, **place) for each in (motion, faster_flank, magnitudes))
        claims.append(figure(quantity=f"response {at}", published="1T, 2 impacts", compute=one))
        claims.append(figure(quantity=f"flank that is struck faster {at}", published="active", compute=two))
        claims.append(figure(quantity=f"flight and the contact after it {at}", published="same order", compute=three))
    return claims


CLAIMS = (
    *_claims5(),
    _fig5(
        quantity="contact losses at 0 rpm, with the transmission error of fig. 2",
        published="some",
        compute=light_losses,
        recorded="disagrees",
        note="one sine of 5 µm at the mesh order takes 85 % of the drag; 0.3 µm of the second mesh order, "
        "whose amplitude is not printed, takes the rest",
    ),
    _fig5(
        quantity="mean impact velocity on the active flank, 20 rpm, 3 Hz",
        published=22.3,
        tolerance=2.1,
        unit="mm/s",
        compute=lambda bench: speeds(bench, 20, 3)[0],
        basis="printed standard deviation",
        recorded="disagrees",
        note=_VELOCITY,
    ),
    _fig5(
        quantity="mean impact velocity on the reverse flank, 20 rpm, 3 Hz",
        published=-19.9,
        tolerance=2.1,
        unit="mm/s",
        compute=lambda bench: speeds(bench, 20, 3)[1],
        basis="printed standard deviation",
        recorded="disagrees",
        note=_VELOCITY,
    ),
    _fig5(
        quantity="reverse flank with the transmission error of fig. 2 and a backlash of 150 µm",
        published=-19.9,
        tolerance=2.1,
        unit="mm/s",
        compute=partial(with_flanks, flank="reverse"),
        basis="printed standard deviation",
        note=_BOTH,
    ),
    *_pairs(_fig5, [(5, 3), (20, 3)]),
    _fig5(
        quantity="response at 20 rpm, 3 Hz, as rigid bodies",
        published="1T, 2 impacts",
        model="bullet",
        compute=partial(in_the_engine, name="fig5-20rpm", key="motion"),
    ),
    *(
        _fig6(
            quantity=f"regime at {frequency:g} Hz, 5 rpm", published=word, compute=partial(regime, name=FIG6[frequency])
        )
        for frequency, word in zip(FIG6, ("contact", "single_sided", *("double_sided",) * 3), strict=True)
    ),
    _fig6(
        quantity="frequency at which rattle begins, 5 rpm",
        published=1.0,
        tolerance=round(THRESHOLD_SCATTER, 2),
        unit="Hz",
        compute=lambda bench: threshold(bench, 0.22, 30, 5.0),
        basis=_MEANS,
        note=_INERTIA,
    ),
    *_pairs(_fig6, [(5, 5), (5, 10)]),
    _fig6(
        quantity="regime at 1 Hz, 5 rpm, as rigid bodies",
        published="single_sided",
        model="bullet",
        compute=partial(in_the_engine, name="fig6-1Hz", key="regime"),
    ),
)
"""Rows of figures 5 and 6; 5 rpm at 3 Hz, which both show, stands under figure 5."""

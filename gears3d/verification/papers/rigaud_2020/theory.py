"""Figures 10 to 12 of Rigaud & Perret-Liaudet 2020: the model's own responses.

The phases of the transmission error of eq. (21) are not printed. On the bench the mesh drifts past the excitation, so
what figure 12 says is judged over eight phases of the mesh order.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.verification.papers.rigaud_2020.points import SCATTER, phases, plastic, row

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.verification.papers.bench import Bench

FIG10, FIG11 = "rigaud-2020/fig10.toml", "rigaud-2020/fig11.toml"
FIG12 = {(1.6, 3): "single_sided", (5, 1): "single_sided", (5, 3): "double_sided", (5, 5): "double_sided"}
FIG12 |= {(5, 10): "double_sided", (20, 3): "double_sided"}
"""Regime by amplitude [rpm] and frequency [Hz]; the responses are said to be those of figs 5 and 6."""
ESTABLISHED = ((5, 3), (5, 5), (5, 10), (20, 3))
MESH_PHASES = range(0, 360, 45)
"""Of the mesh order [deg]."""


def name(amplitude: float, frequency: float) -> str:
    """Return the scenario of a response of fig. 12.

    Args:
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    return f"rigaud-2020/fig12-{amplitude:g}rpm-{frequency:g}Hz.toml"


def runs(bench: Bench, amplitude: float, frequency: float, backlash: str = "250 um") -> list[Recording]:
    """Return the runs of a response of fig. 12 for all phases of the mesh order.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
        backlash: with its unit.
    """
    more = {"mount.backlash": backlash, "run.output_rate": "2 kHz"}
    each = [{"effect[1].phase": f"{phase} deg", **more} for phase in MESH_PHASES]
    return [bench.run(name(amplitude, frequency), overrides) for overrides in each]


def losses(recording: Recording) -> np.ndarray:
    """Return the phase of the first loss of the active flank in each settled period [cycles], (n,).

    Args:
        recording: of a scenario whose impacts on the active flank have died out by phase 0.15.
    """
    from gears3d.signals import flights

    meta = recording.meta
    found = flights(recording.impacts["time_s"], recording.impacts["flank"], meta["contacts"])
    left = found.start[(found.left == 0) & (found.end - found.start > 1e-3) & (found.start > meta["settle_s"])]
    cycle, phase = np.floor(left / meta["period_s"]), phases(recording, left)
    first = (phase > 0.15) & (phase < 0.5)
    return np.array([phase[first & (cycle == each)].min() for each in np.unique(cycle[first])])


def advance(bench: Bench, amplitude: float, frequency: float) -> float:
    """Return by how much the transmission error makes the loss of the active flank earlier [cycles].

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    perfect = bench.run(name(amplitude, frequency), {"effect": [], "run.output_rate": "2 kHz"})
    early = np.concatenate([losses(each) for each in runs(bench, amplitude, frequency)])
    return float(losses(perfect).mean() - early.mean())


def premature(bench: Bench, amplitude: float, frequency: float) -> str:
    """Return whether contact is lost slightly early, by less than a tenth of a period.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    cycles = advance(bench, amplitude, frequency)
    return "slightly early" if 0 < cycles < 0.1 else f"{cycles:+.2f} T early"


def speeds(bench: Bench, amplitude: float, frequency: float, flank: int, backlash: str = "250 um") -> np.ndarray:
    """Return the speeds of the impacts that end a flight across the backlash, all phases of the mesh [m/s], (n,).

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
        flank: 0 active, 1 reverse.
        backlash: with its unit.
    """
    found = []
    for run in runs(bench, amplitude, frequency, backlash):
        hits, meta = run.impacts, run.meta
        across = hits["flight_height_m"] > 0.9 * meta["backlash_m"]
        settled = hits["time_s"] > meta["settle_s"]
        found.append(np.abs(hits["velocity_m_s"][across & settled & (hits["flank"] == flank)]))
    return np.concatenate(found)


def change(bench: Bench, amplitude: float, frequency: float) -> float:
    """Return the larger change of the two mean impact speeds by the transmission error [%].

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    before = plastic(bench, amplitude, frequency)
    ratios = [
        speeds(bench, amplitude, frequency, code).mean() / abs(before[f"{flank}_velocity_mean_m_s"])
        for code, flank in enumerate(("active", "reverse"))
    ]
    return float(100 * np.abs(np.array(ratios) - 1).max())


def dispersion(bench: Bench, amplitude: float, frequency: float) -> str:
    """Return whether the transmission error scatters the impact speeds, by less than a fifth of their mean.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    parts = [speeds(bench, amplitude, frequency, flank) for flank in (0, 1)]
    part = max(float(each.std() / each.mean()) for each in parts)
    return "slight" if 0.001 < part < 0.2 else f"{100 * part:.1f} %"


def stays(bench: Bench, scenario: str) -> str:
    """Return whether each crossing ends in a lasting contact with the flank that was struck.

    Args:
        bench: of the papers.
        scenario: name of its file.
    """
    found = bench.outcome(scenario)
    lasting = all(found[f"{flank}_contacts"] >= found[f"{flank}_crossings"] - 1 > 0 for flank in ("active", "reverse"))
    return "contact after each impact" if lasting else "rebounds"


def shift(bench: Bench) -> float:
    """Return how far restitution 0.3 moves the loss of the active flank [cycles].

    Args:
        bench: of the papers.
    """
    return float(abs(losses(bench.run(FIG11)).mean() - losses(bench.run(FIG10)).mean()))


_fig10, _fig11, _fig12 = (partial(row, figure=f"fig. {number}") for number in (10, 11, 12))


def _established(amplitude: float, frequency: float) -> list[Any]:
    place: dict[str, Any] = {"amplitude": amplitude, "frequency": frequency}
    at = f"{amplitude:g} rpm, {frequency:g} Hz"
    return [
        _fig12(
            quantity=f"loss of the active flank with the transmission error, {at}",
            published="slightly early",
            compute=partial(premature, **place),
        ),
        _fig12(
            quantity=f"change of the mean impact speeds by the transmission error, {at}",
            published=0.0,
            tolerance=round(100 * SCATTER, 1),
            unit="%",
            compute=partial(change, **place),
            basis='"negligible": printed scatter of the impact velocity',
        ),
        _fig12(
            quantity=f"dispersion of the impact speeds by the transmission error, {at}",
            published="slight",
            compute=partial(dispersion, **place),
        ),
    ]


CLAIMS = (
    _fig10(
        quantity="response at restitution 0",
        published="1T, 2 impacts",
        compute=lambda bench: "{motion}, {impacts_per_period:.3g} impacts".format(**bench.outcome(FIG10)),
    ),
    _fig10(
        quantity="after each impact",
        published="contact after each impact",
        compute=partial(stays, scenario=FIG10),
    ),
    _fig11(
        quantity="after each crossing at restitution 0.3",
        published="contact after each impact",
        compute=partial(stays, scenario=FIG11),
        note="a dying series of bounces comes first",
    ),
    _fig11(
        quantity="loss of the active flank, restitution 0.3 against 0",
        published=0.0,
        tolerance=0.01,
        unit="T",
        compute=shift,
        basis="both curves leave the flank together: width of a line in the plot",
    ),
    *(
        _fig12(
            quantity=f"regime at {amplitude:g} rpm, {frequency:g} Hz with the transmission error",
            published=word,
            compute=lambda bench, at=(amplitude, frequency): bench.outcome(name(*at))["regime"],
        )
        for (amplitude, frequency), word in FIG12.items()
    ),
    *(claim for place in ESTABLISHED for claim in _established(*place)),
)
"""Rows of figures 10 to 12."""

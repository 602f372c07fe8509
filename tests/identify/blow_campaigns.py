"""Whether intervals of restitution hold the truth, on three benches: what `tools/bench_identify restitution` asks."""

from gears3d.errors import InputError
from gears3d.identify import identify_restitution
from gears3d.measured.segmentation import measure
from tests.identify.benches import LAWS, TESTING
from tests.identify.benches import campaign as rattle

RIGS = {
    "rigaud-2020, 1 600 000 counts, 50 kHz": ("rigaud-2020", {}),
    "ottewill-2010, 40 000 counts, 1 kHz": ("ottewill-2010", {}),
    "kadmiri-2012, 8192 counts, edges to 1 us": ("kadmiri-2012", {"sensors.sample_rate": "1 MHz"}),
    "kadmiri-2012, 8192 counts, 50 kHz": ("kadmiri-2012", {}),
}
"""Bench and what is set of it; the third has a counter card that times edges."""
ASKED = {"linear": "linear", "asymmetric": "constant+asymmetry"}


def campaign(encoder, seed, kinds=("restitution",)):
    """Return rows of (kind, parameter, error over deviation, inside), laws missed or refused, and false scatters.

    A scatter that is none lies on the edge of what it may be: its error has no mean.
    """
    bench, more = RIGS[encoder]
    law = LAWS[seed % len(LAWS)]
    scenario, seen, truth = rattle(bench, law, TESTING + seed, **more)
    try:
        found = identify_restitution([measure(seen, scenario)], scenario.rig())
    except InputError as error:
        return [], [(kinds[0], f"refused: {error.faults[0].message}")], []
    flanks, rows, false = list(found.goodness["flanks"]), [], []
    for name, parameter in found.parameters.items():
        true = _true(name, truth, flanks)
        if name == "standard_deviation" and true == 0.0:
            false += [(kinds[0], f"scatter of {parameter.value:.2g}")] if parameter.low > 0.0 else []
            continue
        pull = (parameter.value - true) / ((parameter.high - parameter.low) / 3.92)
        rows.append((kinds[0], name, pull, bool(parameter.low <= true <= parameter.high)))
    asked = "constant" if len(flanks) == 1 and law == "asymmetric" else ASKED.get(law, "constant")
    return rows, [] if found.law == asked else [(kinds[0], f"{asked} taken for {found.law}")], false


def _true(name, truth, flanks):
    """The true number; where one flank tells the law, its coefficient is what is found."""
    value = truth.get(name, 0.0)
    if name == "restitution" and len(flanks) == 1:
        value += (0.5 if flanks == ["active"] else -0.5) * truth.get("asymmetry", 0.0)
    return value

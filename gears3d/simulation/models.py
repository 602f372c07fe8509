"""From a scenario to a recording: the choice of the model, and what a model refuses."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import EngineError, Fault, InputError, UsageError, did_you_mean
from gears3d.gears.deviation import GEARS
from gears3d.inputs import refuse_beyond
from gears3d.recording import Recording
from gears3d.simulation.sensors import observe
from gears3d.version import __version__

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.gears import Pair
    from gears3d.scenario import Scenario


_TAKEN = "gears3d show, gears3d export and gears.quasi_static take it"
Progress = Callable[[float], None]
SAMPLE = 110  # Bytes of memory for a sample: seven columns, while they are made and checked
# What each model is, in a line
ABOUT = {
    "bullet": "rigid bodies in PyBullet, contact located on the true flanks",
    "rigid": "the twin: one degree of freedom, every impact found",
    "plastic": "closed form for one harmonic, constant drag and impacts without rebound",
    "lubricated": "oil films on compliant teeth, with mesh stiffness and friction",
}
CONTACTS = ("located", "native")  # The contacts of the bullet model, the default first


def refuse_unseen(scenario: Scenario, model: str) -> None:
    """Refuse mountings and deviations of gears that a model does not see."""
    file = "" if scenario.path is None else str(scenario.path)
    faults = [
        Fault(key, f"is not in the {model} model yet", f"leave it out{remedy}; {_TAKEN}", file)
        for key, remedy in (_UNSEEN[model](scenario) if model in _UNSEEN else ())
    ]
    if faults:
        raise InputError(faults)


def refusals(scenario: Scenario, model: str) -> list[Fault]:
    """Return a fault for everything in a scenario that a model does not take, without running it.

    Args:
        scenario: as loaded.
        model: its name.
    """
    faults: list[Fault] = []
    for check in (partial(refuse_unseen, model=model), _ASSUMPTIONS.get(model, lambda _: None)):
        try:
            check(scenario)
        except InputError as error:
            faults += error.faults
    return faults


def _of_plastic(scenario: Scenario) -> None:
    from gears3d.lumped.plastic import assumed

    assumed(scenario)


def _of_lubricated(scenario: Scenario) -> None:
    from gears3d.lumped.lubricated.model import refusals as own

    if faults := own(scenario):
        raise InputError(faults)


def _off_axis(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yield what needs more than one transverse section."""
    from gears3d.gears.deviation import Wobble

    for which in GEARS:
        if any(isinstance(item, Wobble) for item in getattr(scenario.gears, which).mounting):
            yield f"gears.{which}.wobble", ""
    if scenario.mount.misalignment is not None:
        yield "mount.misalignment", ""


def _beyond_perfect(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yield what moves the flanks of a model that takes them as perfect but for the scenario's effects."""
    from gears3d.gears.deviation import Eccentricity, ProfileSlope

    for which in GEARS:
        gear = getattr(scenario.gears, which)
        if any(isinstance(item, Eccentricity) for item in gear.mounting):
            yield f"gears.{which}.eccentricity", ", or give an effect of kind eccentricity"
        for kind in sorted({isinstance(item, ProfileSlope) for item in gear.deviations}):
            yield f"gears.{which}.profile_{'slope' if kind else 'wave'}", " or run --model bullet --twin none"
        if gear.helix_slope != 0.0:
            yield f"gears.{which}.helix_slope", ""
    reliefs = [
        f"gears.{which}.{name}"
        for which in GEARS
        for name in ("tip_relief", "root_relief")
        if getattr(scenario.pair().gear(which), name) is not None
    ]
    if reliefs and not _touching(scenario.pair()):
        yield reliefs[0], ", or shorten it until flanks without relief touch all along"
    yield from _off_axis(scenario)


def _touching(pair: Pair) -> bool:
    """Whether some flanks always touch where no relief takes anything off them."""
    from gears3d.gears.sheet import touching_ratio

    return touching_ratio(pair, 1e-9) + pair.overlap_ratio >= 1.0


# What a model does not see; others take their flanks from the surfaces, the bullet one is made of them
_UNSEEN = {"plastic": _beyond_perfect}
# What a model's own assumptions exclude; bullet and rigid take every effect and every motion
_ASSUMPTIONS = {"plastic": _of_plastic, "lubricated": _of_lubricated}


def _bullet(
    scenario: Scenario, pair: Pair | None, contact: str, progress: Progress | None, error_estimate: bool = False
) -> Recording:
    from gears3d import engine

    return engine.simulate(scenario, pair=pair, contact=contact, progress=progress, error_estimate=error_estimate)


def _rigid(scenario: Scenario, pair: Pair | None, contact: str, progress: Progress | None) -> Recording:
    from gears3d.lumped import rigid

    return rigid.simulate(scenario, progress=progress)


def _plastic(scenario: Scenario, pair: Pair | None, contact: str, progress: Progress | None) -> Recording:
    from gears3d.lumped import plastic

    return plastic.simulate(scenario, progress=progress)


def _lubricated(scenario: Scenario, pair: Pair | None, contact: str, progress: Progress | None) -> Recording:
    from gears3d.lumped import lubricated

    return lubricated.simulate(scenario, progress=progress)


# The models that ``simulate`` and ``gears3d run --model`` know
MODELS: dict[str, Callable[..., Recording]] = {
    "bullet": _bullet,
    "rigid": _rigid,
    "plastic": _plastic,
    "lubricated": _lubricated,
}


def simulate(
    scenario: Scenario | str | Path,
    model: str = "bullet",
    *,
    contact: str | None = None,
    pair: Pair | None = None,
    progress: Progress | None = None,
    error_estimate: bool = False,
) -> Recording:
    """Run a scenario in one model and return what was recorded.

    Args:
        scenario: a scenario, or the path of its file.
        model: ``"bullet"`` (rigid bodies in PyBullet), ``"rigid"`` (the one-degree-of-freedom twin), ``"plastic"`` (its
            closed form for one harmonic, constant drag and no rebounds) or ``"lubricated"`` (oil films and teeth that
            compliant, with an effect ``oil_film``).
        contact: of the bullet model: ``"located"`` (default) or ``"native"``.
        pair: of the bullet model: gears that take the place of the scenario's, e.g. with a fault that nobody told.
        progress: called now and then with the simulated time done [s].
        error_estimate: of the bullet model: run it once more with half the step; ``meta["error_estimate"]`` says how
            far off that finds the recording. Progress then goes to twice the duration.

    Returns:
        The recording, with the scenario's sensor effects applied.

    Raises:
        InputError: the scenario is bad.
        UsageError: the model or the contact is not known, or an option of the bullet model is used with another.
        EngineError: the simulation cannot continue or cannot be trusted; its ``partial`` is the recording until then,
            where there is one.

    >>> simulate("scenarios/rigaud-2020/fig5-20rpm.toml", model="rigyd")
    Traceback (most recent call last):
    gears3d.errors.UsageError: there is no model 'rigyd'; did you mean 'rigid'?
    """
    from gears3d.scenario import Scenario, load

    if model not in MODELS:
        raise UsageError(f"there is no model {model!r}; {did_you_mean(str(model), list(MODELS))}")
    if contact not in (None, *CONTACTS):
        raise UsageError(f"there is no contact {contact!r}; {did_you_mean(str(contact), CONTACTS)}")
    if model != "bullet":
        if contact is not None:
            raise UsageError(
                f"model {model!r} has no choice of contact: contact goes with the bullet model, leave it out"
            )
        if pair is not None:
            raise UsageError(f"model {model!r} knows no solids: pair= goes with model='bullet'")
        if error_estimate:
            raise UsageError(f"model {model!r} has no step to halve: an error estimate goes with the bullet model")
    if not isinstance(scenario, Scenario):
        scenario = load(scenario)
    if pair is None:
        refuse_unseen(scenario, model)
    _refuse_long(scenario, model)
    try:
        more = {"error_estimate": True} if error_estimate else {}
        recording = MODELS[model](scenario, pair, contact or CONTACTS[0], progress, **more)
    except EngineError as stopped:
        if stopped.partial is not None:
            stopped.partial = _seen(stopped.partial, scenario)
        raise
    return _seen(recording, scenario)


def _refuse_long(scenario: Scenario, model: str) -> None:
    """Refuse a run whose recording takes more memory than allowed, before it is simulated."""
    run = scenario.run
    count = run.duration * run.output_rate
    remedy = "give a lower run.output_rate or a shorter run.duration"
    if model == "bullet":
        remedy += ", or write it as it happens: --stream"
    file = "" if scenario.path is None else str(scenario.path)
    what = f"{run.duration:.6g} s at {run.output_rate:.6g} Hz, {count:.3g} samples,"
    refuse_beyond(SAMPLE * count, file, what, remedy, "run.output_rate")


def _seen(recording: Recording, scenario: Scenario) -> Recording:
    """Return a recording as the sensors give it, with what its reader needs to know of the scenario."""
    recording = observe(recording, scenario.effects, scenario.rig())
    return Recording(recording.signals, recording.impacts, {**_about(scenario), **recording.meta})


def _about(scenario: Scenario) -> dict[str, Any]:
    """Return what a reader of the recording needs to know of the scenario."""
    rig = scenario.rig()
    return {
        "title": scenario.title,
        "source": scenario.source,
        "version": __version__,
        "seed": scenario.run.seed,
        "settle_s": scenario.run.settle,
        "period_s": scenario.period,
        "duration_s": scenario.run.duration,
        "base_radius_drive_m": rig.base_radius_drive,
        "base_radius_loose_m": rig.base_radius_loose,
        "backlash_m": rig.backlash,
        "inertia_kg_m2": rig.inertia,
        "drag_torque_N_m": rig.drag_torque,
        "effects": [effect.kind for effect in scenario.effects],
    }


def stream(
    scenario: Scenario | str | Path,
    folder: str | Path,
    *,
    contact: str | None = None,
    pair: Pair | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Run a scenario in the 3D engine and write the recording as it goes, in memory that does not grow.

    Args:
        scenario: a scenario, or the path of its file.
        folder: gets ``signals.parquet``, ``impacts.parquet`` and ``contacts.parquet`` (permanent contacts).
        contact: ``"located"`` (default) or ``"native"``.
        pair: gears that take the place of the scenario's.
        progress: called now and then with the simulated time done [s].

    Returns:
        The recording's metadata, without its contacts.

    Raises:
        InputError: the scenario is bad, has sensor effects, which act on whole recordings, or the disk is full.
        UsageError: the contact is not known.
        EngineError: the simulation cannot continue; the tables are kept up to that instant and report it.
    """
    from gears3d import engine
    from gears3d.effects import SensorEffect
    from gears3d.scenario import Scenario, load

    if not isinstance(scenario, Scenario):
        scenario = load(scenario)
    file = "" if scenario.path is None else str(scenario.path)
    seen = [(k, effect) for k, effect in enumerate(scenario.effects) if isinstance(effect, SensorEffect)]
    if seen:
        text = "acts on a whole recording, not on one that is written as it happens"
        raise InputError([Fault(f"effect[{k}]", f"{effect.kind!r} {text}", "leave it out", file) for k, effect in seen])
    return engine.stream(scenario, Path(folder), pair, contact or CONTACTS[0], progress, _about(scenario))

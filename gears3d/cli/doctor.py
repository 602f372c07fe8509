"""``gears3d doctor``: what is installed here, whether it works, and what to type where something is missing."""

from __future__ import annotations

import os
import platform
import shutil
import time
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any

import typer

from gears3d.extras import EXTRAS, missing, pip_line

# Core packages whose versions a report of a fault needs.
NEEDED = ("numpy", "scipy", "numba", "pyarrow", "matplotlib", "pebble", "pydantic", "typer")
# Packages of extras whose versions it needs where they are installed.
OPTIONAL = ("pybullet", "trimesh", "rerun-sdk")
# What works with no extra.
CORE = "scenarios, recordings, the rigid model, identification, diagnosis and reports"
# Extras for people; the others are parts of ``formats``.
SHOWN = ("engine", "replay", "formats", "sweep", "video", "cad", "tables")
# One second of a small pair that rattles.
CHECK = """
format = 1
title = "self-check"
gears = { module = "3.5 mm", face_width = "7.5 mm", drive = { teeth = 30 }, loose = { teeth = 30 } }
mount = { backlash = "200 um" }
motion = { mean = "60 rpm", harmonics = [ { amplitude = "20 rpm", frequency = "5 Hz" } ] }
drag = { torque = "0.003 N m" }
impact = { restitution = 0.3 }
run = { duration = "1 s", settle = "0.2 s" }
"""
# Largest difference of an impact's speed between engine and twin that the self-check lets pass, relative, 95 %.
WORST = 0.005
# Change of the scenario that gives the rigid model a closed form, the reference where the engine is missing.
CLOSED = {"impact.restitution": 0.0}


def doctor(
    check: Annotated[bool, typer.Option(help="Compare the models with each other over one second.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")] = False,
) -> None:
    """Report versions, what works with the extras that are installed, and how to get the others; compare two models.

    The models are the 3D engine and the rigid one, without the extra engine the rigid one and its closed form; exit
    code 4 if they differ.

    Example: gears3d doctor
    """
    from gears3d.errors import EngineError

    found: dict[str, Any] = {
        "versions": versions(),
        "machine": machine(),
        "core": CORE,
        "extras": {name: extra(name) for name in EXTRAS},
        "viewer": viewer(),
        "self_check": self_check() if check else None,
    }
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found)
    else:
        _show(found)
    if check and not found["self_check"]["passed"]:
        raise typer.Exit(EngineError.exit_code)


def versions() -> dict[str, str | None]:
    """Return versions of gears3d, Python and the packages that results hang on."""
    from gears3d import __version__

    packages = {name: _version(name) for name in (*NEEDED, *OPTIONAL)}
    return {"gears3d": __version__, "python": platform.python_version(), **packages}


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def machine() -> dict[str, Any]:
    """Return processor, cores, memory and system."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {"system": platform.platform(terse=True), "processor": _processor(), "cores": cores, "memory_GiB": _memory()}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _memory() -> float | None:
    try:
        return round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1)
    except (ValueError, OSError, AttributeError):
        return None


def extra(name: str) -> dict[str, Any]:
    """Return whether an optional extra is installed, and what to type where it is not."""
    lacking = missing(name)
    return {
        "packages": [*EXTRAS[name].libraries.values()],
        "missing": lacking,
        "purpose": EXTRAS[name].purpose,
        "remedy": pip_line(name) if lacking else None,
    }


def viewer() -> dict[str, Any]:
    """Return whether the rerun viewer is there, whether it can open a window, and what to type where not."""
    from gears3d.errors import GearsError, MissingExtraError
    from gears3d.views.replay import viewer as room

    path, remedy = None, None
    try:
        path = room.executable()
    except MissingExtraError:
        remedy = pip_line("replay")
    except GearsError as error:
        remedy = str(error)
    window = room.has_display()
    if path is not None and not window:
        remedy = "no display here: gears3d replay RUN --web shows it in a browser, gears3d camera RUN needs no screen"
    browser = next((found for name in _BROWSERS if (found := shutil.which(name))), None)
    return {"path": path, "display": window, "browser": browser, "remedy": remedy}


# The compared models in words.
MODELS = {"bullet": "3D engine", "rigid": "rigid model", "plastic": "closed form"}
_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "firefox")


def self_check() -> dict[str, Any]:
    """Return how the engine compares with the rigid model; without the engine, how that does with its closed form."""
    from gears3d.comparison import compare
    from gears3d.errors import GearsError
    from gears3d.kernels import compiled
    from gears3d.scenario import load
    from gears3d.simulation import simulate

    begin = time.perf_counter()
    try:
        solid = not missing("engine")
        scenario = load(CHECK, {} if solid else CLOSED)
        models = ("bullet", "rigid") if solid else ("rigid", "plastic")
        engine = simulate(scenario, models[0])
        middle = time.perf_counter()
        one = compare(engine, simulate(scenario, models[1])).to_dict()
    except (GearsError, OSError, ImportError) as error:
        return {"passed": False, "why": str(error)}
    error = one["velocity_error_p95"]
    fine = not one["impacts_missed"] and not one["impacts_invented"] and error is not None and error < WORST
    return {
        "passed": bool(fine and one["impacts_matched"]),
        "why": None if fine else f"{models[0]} and {models[1]} differ",
        "models": [*models],
        "impacts": one["impacts_matched"],
        "missed": one["impacts_missed"],
        "invented": one["impacts_invented"],
        "velocity_error_p95": error,
        "engine_s": middle - begin,
        "twin_s": time.perf_counter() - middle,
        "compiled_now": bool(compiled),
    }


def _show(found: dict[str, Any]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    table.add_column(no_wrap=True)
    for name, text in _lines(found):
        table.add_row(name, escape(text))
    Console(highlight=False).print(table)


def _lines(found: dict[str, Any]) -> list[tuple[str, str]]:
    own, seen, shown = found["versions"], found["machine"], found["viewer"]
    packages = ", ".join(f"{name} {own[name]}" for name in (*NEEDED, *OPTIONAL) if own[name])
    memory = f", {seen['memory_GiB']:g} GiB" if seen["memory_GiB"] else ""
    lines = [
        ("gears3d", f"{own['gears3d']} on Python {own['python']}, {seen['system']}"),
        ("packages", packages),
        ("machine", f"{seen['processor']}, {seen['cores']} cores{memory}"),
        ("core", f"works: {found['core']}"),
    ]
    for name in SHOWN:
        one = found["extras"][name]
        lines.append((name, f"{'missing' if one['missing'] else 'works'}: {one['purpose']}"))
        if one["missing"]:
            lines.append(("", f"{', '.join(one['missing'])} not installed: {one['remedy']}"))
    lines.append(("viewer", shown["path"] or "not found"))
    if shown["remedy"] and not found["extras"]["replay"]["missing"]:
        lines.append(("", shown["remedy"]))
    lines.append(("browser", shown["browser"] or "none found on the path"))
    if (check := found["self_check"]) is not None:
        lines.append(("self-check", _told(check)))
    return lines


def _told(check: dict[str, Any]) -> str:
    if "impacts" not in check:
        return f"FAILED: {check['why']}"
    error = check["velocity_error_p95"]
    size = f"{100 * error:.2g} %" if error is not None else "unknown"
    counts = f"{check['impacts']} impacts, {check['missed']} missed, {check['invented']} invented"
    names = " and ".join(MODELS[model] for model in check["models"])
    verdict = f"{names} agree" if check["passed"] else f"FAILED, {names} differ"
    once = ", kernels compiled just now" if check["compiled_now"] else ""
    return f"{verdict}: {counts}, speeds within {size} (95 %); 1 s in {check['engine_s']:.3g} s{once}"

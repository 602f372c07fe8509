"""The scenario of a run in sentences and as a table, in the units of the scenario file."""

from __future__ import annotations

import re
import tomllib
from typing import Any, NamedTuple


class Line(NamedTuple):
    """One line of the table of what was simulated.

    Args:
        group: section of the scenario.
        name: the quantity in words.
        value: its value with unit.
    """

    group: str
    name: str
    value: str


NAMES = {
    "gears": "Gears",
    "gears.module": "module (normal)",
    "gears.pressure_angle": "pressure angle",
    "gears.helix_angle": "helix angle",
    "gears.face_width": "face width",
    "gears.drive": "drive gear",
    "gears.loose": "loose gear",
    "mount": "Mounting",
    "mount.backlash": "backlash along the line of action",
    "mount.centre_distance": "centre distance",
    "motion": "Drive motion",
    "motion.mean": "mean speed",
    "motion.harmonics": "fluctuation",
    "motion.record": "measured motion",
    "motion.bandwidth": "bandwidth of smoothing",
    "drag": "Drag",
    "drag.torque": "Coulomb torque on the loose gear",
    "impact": "Impact",
    "impact.restitution": "coefficient of restitution",
    "impact.stick_velocity": "no rebound below",
    "start": "Start",
    "start.state": "flank touching at the start",
    "run": "Run",
    "run.duration": "duration",
    "run.settle": "excluded as settling",
    "run.output_rate": "output rate",
    "run.seed": "random seed",
    "sensors": "Sensors",
    "effect": "Effects",
    "expect": "Expected",
}
"""Names of the keys of a scenario."""

SIGNS = {r"\bu(?=[ms]\b)": "µ", r"\bdeg\b": "°", r"(?<=\w) (?=\w)": "·", r"\*(?!\*)": "·", r"\^2": "²", r"\^3": "³"}
"""Typography of units."""

PASSED_OVER = ("format", "title", "source", "extends")


def parse(document: str) -> dict[str, Any]:
    """Return a scenario's text as a dictionary; empty where it is not valid TOML."""
    try:
        return tomllib.loads(document)
    except tomllib.TOMLDecodeError:
        return {}


def table(document: str) -> list[Line]:
    r"""Return every value of a scenario as a line of a table.

    >>> table('[mount]\nbacklash = "250 um"')
    [Line(group='Mounting', name='backlash along the line of action', value='250 µm')]
    """
    lines = []
    for section, content in sorted(parse(document).items(), key=_place):
        if section in PASSED_OVER:
            continue
        group = NAMES.get(section, section)
        if section == "effect":
            lines += [Line(group, words(str(one.get("kind", "?"))), inline(one, ("kind",))) for one in content]
        elif isinstance(content, dict):
            lines += [
                Line(group, NAMES.get(f"{section}.{key}", words(key)), inline(value))
                for key, value in sorted(content.items(), key=lambda item: _place((f"{section}.{item[0]}", None)))
                if value not in ({}, [])
            ]
        else:
            lines.append(Line(group, words(section), inline(content)))
    return lines


def _place(item: tuple[str, Any]) -> int:
    order = list(NAMES)
    return order.index(item[0]) if item[0] in order else len(order)


def inline(value: Any, without: tuple[str, ...] = ()) -> str:
    """Return a TOML value as running text.

    >>> inline([{"amplitude": "20 rpm", "frequency": "3 Hz"}])
    'amplitude 20 rpm, frequency 3 Hz'
    >>> inline({"value": "0.22 N m", "uncertainty": "5 %"})
    '0.22 N m ± 5 %'
    """
    if isinstance(value, dict):
        if value.keys() == {"value", "uncertainty"}:
            return f"{value['value']} ± {value['uncertainty']}"
        return ", ".join(_named(key, one) for key, one in value.items() if key not in without)
    if isinstance(value, list):
        return "; ".join(inline(one) for one in value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return pretty(str(value).replace("_sided", "-sided").replace("_", " "))


def _named(key: str, value: Any) -> str:
    return f"{value} teeth" if key == "teeth" else f"{words(key)} {inline(value)}"


def pretty(text: str) -> str:
    """Return a quantity with its unit in the field's signs; other text stays as it is.

    >>> pretty("250 um"), pretty("0.0695 kg m^2"), pretty("a measured file")
    ('250 µm', '0.0695 kg·m²', 'a measured file')
    """
    if not re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)? \S.*", text):
        return text
    number, unit = text.split(" ", 1)
    for plain_sign, sign in SIGNS.items():
        unit = re.sub(plain_sign, sign, unit)
    return f"{number}{'' if unit == '°' else ' '}{unit}"


def words(key: str) -> str:
    """Return a key as words."""
    return key.replace("_", " ")


def sentence(document: str) -> str:
    r"""Return two or three sentences that describe the scenario.

    >>> sentence('[motion]\nmean = "30 rpm"')
    'The drive gear rotates at a mean speed of 30 rpm. The loose gear has no load torque.'
    """
    data = parse(document)
    gears, motion = data.get("gears", {}), data.get("motion", {})
    parts = [_gears(gears, data.get("mount", {})), _motion(motion), _loose(data)]
    return " ".join(part for part in parts if part)


def rig_sentence(document: str) -> str:
    r"""Return the gears, drag and restitution of a rig in one or two sentences, without motion and effects.

    >>> rig_sentence('[drag]\ntorque = "0.2 N m"')
    'The loose gear is unloaded except for a drag torque of 0.2 N·m.'
    """
    data = parse(document)
    parts = [_gears(data.get("gears", {}), data.get("mount", {})), _loose({**data, "effect": []})]
    return " ".join(part for part in parts if part)


def _gears(gears: dict[str, Any], mount: dict[str, Any]) -> str:
    teeth = [gears.get(one, {}).get("teeth") for one in ("drive", "loose")]
    if None in teeth:
        return ""
    kind = "helical" if re.search(r"[1-9]", str(gears.get("helix_angle", 0)).split(" ")[0]) else "spur"
    module = f" of module {inline(gears['module'])}" if "module" in gears else ""
    gap = (
        f"a backlash of {inline(mount['backlash'])}"
        if "backlash" in mount
        else f"a centre distance of {inline(mount['centre_distance'])}"
        if "centre_distance" in mount
        else "backlash"
    )
    return f"Two {kind} gears{module} with {teeth[0]} and {teeth[1]} teeth mesh with {gap}."


def _motion(motion: dict[str, Any]) -> str:
    if "record" in motion:
        return f"The drive gear follows a measured motion ({inline(motion['record'])})."
    if "mean" not in motion:
        return ""
    text = f"The drive gear rotates at a mean speed of {inline(motion['mean'])}"
    waves = [_harmonic(one) for one in motion.get("harmonics", [])]
    if waves:
        text += " with a fluctuation of " + " and ".join(waves)
    return text + "."


def _harmonic(one: dict[str, Any]) -> str:
    how = f"at {inline(one['frequency'])}" if "frequency" in one else f"at order {inline(one.get('order', '?'))}"
    return f"{inline(one.get('amplitude', '?'))} {how}"


def _loose(data: dict[str, Any]) -> str:
    drag, impact = data.get("drag", {}), data.get("impact", {})
    if "torque" in drag:
        text = f"The loose gear is unloaded except for a drag torque of {inline(drag['torque'])}"
    else:
        text = "The loose gear has no load torque"
    if "restitution" in impact:
        text += f"; the coefficient of restitution is {inline(impact['restitution'])}"
    extra = [words(str(one.get("kind", "?"))) for one in data.get("effect", [])]
    if extra:
        text += "; additional effects: " + ", ".join(extra)
    return text + "."

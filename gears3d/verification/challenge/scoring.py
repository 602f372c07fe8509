"""The sealed answer, and a diagnosis compared with it.

It is unreadable at a glance, and its hash shows any later change.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import zlib
from collections.abc import Sequence
from math import erf, pi, sqrt
from pathlib import Path
from typing import Any

from gears3d.errors import Fault, InputError

# Kinds that some data cannot distinguish: no error when the true one is among the alternatives
ALIKE = {
    "drag_differential": ("drag_viscous", "drag_coulomb"),
    "oil_film": ("restitution_speed", "restitution_offset"),
    "restitution_speed": ("oil_film", "restitution_offset"),
}
# Names of causes that were outside the catalogue once, and the kinds that they are now
SINCE = {"a body behind a coupling with play": "carried_inertia", "stick-slip": "drag_stick_slip"}
MEMBERS = 4  # Members of a set of causes, up to which it is right where the true one is in it
# An order of one gear is one of the other, too, times the ratio of teeth: of a foreign order nothing tells whose
OTHER_GEAR = {
    "flight.angle_drive": "flight.angle_loose",
    "flight.angle_loose": "flight.angle_drive",
    "contact.order_drive": "contact.order_loose",
    "contact.order_loose": "contact.order_drive",
}
CHALLENGE = "name the folder that `gears3d challenge --out` wrote"
# By whose angle effects go that do not name their gear
GEARS = {"drag_position": "loose", "drag_stick_slip": "loose", "backlash_variation": "drive", "drive_motion": None}
VERDICTS = ("nothing_to_add", "explained", "partly_explained", "unexplained", "not_decidable")


def reveal(folder: str | Path, diagnosis: str | Path) -> dict[str, Any]:
    """Open the answer of a challenge and score a diagnosis.

    Args:
        folder: of the challenge.
        diagnosis: ``diagnosis.json``, or the folder that holds it.

    Returns:
        ``changed``, ``answer``, ``verdict``, ``verdict_right``, ``hedged``, ``kinds_first``, ``kinds_named``,
        ``kinds_right``, ``set_right``, ``wrong_names``, ``coordinate_right``, ``parameters``.

    Raises:
        InputError: a file is missing or of another sort, or the answer was changed.
    """
    folder = Path(folder)
    about = _json(folder / "challenge.json", "answer_sha256")
    sealed = _bytes(folder / "answer.sealed")
    if hashlib.sha256(sealed).hexdigest() != about["answer_sha256"]:
        text = "has not the hash that challenge.json tells: it was changed after the challenge was made"
        raise InputError(Fault("", text, "make the challenge again", str(folder / "answer.sealed")))
    changed = [name for name, digest in about.get("files", {}).items() if _digest(folder / name) != digest]
    found = Path(diagnosis)
    found = found / "diagnosis.json" if found.is_dir() else found
    told = _json(found, "verdict", "name the diagnosis.json of `gears3d diagnose RECORD... --out DIR`, or its folder")
    return {"changed": changed, **score(open_(sealed.decode()), told, about.get("records", ()))}


def score(answer: dict[str, Any], diagnosis: dict[str, Any], records: Sequence[str] = ()) -> dict[str, Any]:
    """Hold a diagnosis against an answer.

    Args:
        answer: ``effects`` and ``unknown`` as ``Plan.told`` has them.
        diagnosis: ``verdict``, ``causes`` in order, ``remaining``.
        records: names of the files in the order of the answer's zeros; phases count from the first without.

    Returns:
        As :func:`reveal`, without ``changed``.

    Raises:
        InputError: the verdict is unknown.

    >>> found = {"verdict": "explained", "causes": [{"kind": "drag_viscous", "parameters": {}}]}
    >>> score({"effects": [{"kind": "drag_viscous"}], "unknown": [], "visible": True}, found)["kinds_first"]
    True
    """
    verdict = diagnosis["verdict"]
    if verdict not in VERDICTS:
        raise InputError(Fault("verdict", f"is {verdict!r}", "one of " + ", ".join(VERDICTS)))
    causes = diagnosis.get("causes", [])
    names = [cause["kind"] for cause in causes]
    sets = [{cause["kind"], *(other["kind"] for other in cause.get("alternatives", []))} for cause in causes]
    seen = answer["effects"] if answer["visible"] else []
    kinds = [effect["kind"] for effect in seen]
    since = [SINCE[one["name"]] for one in answer["unknown"] if one.get("name") in SINCE]
    named = set().union(*sets) if sets else set()
    apart = [name for name in names if name not in (*kinds, *since)]
    excused = [name for name, among in zip(names, sets, strict=True) if any(_alike(k, name, among) for k in kinds)]
    right = [k for k in kinds if any(k == n or _alike(k, n, s) for n, s in _pairs(names, sets))]
    structure = diagnosis.get("remaining", {}).get("structure", "none")
    where = {place for cause in answer["unknown"] for place in cause["coordinates"]}
    where |= {OTHER_GEAR[place] for place in where if place in OTHER_GEAR}
    teeth = answer.get("ratio", [1, 2])
    return {
        "answer": answer,
        "verdict": verdict,
        "verdict_right": verdict in _right([*kinds, *(one for one in since if one in names)], answer["unknown"]),
        "hedged": verdict == "not_decidable",
        "kinds_first": bool(kinds) and sorted(names[: len(kinds)]) == sorted(kinds),
        "kinds_named": bool(kinds) and set(kinds) <= named,
        "kinds_right": right,
        "set_right": bool(kinds) and len(right) == len(kinds),
        "wrong_names": [name for name in apart if name not in excused],
        "coordinate_right": structure in where if where else None,
        "parameters": _parameters(
            [_from_zeros(effect, _zeros(effect, answer, causes, records), teeth) for effect in seen], causes, teeth
        ),
    }


def _pairs(names: list[str], sets: list[set[str]]) -> list[tuple[str, set[str]]]:
    return list(zip(names, sets, strict=True))


def _right(kinds: list[str], unknown: list[Any]) -> tuple[str, ...]:
    if unknown:
        named = ("explained", "partly_explained") if {*kinds} & {*SINCE.values()} else ("partly_explained",)
        return named if kinds else ("unexplained", "partly_explained")
    return ("explained", "partly_explained") if kinds else ("nothing_to_add",)


def _alike(kind: str, name: str, among: set[str]) -> bool:
    return kind in among and (len(among) <= MEMBERS or name in ALIKE.get(kind, ()))


def _zeros(
    effect: dict[str, Any], answer: dict[str, Any], causes: list[dict[str, Any]], records: Sequence[str]
) -> list[float] | None:
    """Return the zeros of the record from which the cause of an effect's kind counts its phase; ``None`` if 0."""
    if not answer.get("zeros"):
        return None
    named = (Path(cause.get("phase_from", "")).name for cause in causes if cause["kind"] == effect["kind"])
    name = next(named, "")
    return answer["zeros"][list(records).index(name) if name in records else 0]


def _from_zeros(effect: dict[str, Any], zeros: list[float] | None, teeth: list[int]) -> dict[str, Any]:
    """Return an effect whose phase, or tooth, counts from the zeros of a record."""
    gear = GEARS.get(effect["kind"], effect.get("gear"))
    if not zeros or gear not in ("drive", "loose"):
        return effect
    turned, count = zeros[gear == "loose"], teeth[gear == "loose"]
    moved = dict(effect)
    if "phase" in effect:
        moved["phase"] = (effect["phase"] - effect.get("order", 1) * turned + pi) % (2.0 * pi) - pi
    if "tooth" in effect:
        moved["tooth"] = int(effect["tooth"] - 1 + round(turned * count / (2.0 * pi))) % count + 1
    return moved


def _parameters(effects: list[dict[str, Any]], causes: list[dict[str, Any]], ratio: list[int]) -> list[dict[str, Any]]:
    """Compare the parameters of every effect that was named."""
    rows = []
    for effect in effects:
        cause = next((cause for cause in causes if cause["kind"] == effect["kind"]), None)
        if cause is None:
            continue
        found = cause.get("parameters", {})
        for name, true in effect.items():
            if name == "kind" or name.endswith("_family") or name not in found:
                continue
            if name == "gear" and ratio[0] == ratio[1]:
                continue  # at 1:1 both gears' orders are the same
            rows.append({"kind": effect["kind"], "name": name, **_compared(name, true, found[name])})
    return rows


def _compared(name: str, true: Any, told: Any) -> dict[str, Any]:
    """Return true and found value, error (relative; of angles in rad), whether the interval holds the true one."""
    value = told.get("value") if isinstance(told, dict) else told
    if isinstance(true, str) or isinstance(value, str) or name in ("order", "tooth"):
        return {"true": true, "found": value, "error": None, "right": value == true, "covered": None}
    if value is None and isinstance(told, dict):
        return {"true": true, "found": None, "error": None, "right": None, "covered": None}
    if not isinstance(value, int | float):
        return {"true": true, "found": value, "error": None, "right": False, "covered": None}
    if isinstance(told, dict) and told.get("at_least"):
        return {"true": true, "found": value, "error": None, "right": None, "covered": abs(true) >= abs(value)}
    angle = name == "phase"
    error = (value - true + pi) % (2.0 * pi) - pi if angle else value - true
    interval = told.get("ci95") if isinstance(told, dict) else None
    covered, rank = None, None
    if isinstance(interval, list) and len(interval) == 2:
        covered = bool(interval[0] - value <= -error <= interval[1] - value)
        rank = _rank(-error, interval[0] - value, interval[1] - value)
    share = error if angle or true == 0.0 else error / abs(true)
    return {"true": true, "found": value, "error": share, "right": None, "covered": covered, "rank": rank}


def _rank(off: float, low: float, high: float) -> float | None:
    """Return the share of a normal posterior below the true value, whose 95 % interval goes from ``low`` to ``high``.

    Over many challenges the shares of calibrated intervals are uniform between 0 and 1. Source: Talts et al. 2018,
    arXiv:1804.06788.
    """
    side = low if off < 0.0 else high
    return 0.5 * (1.0 + erf(1.959964 * off / abs(side) / sqrt(2.0))) if side else None


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""


def _bytes(path: Path, remedy: str = CHALLENGE) -> bytes:
    if not path.is_file():
        raise InputError(Fault("", "is not there", remedy, str(path)))
    return path.read_bytes()


def _json(path: Path, needed: str, remedy: str = CHALLENGE) -> dict[str, Any]:
    try:
        data = json.loads(_bytes(path, remedy))
    except (ValueError, RecursionError) as error:
        raise InputError(Fault("", f"is no JSON: {error}", remedy, str(path))) from error
    if not isinstance(data, dict) or needed not in data:
        raise InputError(Fault(needed, "is missing", remedy, str(path)))
    return data


LONGEST = 1 << 24  # Bytes of an answer


def _stream(key: bytes, length: int) -> bytes:
    blocks = (hashlib.sha256(key + count.to_bytes(8, "big")).digest() for count in range(length // 32 + 1))
    return b"".join(blocks)[:length]


def close(answer: dict[str, Any]) -> str:
    """Return an answer as a line nobody reads by accident; whoever wants to can open it.

    >>> open_(close({"seed": 3}))
    {'seed': 3}
    """
    key = os.urandom(32)
    plain = zlib.compress(json.dumps(answer).encode())
    mixed = bytes(a ^ b for a, b in zip(plain, _stream(key, len(plain)), strict=True))
    return base64.b64encode(key + mixed).decode() + "\n"


def open_(sealed: str) -> dict[str, Any]:
    """Return the answer in a sealed line."""
    try:
        raw = base64.b64decode(sealed.strip(), validate=True)
        key, mixed = raw[:32], raw[32:]
        packed = bytes(a ^ b for a, b in zip(mixed, _stream(key, len(mixed)), strict=True))
        return json.loads(zlib.decompressobj().decompress(packed, LONGEST))
    except (ValueError, RecursionError, zlib.error) as error:
        raise InputError("answer.sealed: is no sealed answer (make the challenge again)") from error

"""A gear as files for other programs: STL, OBJ and STEP in millimetres, GLB in metres, with a metadata sidecar."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import UsageError, did_you_mean
from gears3d.files import write_bytes
from gears3d.gears.deviation import GEARS, Deviation, Mounting
from gears3d.gears.outline import MOST_TRIANGLES, triangles_at
from gears3d.gears.pair import Pair
from gears3d.gears.solids import mass_properties, solid, solid_arrays
from gears3d.gears.step import require_kernel, step_file
from gears3d.version import __version__

if TYPE_CHECKING:
    from trimesh import Trimesh

FORMATS = ("stl", "obj", "glb", "step")
UNITS = {"stl": "mm", "obj": "mm", "glb": "m", "step": "mm"}
# Base colours of the GLB materials, red green blue alpha
COLOURS = {"drive": (0.62, 0.70, 0.79, 1.0), "loose": (0.80, 0.75, 0.66, 1.0)}
_QUICK = 5e5  # Triangles that are written within a second or two
_GRID = 1e-9  # Vertices are rounded to this before they are hashed, m: the last bits differ between machines


def write_meshes(
    pair: Pair,
    folder: Path,
    formats: Sequence[str] = FORMATS,
    chord: float = 0.5e-6,
    *,
    which: Sequence[str] = GEARS,
    densities: tuple[float, float] = (7850.0, 7850.0),
    command: str = "",
    progress: Callable[[str], None] | None = None,
) -> dict[str, dict[str, Any]]:
    """Write gears of a pair as files, each under a temporary name that is renamed, with a metadata sidecar in JSON.

    Args:
        pair: the pair, deviations included.
        folder: made if it is not there; files of the same names are replaced.
        formats: of ``"stl"`` (binary, mm), ``"obj"`` (mm, 9 decimals), ``"glb"`` (m, with normals), ``"step"`` (mm,
            B-spline surfaces, independent of the chord).
        chord: largest distance of the facets from the surface [m].
        which: the gears.
        densities: of drive and loose gear [kg/m³].
        command: that made them, for the card.
        progress: called with a line of text before each part of a gear that takes a while.

    Returns:
        The cards by gear, as they stand in ``drive.json`` and ``loose.json``.

    Raises:
        UsageError: an unknown format or gear.
        InputError: a chord that is not positive, or a folder that cannot be written.
        MissingExtraError: a library of the extra ``engine``, or of ``cad`` for STEP, is not installed.
    """
    for words, known, name in ((formats, FORMATS, "format"), (which, GEARS, "gear")):
        for word in words:
            if word not in known:
                raise UsageError(f"there is no {name} {word!r}; {did_you_mean(word, known)}")
    if "step" in formats:
        require_kernel()
    cards = {}
    for gear in which:
        count = triangles_at(pair, gear, chord)
        tell = progress if progress is not None and _QUICK < count <= MOST_TRIANGLES else lambda _: None
        tell(f"{gear}: solid of about {count / 1e6:.1f} million triangles")
        body = solid(pair, gear, chord)
        files = {}
        for kind in dict.fromkeys(formats):
            tell(f"{gear}: {kind}")
            data, more = _encoded(pair, gear, body, kind, chord)
            write_bytes(folder / f"{gear}.{kind}", data)
            digest = hashlib.sha256(data).hexdigest()
            files[kind] = {"name": f"{gear}.{kind}", "unit": UNITS[kind], "bytes": len(data), "sha256": digest} | more
        cards[gear] = card(pair, gear, body, chord, densities[GEARS.index(gear)]) | {"files": files, "command": command}
        text = json.dumps(cards[gear], indent=2, ensure_ascii=False, allow_nan=False) + "\n"
        write_bytes(folder / f"{gear}.json", text.encode())
    return cards


def card(pair: Pair, which: str, body: Trimesh, chord: float, density: float) -> dict[str, Any]:
    """Return what there is to say about a solid."""
    found = mass_properties(body, density)
    x, y, _ = pair.centre(which)
    return {
        "gear": which,
        "gears3d": __version__,
        "data": asdict(pair.gear(which)),
        "pair": {
            "mate": asdict(pair.gear("loose" if which == "drive" else "drive")),
            "centre_distance_m": pair.centre_distance,
            "backlash_m": pair.backlash,
            "thinning_m": pair.thinning,
            "deviations": [_named(item) for item in pair.deviations if item.gear == which],
            "mounting": [_named(item) for item in pair.mounting if getattr(item, "gear", which) == which],
        },
        "pose": {"axis_m": [x, y], "rotation_about_z_rad": pair.rotation(which, 0.0)},
        "chord_m": chord,
        "solid": {"vertices": len(body.vertices), "triangles": len(body.faces), "watertight": body.is_watertight},
        "mass_properties": {
            "density_kg_m3": density,
            "mass_kg": found.mass,
            "volume_m3": found.volume,
            "centre_m": found.centre.tolist(),
            "inertia_kg_m2": found.inertia.tolist(),
        },
        "hash": content_hash(body),
    }


def _named(item: Deviation | Mounting) -> dict[str, Any]:
    return {"kind": type(item).__name__, **asdict(item)}


def content_hash(body: Trimesh) -> str:
    """Return the SHA-256 of a solid's vertices, rounded to a nanometre, and triangles, in their order.

    Args:
        body: the solid [m].
    """
    grid = np.round(np.asarray(body.vertices) / _GRID).astype("<i8")
    digest = hashlib.sha256(grid.tobytes())
    digest.update(np.asarray(body.faces).astype("<i8").tobytes())
    return f"sha256:{digest.hexdigest()}"


def _encoded(pair: Pair, which: str, body: Trimesh, kind: str, chord: float) -> tuple[bytes, dict[str, Any]]:
    """Return a file, and what its entry in the sidecar has beyond those of other formats."""
    from trimesh import Trimesh
    from trimesh.exchange.obj import export_obj
    from trimesh.exchange.stl import export_stl

    if kind == "step":
        made = step_file(pair, which)
        more = {"faces": made.faces, "volume_m3": made.volume, "flank_deviation_m": made.flank_deviation}
        return made.data, more
    if kind == "glb":
        return _glb(pair, which, chord), {}
    scaled = Trimesh(np.asarray(body.vertices) * 1e3, body.faces, process=False)
    if kind == "stl":
        return bytes(export_stl(scaled)), {}
    header = f"gears3d {__version__}, {which} gear, mm, axis z"
    text = export_obj(scaled, include_normals=False, digits=9, header=header)
    return str(text).encode() + b"\n", {}


def _glb(pair: Pair, which: str, chord: float) -> bytes:
    import trimesh
    from trimesh.exchange.gltf import export_glb
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    vertices, faces, normals = solid_arrays(pair, which, chord)
    body = trimesh.Trimesh(vertices, faces, vertex_normals=normals, process=False)
    material = PBRMaterial(name=which, baseColorFactor=COLOURS[which], metallicFactor=0.35, roughnessFactor=0.5)
    body.visual = TextureVisuals(material=material)
    scene = trimesh.Scene()
    scene.add_geometry(body, node_name=which, geom_name=which)
    return bytes(export_glb(scene, include_normals=True))

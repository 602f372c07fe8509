"""Draws the layers of packages from the import contract of pyproject.toml and the first line of every package.

`python tools/docs_layers.py` writes docs/pictures/layers.svg, which docs/architecture.md shows.
"""

from __future__ import annotations

import ast
import re
import textwrap
import tomllib
from pathlib import Path

import matplotlib as mpl
from docs_drawing import canvas
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "pictures" / "layers.svg"
# of the picture, of a layer and between packages; a line of small print is one high
WIDTH, HEIGHT, GAP = 100.0, 4.0, 0.6
LETTER = 0.6  # width of a letter of the small print
FILL = {"top": "#dbe9f4", "source": "#fbe3d2", "ground": "#eeeeee", "": "#ffffff"}
KINDS = {"top": ("cli", "views", "verification"), "source": ("engine", "lumped", "measured")}
GROUND = ("units", "files", "errors", "kernels", "notebook", "records", "version", "renamed")


def layers() -> list[list[str]]:
    """Return the packages of every layer from the top down, as the contract of import-linter has them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(one["layers"] for one in contracts if one["type"] == "layers")
    stack = [re.split(r"\s*[|:]\s*", layer) for layer in layers]
    return [layer for layer in stack if not purpose(layer[0]).startswith("Old name")]


def purpose(package: str) -> str:
    """Return the purpose of a package: the first line of its docstring."""
    inner = ROOT / "gears3d" / package
    file = inner / "__init__.py" if inner.is_dir() else inner.with_suffix(".py")
    first = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").splitlines()[0]
    return first.replace("``", "").split("; see ")[0].rstrip(".")


def picture() -> None:
    """Write the picture."""
    mpl.rcParams["svg.fonttype"] = "none"
    mpl.rcParams["svg.hashsalt"] = "layers"
    stack = layers()
    heights = [max(_height(package, WIDTH / len(layer)) for package in layer) for layer in stack]
    total = sum(heights) + GAP * len(stack)
    figure = canvas(11.0, 11.0 * total / WIDTH * 0.95)
    axes = figure.subplots()
    axes.set(xlim=(-4.0, WIDTH), ylim=(0.0, total))
    axes.axis("off")
    top = total
    for layer, high in zip(stack, heights, strict=True):
        wide = WIDTH / len(layer)
        for k, package in enumerate(layer):
            _package(axes, package, (k * wide, top - high), (wide - GAP, high))
        top -= high + GAP
    arrow = {"arrowstyle": "-|>", "color": "0.4", "linewidth": 1.5}
    axes.annotate("", (-2.0, 0.5), (-2.0, total - 0.5), arrowprops=arrow)
    axes.text(-3.4, total / 2, "imports go down only", rotation=90, va="center", ha="center", fontsize=8, color="0.4")
    figure.savefig(PICTURE, metadata={"Date": None}, facecolor="white")


def _lines(package: str, wide: float) -> list[str]:
    return textwrap.wrap(purpose(package), int((wide - 2.0) / LETTER))


def _height(package: str, wide: float) -> float:
    return 2.4 + 1.25 * len(_lines(package, wide))


def _package(axes: Axes, package: str, corner: tuple[float, float], size: tuple[float, float]) -> None:
    (left, low), (wide, high) = corner, size
    kind = "ground" if package in GROUND else next((name for name, names in KINDS.items() if package in names), "")
    box = FancyBboxPatch(corner, wide, high, boxstyle="round,pad=0,rounding_size=0.4", fc=FILL[kind], ec="0.5", lw=0.8)
    axes.add_patch(box)
    axes.text(left + 0.8, low + high - 0.5, package, va="top", fontsize=9, weight="bold")
    for k, line in enumerate(_lines(package, wide + GAP)):
        axes.text(left + 0.8, low + high - 2.1 - 1.25 * k, line, va="top", fontsize=6.5, color="0.25")


if __name__ == "__main__":
    picture()

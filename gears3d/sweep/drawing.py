"""Pictures of a sweep: threshold master curve, bifurcations, maps, impulses over Λ, rattle index, level."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import palette
from gears3d.files import write_picture
from gears3d.signals.impacts import REGIMES
from gears3d.sweep.dataset import open_dataset, thresholds

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

COLOURS: dict[str, str] = dict(zip(("active", "reverse", "up", "down"), 2 * palette.FLANKS, strict=True))
MARKS = {"up": 4.0, "down": 1.5}  # Sizes [pt]: rising values stay visible below falling ones
MOST_LINES = 8  # Lines of a picture at most


def draw(place: str | Path) -> list[Path]:
    """Draw every picture that the dataset of a folder has the variables for.

    Args:
        place: folder of a sweep.

    Returns:
        The files, next to the dataset.
    """
    folder, made = Path(place), []
    with open_dataset(folder) as data:
        for name, (fits, picture) in PICTURES.items():
            if fits(data):
                made.append(write_picture(folder / f"{name}.png", lambda picture=picture: picture(data)))
    return made


def all_pictures(place: str | Path) -> dict[str, Callable[[], Figure]]:
    """Return what draws the pictures that the dataset of a folder has the variables for, by name."""

    def drawn(picture: Callable[[Any], Figure]) -> Figure:
        with open_dataset(Path(place)) as data:
            return picture(data)

    with open_dataset(Path(place)) as data:
        names = [name for name, (fits, _) in PICTURES.items() if fits(data)]
    return {name: partial(drawn, PICTURES[name][1]) for name in names}


def axes_of(data: xarray.Dataset) -> list[str]:
    """Return the names of the varied dimensions that are numbers."""
    return [str(name) for name in data["status"].dims if name != "direction" and data[name].dtype.kind in "fiu"]


def label(data: xarray.Dataset, name: str) -> str:
    """Return what an axis of a picture is called."""
    attrs = data[name].attrs
    unit = attrs.get("units", "1")
    return f"{attrs.get('long_name', name)}" + (f" [{unit}]" if unit != "1" else "")


def _figure(width: float = 8.0, height: float = 5.0) -> Figure:
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def _ways(data: xarray.Dataset) -> list[tuple[str, Any]]:
    if "direction" not in data.dims:
        return [("up", data)]
    return [(way, data.sel(direction=way)) for way in ("up", "down")]


def _is_log(data: xarray.Dataset, name: str) -> bool:
    return " log " in f" {data[name].attrs.get('written', '')} "


def bifurcation_picture(data: xarray.Dataset) -> Figure:
    """Draw speeds of impacts, and the displacement once a period, over the only numerical axis, up and down."""
    figure = _figure(8.5, 8.0)
    (name,) = axes_of(data)
    parts = figure.subplots(3, 1, sharex=True)
    shown = (("active_section_impact_m_s", 1e3, "active impact [mm/s]"),
             ("reverse_section_impact_m_s", 1e3, "reverse impact [mm/s]"),
             ("section_displacement_m", 1e6, "displacement [µm]"))  # fmt: skip
    for way, part in _ways(data):
        across = np.repeat(part[name].values[:, None], part.sizes["period"], axis=1)
        for place, (variable, factor, _) in zip(parts, shown, strict=True):
            values = factor * part[variable].transpose(name, "period").values
            place.plot(across.ravel(), values.ravel(), ".", color=COLOURS[way], markersize=MARKS[way],
                       label=way if "direction" in data.dims else None)  # fmt: skip
    for place, (_, _, words) in zip(parts, shown, strict=True):
        place.set(ylabel=words, xscale="log" if _is_log(data, name) else "linear")
    parts[0].set_title("once per period", fontsize=10)
    if "direction" in data.dims:
        parts[0].legend(frameon=False, fontsize=8)
    parts[2].set(xlabel=label(data, name))
    return figure


def map_picture(data: xarray.Dataset) -> Figure:
    """Draw regime and mean speed of the active impacts over the two numerical axes."""
    from matplotlib.colors import BoundaryNorm, ListedColormap

    figure = _figure(11.0, 4.6)
    y, x = axes_of(data)
    left, right = figure.subplots(1, 2, sharey=True)
    part = _ways(data)[0][1]
    norm = BoundaryNorm([-0.5, 0.5, 1.5, 2.5], 3)
    regime = part["regime"].transpose(y, x).values
    shown = left.pcolormesh(
        data[x], data[y], regime, cmap=ListedColormap(palette.REGIMES[:3]), norm=norm, shading="nearest"
    )
    bar = figure.colorbar(shown, ax=left, ticks=[0, 1, 2])
    bar.ax.set_yticklabels([word.replace("_", " ") for word in REGIMES])
    if "active_velocity_mean_m_s" in data:
        speed = -1e3 * part["active_velocity_mean_m_s"].transpose(y, x).values
        drawn = right.pcolormesh(data[x], data[y], speed, cmap="viridis", shading="nearest")
        figure.colorbar(drawn, ax=right, label="mean speed of active impacts [mm/s]")
    elif "opening_m" in data:
        drawn = right.pcolormesh(data[x], data[y], 1e6 * part["opening_m"].transpose(y, x).values, shading="nearest")
        figure.colorbar(drawn, ax=right, label="highest flight [µm]")
    for place in (left, right):
        place.set(xlabel=label(data, x), xscale="log" if _is_log(data, x) else "linear")
        if "excitation" in data and np.isfinite(part["excitation"].values).all():
            levels = part["excitation"].transpose(y, x).values
            if levels.min() < 1.0 < levels.max():
                place.contour(data[x], data[y], levels, levels=[1.0], colors="black", linewidths=0.8)
    left.set(ylabel=label(data, y), yscale="log" if _is_log(data, y) else "linear")
    return figure


def impulse_picture(data: xarray.Dataset) -> Figure:
    """Draw mean impulses of both flanks over Λ; Kadmiri et al. 2012, fig. 12."""
    figure = _figure()
    axis = figure.subplots()
    for flank in ("active", "reverse"):
        impulse = np.abs(data[f"{flank}_impulse_dimensionless"].values.ravel())
        axis.plot(data["excitation"].values.ravel(), impulse, ".", color=COLOURS[flank], markersize=3, label=flank)
    axis.set(xlabel="excitation Λ = m·H·ω²/F", ylabel="mean |I|/(m·H·ω)", xscale="log")
    axis.legend(frameon=False)
    return figure


def level_picture(data: xarray.Dataset) -> Figure:
    """Draw the energy level of the impacts over ω²·ΔΩ; Rigaud & Perret-Liaudet 2020, eq. (25) and fig. 13."""
    figure = _figure()
    axis = figure.subplots()
    drive, level = (data[name].values.ravel() for name in ("rattle_drive_level_dB", "energy_level_dB"))
    some = np.isfinite(drive) & np.isfinite(level)
    axis.plot(drive[some], level[some], ".", color=COLOURS["active"], markersize=3, label="points")
    if some.any():
        shift = float(np.median(level[some] - drive[some]))
        ends = np.array([drive[some].min(), drive[some].max()])
        axis.plot(ends, ends + shift, "--", color="black", linewidth=1, label="10 dB a decade of ω²·ΔΩ")
    axis.set(xlabel="10·log10(ω²·ΔΩ) [dB re 1 rad³/s³]", ylabel="energy level [dB re 1 pW]")
    axis.legend(frameon=False)
    return figure


def index_picture(data: xarray.Dataset) -> Figure:
    """Draw the rattle index and its sensitivity over the only numerical axis."""
    figure = _figure(8.0, 6.0)
    (name,) = axes_of(data)
    top, low = figure.subplots(2, 1, sharex=True)
    for way, part in _ways(data):
        values, index = part[name].values, part["rattle_index"].values
        top.plot(values, index, ".-", color=COLOURS[way], markersize=3, linewidth=0.8, label=way)
        if len(values) > 1:
            low.plot(
                values[:-1], np.diff(index) / np.diff(values), ".-", color=COLOURS[way], markersize=3, linewidth=0.8
            )
    top.set(ylabel="RI [N/(s·kg·m²)]")
    low.set(xlabel=label(data, name), ylabel="change of RI with it")
    if "direction" in data.dims:
        top.legend(frameon=False)
    return figure


def threshold_picture(data: xarray.Dataset) -> Figure:
    """Draw Λ of contact loss on the way up and of regained contact on the way down; Rigaud 2020, figs 3, 4."""
    figure = _figure()
    axis = figure.subplots()
    found = thresholds(data)
    others = [name for name in axes_of(data) if name != found.attrs["along"]]
    x = max(others, key=lambda name: data.sizes[name]) if others else None
    for way in ("up", "down"):
        values = found[f"excitation_{way}"]
        if x is None:
            axis.plot([0.0], [float(values)], "o", color=COLOURS[way], label=way)
            continue
        lines = values.transpose(x, ...).values.reshape(data.sizes[x], -1)[:, :MOST_LINES]
        for column, line in enumerate(lines.T):
            mark = "^" if way == "up" else "v"
            axis.plot(data[x].values, line, mark, color=COLOURS[way], markersize=4, label=way if column == 0 else None)
    axis.axhline(1.0, color="black", linewidth=0.8)
    axis.set(xlabel=label(data, x) if x else f"along {label(data, found.attrs['along'])}", ylabel="Λ at the threshold")
    if x is None:
        axis.set_xticks([])
    axis.legend(frameon=False)
    return figure


def _has_threshold(data: xarray.Dataset) -> bool:
    found = thresholds(data)
    return any(np.isfinite(found[name].values).any() for name in ("excitation_up", "excitation_down"))


def _flat(data: xarray.Dataset, variable: str, count: int) -> bool:
    more = set(data["status"].dims) - set(axes_of(data)) - {"direction"}
    return variable in data and len(axes_of(data)) == count and not more


# Pictures by name: whether a dataset has what one takes, and what draws it
PICTURES: dict[str, tuple[Callable[[Any], bool], Callable[[Any], Figure]]] = {
    "bifurcation": (lambda data: _flat(data, "section_displacement_m", 1), bifurcation_picture),
    "threshold": (
        lambda data: "direction" in data.dims and "regime" in data and "excitation" in data and _has_threshold(data),
        threshold_picture,
    ),
    "map": (lambda data: _flat(data, "regime", 2), map_picture),
    "impulses": (lambda data: "active_impulse_dimensionless" in data and "excitation" in data, impulse_picture),
    "level": (lambda data: "energy_level_dB" in data, level_picture),
    "rattle_index": (lambda data: _flat(data, "rattle_index", 1), index_picture),
}

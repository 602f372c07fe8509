"""Recordings as tables of pandas and xarray; neither is needed otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gears3d.extras import require
from gears3d.recording.columns import FLANKS, unit_of

if TYPE_CHECKING:
    import numpy as np
    import pandas
    import xarray

    from gears3d.recording.record import Recording


def to_pandas(recording: Recording) -> tuple[pandas.DataFrame, pandas.DataFrame]:
    """Return signals and impacts as pandas tables.

    Args:
        recording: any.

    Returns:
        Two tables; ``attrs`` holds ``units`` by column and ``meta``.
    """
    pandas = require("pandas", "a recording as tables", "tables")

    def frame(table: Mapping[str, np.ndarray]) -> Any:
        columns: dict[str, Any] = dict(table)
        if "flank" in columns:
            columns["flank"] = pandas.Categorical.from_codes(columns["flank"], categories=list(FLANKS))
        made = pandas.DataFrame(columns)
        made.attrs = {"units": {name: unit_of(name) for name in table}, "meta": recording.meta}
        return made

    return frame(recording.signals), frame(recording.impacts)


def to_xarray(recording: Recording) -> xarray.Dataset:
    """Return one dataset of signals over ``time_s`` and impacts over ``impact``.

    Args:
        recording: any.

    Returns:
        A dataset with units in the variables' attributes and ``meta`` in its own.
    """
    import numpy as np

    xarray = require("xarray", "a recording as a dataset", "tables")
    variables: dict[str, Any] = {
        name: ("time_s", values, {"units": unit_of(name)})
        for name, values in recording.signals.items()
        if name != "time_s"
    }
    for name, values in recording.impacts.items():
        shown = np.array(FLANKS)[values] if name == "flank" else values
        variables[f"impact_{name}"] = ("impact", shown, {"units": unit_of(name)})
    time = ("time_s", recording.time, {"units": "s"})
    return xarray.Dataset(variables, coords={"time_s": time}, attrs=recording.meta)

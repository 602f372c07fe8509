"""What is known about a recording, as JSON in the files' metadata."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

_TAG = "$float"


def plain(value: Any, key: str = "meta") -> Any:
    """Return a value as JSON would give it back: numpy scalars and arrays, tuples and keys made plain.

    Args:
        value: anything.
        key: where it stands, for the error.

    Raises:
        TypeError: it is nothing that JSON can hold.

    >>> plain({"b": np.float64(1.5), "c": (1, 2)})
    {'b': 1.5, 'c': [1, 2]}
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, dict):
        return {str(k): plain(v, f"{key}.{k}") for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v, f"{key}[{i}]") for i, v in enumerate(value)]
    raise TypeError(f"{key} is a {type(value).__name__}: JSON cannot hold it")


def to_json(meta: dict[str, Any]) -> str:
    """Return JSON that every reader takes: infinities and NaN are written ``{"$float": "-inf"}``.

    Args:
        meta: made by :func:`plain`.

    >>> to_json({"lyapunov_1_s": -math.inf})
    '{"lyapunov_1_s": {"$float": "-inf"}}'
    """
    return json.dumps(_tagged(meta), allow_nan=False, ensure_ascii=False)


def from_json(text: str | bytes) -> dict[str, Any]:
    """Return what :func:`to_json` wrote.

    Args:
        text: JSON of an object.

    Raises:
        ValueError: it is no JSON, or no object.

    >>> from_json('{"lyapunov_1_s": {"$float": "-inf"}}')
    {'lyapunov_1_s': -inf}
    """
    try:
        meta = json.loads(text, object_hook=lambda d: float(d[_TAG]) if d.keys() == {_TAG} else d)
    except (TypeError, RecursionError) as error:
        raise ValueError(f"is not metadata of gears3d: {error}") from error
    if not isinstance(meta, dict):
        raise ValueError("is no JSON object")
    return meta


def _tagged(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return {_TAG: repr(value)}
    if isinstance(value, dict):
        return {k: _tagged(v) for k, v in value.items()}
    return [_tagged(v) for v in value] if isinstance(value, list) else value

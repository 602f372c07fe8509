"""The libraries that know the formats: found or named with the line that installs them, their errors made ours."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gears3d.errors import Fault, GearsError, InputError
from gears3d.extras import EXTRAS, require

_OWN = ("hdf5", "matlab", "tdms", "mdf", "uff")
_ALONE = {next(iter(one.libraries)): name for name, one in EXTRAS.items() if name in _OWN}
"""The extra that installs a library and nothing else."""


def library(module: str, path: Path, otherwise: str = "") -> Any:
    """Return a library that is there only where an extra was installed.

    Args:
        module: its name in Python.
        path: the file that needs it.
        otherwise: what works without it, for the message.

    Raises:
        MissingExtraError: it is not installed; has the line that installs it.

    >>> library("numpy", Path("a.npy")).__name__
    'numpy'
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return require(module, "this format", _ALONE.get(module, "formats"), file=str(path), otherwise=otherwise)


@contextmanager
def reading(path: Path, form: str) -> Iterator[None]:
    """Turn whatever a library raises on a damaged file into one fault.

    Damaged files make the libraries raise errors of every kind, so all are caught; the block must hold nothing but
    calls of the library.

    Args:
        path: the file.
        form: name of the format.

    Raises:
        InputError: the library raised anything.

    >>> with reading(Path("a.mat"), "MATLAB"):
    ...     raise IndexError("index 7 out of range")
    Traceback (most recent call last):
    gears3d.errors.InputError: a.mat: cannot be read as MATLAB: index 7 out of range (damaged or cut off: export again)
    """
    quiet = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except GearsError:
        raise
    except MemoryError as error:
        what = f"does not fit into memory, or is damaged: {form} asks for too much"
        raise InputError(Fault("", what, "name fewer channels, or export it again", str(path))) from error
    except Exception as error:
        why = " ".join(str(error).split())[:200] or type(error).__name__
        remedy = "damaged or cut off: export again"
        raise InputError(Fault("", f"cannot be read as {form}: {why}", remedy, str(path))) from error
    finally:
        logging.disable(quiet)

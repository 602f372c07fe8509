"""Optional libraries of the formats: imported or reported with the install command, their errors converted."""

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
# The extra that installs a library and nothing else.
_ALONE = {next(iter(one.libraries)): name for name, one in EXTRAS.items() if name in _OWN}


def library(module: str, path: Path, otherwise: str = "") -> Any:
    """Return an optional library.

    Raises MissingExtraError, with the command that installs it, when it is not installed.

    >>> library("numpy", Path("a.npy")).__name__
    'numpy'
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return require(module, "this format", _ALONE.get(module, "formats"), file=str(path), otherwise=otherwise)


@contextmanager
def reading(path: Path, form: str) -> Iterator[None]:
    """Convert every exception of a library on a damaged file to an InputError.

    Damaged files make the libraries raise errors of every kind, so all are caught; the block must hold nothing but
    calls of the library.

    Raises InputError when the library raised anything.

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

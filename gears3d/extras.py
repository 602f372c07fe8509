"""Optional dependencies: which extra of gears3d installs which library, and loading one or naming its pip line."""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.util import find_spec
from types import ModuleType
from typing import Any, NamedTuple

from gears3d.errors import Fault, MissingExtraError


class Extra(NamedTuple):
    """An optional part of the installation.

    Args:
        libraries: name of the distribution by name of the module.
        purpose: what works with it alone.
        note: shown with the pip line where pip has no ready-made wheel.
    """

    libraries: dict[str, str]
    purpose: str
    note: str = ""


_FORMATS = {
    "h5py": "h5py",
    "matio": "mat-io",
    "nptdms": "npTDMS",
    "asammdf": "asammdf",
    "pyuff": "pyuff",
}
# The extras of ``pyproject.toml`` that users install.
EXTRAS = {
    "engine": Extra(
        {"pybullet": "pybullet", "trimesh": "trimesh"},
        "the 3D engine (run, bench, sweep --model bullet) and gears as STL, OBJ and GLB files (export)",
        "pybullet has ready-made wheels for Python 3.11 on Linux alone; elsewhere pip builds it with a C++ compiler",
    ),
    "replay": Extra({"rerun": "rerun-sdk"}, "replay.rrd and the rerun viewer (run, replay, diagnose)"),
    "formats": Extra(_FORMATS, "records in HDF5, MATLAB v7.3, tables of MATLAB, TDMS, MDF and UFF"),
    "sweep": Extra(
        {"xarray": "xarray", "h5netcdf": "h5netcdf", "h5py": "h5py", "distributed": "distributed"},
        "many runs as one dataset, here or on a dask cluster (sweep)",
    ),
    "video": Extra({"av": "av"}, "animations as MP4 (camera --video)"),
    "cad": Extra(
        {"OCP": "cadquery-ocp-novtk", "trimesh": "trimesh"},
        "gears as STEP files with B-spline flanks (export --format step)",
    ),
    "tables": Extra({"pandas": "pandas", "xarray": "xarray"}, "recordings as pandas and xarray tables"),
    "hdf5": Extra({"h5py": "h5py"}, "HDF5 and MATLAB v7.3 alone"),
    "matlab": Extra({"matio": "mat-io"}, "tables, timetables and other objects in MATLAB files"),
    "tdms": Extra({"nptdms": "npTDMS"}, "TDMS alone"),
    "mdf": Extra({"asammdf": "asammdf"}, "MDF alone"),
    "uff": Extra({"pyuff": "pyuff"}, "UFF 58 alone"),
}


def require(module: str, user: str, extra: str, *, file: str = "", otherwise: str = "") -> Any:
    """Import an optional library.

    Args:
        module: its name in Python, with submodules.
        user: what needs it, the subject of the message.
        extra: that installs it.
        file: the file that needs it, for the message.
        otherwise: what works without it, added to the pip line.

    Raises:
        MissingExtraError: it is not installed, or cannot be loaded.

    >>> require("numpy.linalg", "a doctest", "tables").__name__
    'numpy.linalg'
    >>> require("pandas_", "a table", "tables")
    Traceback (most recent call last):
    gears3d.errors.MissingExtraError: a table needs pandas_, which is not installed (pip install "gears3d[tables]")
    """
    root = module.partition(".")[0]
    name = EXTRAS[extra].libraries.get(root, root)
    try:
        return import_module(module)
    except ImportError as error:
        if isinstance(error, ModuleNotFoundError) and (error.name or root).partition(".")[0] == root:
            what = f"{user} needs {name}, which is not installed"
            fault = Fault("", what, "; or ".join(filter(None, (pip_line(extra), otherwise))), file)
        else:
            what = f"{user} needs {name}, which is installed but cannot be loaded: {error}"
            fault = Fault("", what, f"install it again: pip install --force-reinstall {name}", file)
        raise MissingExtraError(fault, extra) from error


def missing(extra: str) -> list[str]:
    """Return the distributions of an extra that are not installed.

    Args:
        extra: one of :data:`EXTRAS`.
    """
    return [name for module, name in EXTRAS[extra].libraries.items() if not installed(module)]


def installed(module: str) -> bool:
    """Return whether a library can be found, without loading it.

    Args:
        module: its name in Python.
    """
    try:
        return find_spec(module) is not None
    except (ValueError, ImportError):
        return False


def pip_line(extra: str) -> str:
    """Return what to type to install an extra, with a note where pip has to compile it.

    Args:
        extra: one of :data:`EXTRAS`.
    """
    line, note = f'pip install "gears3d[{extra}]"', EXTRAS[extra].note
    ready_made = sys.platform == "linux" and sys.version_info[:2] == (3, 11)
    return f"{line}; {note}" if note and not ready_made else line


class Late(ModuleType):
    """A module that is imported when the first of its names is used, so that importing its users needs no extra.

    Args:
        module: name of the library in Python.
        user: what needs it.
        extra: that installs it.
    """

    def __init__(self, module: str, user: str, extra: str) -> None:
        super().__init__(module)
        self.__dict__["_asked"] = (module, user, extra)

    def __getattr__(self, name: str) -> Any:
        """Return a name of the library, which is loaded for the first one.

        Raises:
            MissingExtraError: it is not installed.
        """
        if name.startswith("__"):  # of the module itself: who looks at it does not use the library
            raise AttributeError(name)
        known = self.__dict__
        if "_library" not in known:
            known["_library"] = self._load()
        return getattr(known["_library"], name)

    def _load(self) -> Any:
        return require(*self.__dict__["_asked"])

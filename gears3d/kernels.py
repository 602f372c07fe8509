"""Compiling kernels: numba's ``njit``, with a cache whose entries are named after all that a kernel is made of.

A kernel's entry is named after its own bytecode, that of the kernels that it calls, the constants that both read, its
argument types, numba and the processor. An edit compiles the kernels that depend on it, and no others; an entry is
whole or absent, so any number of processes and versions may share the folder.
"""

from __future__ import annotations

import atexit
import contextlib
import enum
import hashlib
import os
import pickle
import shutil
import stat
import sys
import tempfile
import time
import types as python_types
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import _dynfunc, types  # type: ignore[attr-defined]
from numba.core import event
from numba.core.caching import _Cache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_machinery import LoweringPass, register_pass
from numba.core.dispatcher import Dispatcher
from numba.core.extending import _Intrinsic
from numba.core.runtime.nrt import rtsys
from numba.core.serialize import dumps
from numba.core.typed_passes import IRLegalization, NativeLowering
from numba.core.typing.templates import Signature
from platformdirs import user_cache_path

from gears3d.files import temporary

HOME = Path(__file__).parent
# Entries of other states of a kernel are removed after so long [s].
OLD = 30 * 86400.0


def njit(function: Any = None, **options: Any) -> Any:
    """Compile a function on first use, as ``numba.njit`` does; ``cache=True`` keeps the result on this machine.

    Args:
        function: of Python, in nopython mode.
        options: numba's.
    """
    if function is None:
        return lambda decorated: njit(decorated, **options)
    keep = options.pop("cache", False)
    made: Any = numba.njit(**options)(function)
    if keep:
        made._cache = _Kept(made)
    made.get_call_template = partial(_plain_template, made)
    made.compile = partial(_with_room, made.compile)
    made.typeof_pyval = partial(_typeof, made)
    return made


def _plain_template(kernel: Any, args: Any, kws: Any) -> Any:
    """Compile a kernel for integers, not once for each constant that a caller gives it."""
    plain = {name: types.unliteral(kind) for name, kind in kws.items()}
    return type(kernel).get_call_template(kernel, tuple(types.unliteral(kind) for kind in args), plain)


def _typeof(kernel: Any, value: Any) -> Any:
    """Return the type of an argument, which numba asks for at every call of a record; a record names its own."""
    kind = getattr(value, "compiled", None)
    if not isinstance(kind, types.Type):
        return type(kernel).typeof_pyval(kernel, value)
    kernel._types_active_call.add(kind)
    return kind


def _with_room(call: Callable[..., Any], *args: Any) -> Any:
    """Call with half a megabyte of Python's stack in one piece.

    Python 3.11 and 3.12 take the stack from the system in pieces of 16 kB. Where a loop's calls cross the end of one,
    each of them maps memory and unmaps it again, which can double the time of a compilation.
    """
    return call(*args)


_with_room.__code__ = _with_room.__code__.replace(co_stacksize=66_000)  # 8 bytes each; a power of two is taken


class _Lowered(JITCodeLibrary):
    """Code in LLVM's language, left to those that link it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=False, analysis_only=True)
class _KeepLowered(LoweringPass):
    """Take a library that is not translated; runs before the lowering."""

    _name = "keep_lowered"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Run the pass."""
        state.library = _Lowered(state.targetctx.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        return False


@register_pass(mutates_CFG=False, analysis_only=True)
class _MakeCallable(LoweringPass):
    """Let compiled code call what has been lowered; runs after the lowering."""

    _name = "make_callable"

    def __init__(self) -> None:
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Run the pass."""
        lowered = state["cr"]
        name = lowered.fndesc.qualname.split(".")[-1]
        key = _dynfunc.make_function(lowered.fndesc.lookup_module(), name, "", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=key)
        return False


class _LowerOnly(CompilerBase):
    """Numba's own passes, with the two above."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_KeepLowered, IRLegalization)
        passes.add_pass_after(_MakeCallable, NativeLowering)
        passes.finalize()
        return [passes]


class Inner:
    """A function that compiled code calls; from Python it runs as it is written.

    Numba optimises and translates every function with a copy of all that it calls, so that a function five levels below
    the entry goes through LLVM five times. An inner function is only lowered to LLVM's language; the entry that calls
    it links all of them, and optimises and translates them once.

    Args:
        function: of Python.
        options: numba's.
    """

    def __init__(self, function: Any, **options: Any) -> None:
        wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.kernel = njit(function, pipeline_class=_LowerOnly, **wrappers, **options)
        self.py_func = function
        self._numba_type_ = types.Dispatcher(self.kernel)

    def __call__(self, *args: Any) -> Any:
        """Run the function as Python."""
        return self.py_func(*args)


def inner(function: Any, **options: Any) -> Inner:
    """Decorate a function that compiled code calls, see :class:`Inner`.

    Args:
        function: of Python.
        options: numba's.
    """
    return Inner(function, **options)


# What reading an entry raises that is not whole: of pickle, and of LLVM, whose errors are RuntimeErrors.
_DAMAGED = (OSError, EOFError, pickle.UnpicklingError, ImportError, AttributeError, LookupError, TypeError, ValueError,
            RuntimeError)  # fmt: skip


class _Kept(_Cache):
    """One file for each compiled signature of a kernel."""

    def __init__(self, kernel: Any) -> None:
        self._kernel = kernel
        self._on = True

    @property
    def cache_path(self) -> str:
        return str(place())

    def enable(self) -> None:
        self._on = True

    def disable(self) -> None:
        self._on = False

    def flush(self) -> None:
        for path in place().glob(f"{self._name()}-*.nbc"):
            path.unlink(missing_ok=True)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return a kernel that was compiled before.

        Code that is compiled needs the library of reference counts, but none of the 100 modules, scipy.linalg among
        them, from which ``target_context.refresh()`` learns how to compile; numba's compiler loads them itself.
        """
        if not self._on:
            return None
        path = self._path(sig, target_context.codegen())
        try:
            entry = path.read_bytes()
            rtsys.initialize(target_context)
            return CompileResult._rebuild(target_context, *pickle.loads(entry))
        except FileNotFoundError:
            return None
        except _DAMAGED:  # as good as none
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        if not self._on or data.library.has_dynamic_globals or any(not one.can_cache for one in data.lifted):
            return
        path = self._path(sig, data.codegen)
        with contextlib.suppress(OSError):
            with temporary(path.parent) as folder:
                (folder / path.name).write_bytes(dumps(data._reduce()))
                (folder / path.name).replace(path)
            for other in path.parent.glob(f"{self._name()}-*.nbc"):
                if time.time() - other.stat().st_mtime > OLD:
                    other.unlink(missing_ok=True)

    def _name(self) -> str:
        return f"{self._kernel.py_func.__module__}.{self._kernel.py_func.__qualname__}".replace("<locals>.", "")

    def _path(self, sig: Any, codegen: Any) -> Path:
        of_machine = (sys.version_info[:3], numba.__version__, llvmlite.__version__, codegen.magic_tuple(), _lowering())
        whole = f"{fingerprint(self._kernel)} {sig} {of_machine}"
        return place() / f"{self._name()}-{hashlib.sha256(whole.encode()).hexdigest()[:24]}.nbc"


@cache
def fingerprint(kernel: Any) -> str:
    """Return digits that change with a kernel, the kernels that it calls and the constants that they read.

    Args:
        kernel: made by :func:`njit` or :func:`inner`.
    """
    digest = hashlib.sha256()
    _describe(kernel, digest, set())
    return digest.hexdigest()


def _describe(value: Any, digest: Any, seen: set[int]) -> None:
    """Add what a value that compiled code reads contributes to the code."""
    value = value.kernel if isinstance(value, Inner) else value
    if isinstance(value, Dispatcher):
        digest.update(repr(sorted(value.targetoptions.items(), key=str)).encode())
        value = value.py_func
    elif isinstance(value, _Intrinsic):
        value = value._defn
    if isinstance(value, python_types.FunctionType):
        if id(value) not in seen:
            seen.add(id(value))
            digest.update(value.__qualname__.encode())
            for cell in value.__closure__ or ():
                with contextlib.suppress(ValueError):  # a cell that is still empty
                    _describe(cell.cell_contents, digest, seen)
            _describe_code(value.__code__, value.__globals__, digest, seen)
    elif isinstance(value, np.ndarray):
        digest.update(value.tobytes() + repr((value.shape, value.dtype)).encode())
    elif isinstance(value, (bool, int, float, complex, str, bytes, type(None), tuple, enum.Enum)):
        digest.update(repr(value).encode())
    elif isinstance(value, (types.Type, Signature)):
        digest.update(str(value).encode())
    else:
        digest.update(repr((getattr(value, "__qualname__", type(value)), getattr(value, "_fields", ""))).encode())


def _describe_code(code: Any, names: dict[str, Any], digest: Any, seen: set[int]) -> None:
    digest.update(code.co_code + repr((code.co_names, code.co_varnames)).encode())
    for constant in code.co_consts:
        if isinstance(constant, python_types.CodeType):
            _describe_code(constant, names, digest, seen)
        else:
            digest.update(repr(constant).encode())
    for name in code.co_names:
        value = names.get(name)
        if isinstance(value, python_types.ModuleType):
            if value.__name__.startswith("gears3d"):  # what is read of a module of ours stands among the names
                for attribute in code.co_names:
                    _describe(getattr(value, attribute, None), digest, seen)
        else:
            _describe(value, digest, seen)


@cache
def _lowering() -> str:
    """Return digits that change with how records are compiled, which no kernel's own code shows."""
    return hashlib.sha256((HOME / "records.py").read_bytes()).hexdigest()


@cache
def sources() -> str:
    """Return twelve digits that change with every module of gears3d from which models are made, and with numba."""
    digest = hashlib.sha256(numba.__version__.encode())
    for part in ("effects", "engine", "gears", "integrator.py", "laws", "lumped", "records.py", "stiffness"):
        for path in sorted((HOME / part).rglob("*.py")) or [HOME / part]:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


@cache
def place() -> Path:
    """Return the folder of the compiled kernels.

    ``NUMBA_CACHE_DIR`` names it, else it is in the user's cache folder. What is loaded from there is run, so a folder
    that others may write to is not used: kernels are then compiled for this process alone.
    """
    named = os.environ.get("NUMBA_CACHE_DIR")
    try:
        folder = Path(named) if named else user_cache_path("gears3d") / "kernels"
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _mine(folder) and os.access(folder, os.W_OK | os.X_OK):
            return folder
    except (OSError, RuntimeError):  # no home folder, or one that cannot be written to
        pass
    alone = Path(tempfile.mkdtemp(prefix="gears3d-kernels-"))
    atexit.register(shutil.rmtree, alone, ignore_errors=True)
    return alone


def _mine(folder: Path) -> bool:
    """Whether a folder belongs to this user and nobody else can write to it."""
    found = folder.lstat()
    if not hasattr(os, "getuid"):
        return stat.S_ISDIR(found.st_mode)
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & 0o022


# Names of the kernels that this process has begun to compile, as ``module.function``, in order.
compiled: list[str] = []
# Called with the name of every kernel whose compilation begins.
watchers: list[Callable[[str], None]] = []


class _Listener(event.Listener):
    def on_start(self, event: Any) -> None:
        function = event.data["dispatcher"].py_func
        if str(function.__module__).startswith("gears3d."):
            compiled.append(f"{function.__module__.removeprefix('gears3d.')}.{function.__name__}")
            for watcher in watchers:
                watcher(compiled[-1])

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Listener())


@contextlib.contextmanager
def watched(report: Callable[[str], None]) -> Iterator[None]:
    """Call ``report`` with the name of every kernel whose compilation begins meanwhile."""
    watchers.append(report)
    try:
        yield
    finally:
        watchers.remove(report)

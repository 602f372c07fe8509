"""Records that compiled functions read through one pointer, and calls of compiled functions by their address.

Numba passes a tuple of arrays as one value for each pointer, extent and stride: a hundred for the flanks of a pair, in
every call, which costs more to compile than what the functions compute. A :class:`Record` is one pointer. An address
of a compiled function in a record keeps what the function calls out of its callers: neither is compiled for the other.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, get_args, get_origin, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)
from numba.np.arrayobj import populate_array
from numpy.typing import NDArray

_FLOATS = NDArray[np.float64]
Floats1 = Annotated[_FLOATS, 1]
Floats2 = Annotated[_FLOATS, 2]
Floats3 = Annotated[_FLOATS, 3]
Floats4 = Annotated[_FLOATS, 4]
_SCALARS = {float: types.float64, int: types.int64, bool: types.boolean}
_WORD = ir.IntType(64)


class RecordType(types.Type):
    """The type of a record in compiled code; its name holds the layout, so that a changed one is compiled again."""

    def __init__(self, cls: type[Record]) -> None:
        self.cls = cls
        fields = ",".join(f"{name}:{kind}" for name, kind in cls.layout.items())
        super().__init__(name=f"{cls.__module__}.{cls.__qualname__}({fields})")


class Record:
    """Fields in fixed order: floats, ints, bools, arrays of floats (``Floats1`` to ``Floats4``), and other records.

    A subclass annotates its fields; they are given in that order or by name, arrays are kept contiguous. Fields do not
    change, but compiled code may write into arrays.

    >>> class Spring(Record):
    ...     stiffness: float
    ...     lengths: Floats1
    >>> Spring(2.0, [1.0, 3.0]).lengths
    array([1., 3.])
    """

    layout: ClassVar[dict[str, types.Type]] = {}
    compiled: ClassVar[RecordType]
    _defaults: ClassVar[dict[str, Any]] = {}

    def __init_subclass__(cls) -> None:
        hints = get_type_hints(cls, include_extras=True)
        cls.layout = {name: _compiled_kind(hint) for name, hint in hints.items() if get_origin(hint) is not ClassVar}
        cls.compiled = RecordType(cls)
        cls._defaults = {name: getattr(cls, name) for name in cls.layout if hasattr(cls, name)}

    def __init__(self, *values: Any, **named: Any) -> None:
        given = self._defaults | dict(zip(self.layout, values, strict=False)) | named
        if len(values) > len(self.layout) or given.keys() != self.layout.keys():
            raise TypeError(f"{type(self).__name__} takes {', '.join(self.layout)}")
        words: list[int] = []
        for name, kind in self.layout.items():
            value = given[name]
            if isinstance(kind, types.Array):
                value = np.ascontiguousarray(value, dtype=np.float64)
                if value.ndim != kind.ndim:
                    raise TypeError(f"{type(self).__name__}.{name} has {kind.ndim} dimensions, not {value.ndim}")
                words += [value.__array_interface__["data"][0], *value.shape]
            elif isinstance(kind, RecordType):
                words.append(value._address)
            elif kind == types.float64:
                words.append(int(np.float64(value).view(np.int64)))
            else:
                words.append(int(value))
            setattr(self, name, value)
        self._words = np.array(words, np.int64)  # kept as long as the record, like the arrays
        self._address: int = self._words.__array_interface__["data"][0]

    def __reduce__(self) -> str:
        raise TypeError(f"{type(self).__name__} holds addresses of this process")


def _compiled_kind(hint: Any) -> types.Type:
    """Return the compiled type of a field's annotation."""
    if get_origin(hint) is Annotated:
        return types.Array(types.float64, get_args(hint)[1], "C")
    return hint.compiled if isinstance(hint, type) and issubclass(hint, Record) else _SCALARS[hint]


@register_model(RecordType)
class _RecordModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, _WORD.as_pointer())


@typeof_impl.register(Record)
def _typeof_record(value: Record, _: Any) -> RecordType:
    return value.compiled


@unbox(RecordType)
def _unbox_record(_: Any, obj: Any, c: Any) -> NativeValue:
    number = c.pyapi.object_getattr_string(obj, "_address")
    pointer = c.pyapi.long_as_voidptr(number)
    c.pyapi.decref(number)
    return NativeValue(c.builder.bitcast(pointer, _WORD.as_pointer()))


@infer_getattr
class _RecordAttribute(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, typ: RecordType, attr: str) -> types.Type | None:
        return typ.cls.layout.get(attr)


@lower_getattr_generic(RecordType)
def _lower_attribute(context: Any, builder: Any, typ: RecordType, value: Any, attr: str) -> Any:
    at, kind = 0, types.none
    for name, kind in typ.cls.layout.items():
        if name == attr:
            break
        at += 1 + (kind.ndim if isinstance(kind, types.Array) else 0)

    def word(i: int) -> Any:
        return builder.load(builder.gep(value, [ir.Constant(ir.IntType(32), at + i)]))

    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder)
        shape = [word(1 + i) for i in range(kind.ndim)]
        strides = [context.get_constant(types.intp, 8)]
        for extent in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], extent, flags=("nsw", "nuw")))
        data = builder.inttoptr(word(0), array.data.type)
        size = context.get_constant(types.intp, 8)
        populate_array(array, data=data, shape=shape, strides=strides, itemsize=size, meminfo=None)
        return array._getvalue()
    if isinstance(kind, RecordType):
        return builder.inttoptr(word(0), _WORD.as_pointer())
    if kind == types.float64:
        return builder.bitcast(word(0), ir.DoubleType())
    return builder.trunc(word(0), ir.IntType(1)) if kind == types.boolean else word(0)


def address_of(function: Any, signature: Any) -> int:
    """Return the address of a compiled function for :func:`caller`, compiling it first if need be.

    Args:
        function: made by ``njit``.
        signature: numba's, as given to the caller.
    """
    function.compile(signature.args)
    made = function.overloads[signature.args]
    if made.signature.return_type != signature.return_type:
        raise TypeError(f"{function.py_func.__name__} returns {made.signature.return_type}, not {signature}")
    return made.library.get_pointer_to_function(made.fndesc.llvm_func_name)


def caller(signature: Any) -> Any:
    """Return ``call(address, (arguments ...))`` for compiled code: it calls a function of which only this is known.

    Args:
        signature: numba's, of numbers, arrays and records.
    """
    arguments, returned = signature.args, signature.return_type

    def call(typing_context, address, given):
        def codegen(context: Any, builder: Any, sig: Any, values: Any) -> Any:
            kind = context.call_conv.get_function_type(returned, arguments)
            function = builder.inttoptr(values[0], kind.as_pointer())
            passed = [
                context.cast(builder, one, have, want)
                for one, have, want in zip(
                    cgutils.unpack_tuple(builder, values[1]), sig.args[1].types, arguments, strict=True
                )
            ]
            status, result = context.call_conv.call_function(builder, function, returned, arguments, passed)
            with cgutils.if_unlikely(builder, status.is_error):
                context.call_conv.return_status_propagate(builder, status)
            return result

        return returned(types.int64, given), codegen

    return intrinsic(call)

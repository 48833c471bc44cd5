"""Compiled functions that are called by address: their callers compile in a quarter of the time.

For a function as an argument, numba fetches the address by Python code at every call. This takes a millisecond, and an
exception raised by a signal would be lost. Here the address is fetched once and passed as a number.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import types
from numba.core import cgutils
from numba.core.errors import NumbaError
from numba.extending import intrinsic

from stickslip.contact.cache import njit
from stickslip.errors import input_error

_vector = types.float64[::1]
STEP_SIGNATURE = types.void(
    _vector, _vector, _vector, _vector, _vector, _vector, types.float64[:, ::1], types.int64[::1]
)
_structure: Any = cgutils.create_struct_proxy


@cache
def address_of(function: Any, signature: Any) -> int:
    """Return the address of a compiled function in this process."""
    compiled = function.get_compile_result(signature)
    address: int = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name)
    return address


def function_at(signature: Any) -> Any:
    """Return the compiled function that converts an address into a function of this signature."""
    kind = types.FunctionType(signature)

    @intrinsic
    def from_address(_: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, values: Any) -> Any:
            made = _structure(kind)(context, builder)
            nowhere = context.get_constant_null(types.voidptr)
            made.c_addr, made.py_addr = nowhere, nowhere
            made.jit_addr = builder.inttoptr(values[0], cgutils.voidptr_t)
            return made._getvalue()  # noqa: SLF001

        return kind(address), generate

    return from_address


law_at = function_at(STEP_SIGNATURE)  # the step of a law


def law_address(kernel: Any) -> int:
    """Return the address of a law's compiled step, for `law_at`."""
    return address_of(kernel, STEP_SIGNATURE)


def compiled_step(step: Callable[..., None]) -> Any:
    """Compile the step of a law, see `contact.law.law_kernel`.

    Raises
    ------
    InputError
        If numba cannot compile it.
    """
    try:
        return njit(STEP_SIGNATURE, cache=True)(step)
    except NumbaError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        raise input_error(
            f"{step.__module__}.{step.__qualname__}",
            f"is no step that numba compiles: {'; '.join(lines[1:5])}",
            "Use numbers, loops and arrays alone; 'A contact law' of docs/extending.md has the arguments.",
        ) from error
    except RuntimeError:  # code without a file has no place for a cache
        return njit(STEP_SIGNATURE)(step)

"""Compilation of kernels: on first use, cached on disk where a place for the cache can be found.

numba takes about half a second to import, so it is imported by the first call of a
kernel. A compiled kernel stays in `__pycache__` beside its source, else in the user's
cache folder; where both are read-only (and NUMBA_CACHE_DIR is not set) it is compiled
anew in each process. numba compiles a cached kernel anew when its own file changes; here
also when a kernel that it calls does, in whatever file.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from hashlib import sha256
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

P = ParamSpec("P")
R = TypeVar("R")


class Kernel(Generic[P, R]):
    """A function that is compiled when it is first called; kernels may call one another.

    Parameters
    ----------
    function : in the subset of Python that numba compiles
    """

    def __init__(self, function: Callable[P, R]) -> None:
        self.function = function
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Callable[P, R]:
        """The compiled form."""
        return compile_kernel(self.function)

    def __call__(self, *args: P.args, **kwargs: P.kwargs) -> R:
        """Run the compiled form, which the first call makes."""
        return self.compiled(*args, **kwargs)


def kernel(function: Callable[P, R]) -> Kernel[P, R]:
    """Mark a function as a kernel."""
    return Kernel(function)


def compile_kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Return numba's compiled form of `function`, cached on disk if that is possible."""
    import numba

    # numba looks up what a function calls in the function's globals, and knows nothing of `Kernel`.
    called = _called(function)
    scope = {**function.__globals__, **{name: other.compiled for name, other in called.items()}}
    linked = update_wrapper(FunctionType(function.__code__, scope), function)
    if called:  # numba finds a kernel in its cache by this name
        linked.__qualname__ = f"{function.__qualname__}-{_digest(function)}"
    try:
        return cast(Callable[P, R], numba.njit(cache=True)(linked))
    except RuntimeError:  # numba's "no locator available": nowhere to write
        return cast(Callable[P, R], numba.njit(cache=False)(linked))


def _called(function: Callable[..., object]) -> "dict[str, Kernel[..., object]]":
    """Return the kernels that a function calls, by name."""
    names = ((name, function.__globals__.get(name)) for name in function.__code__.co_names)
    return {name: value for name, value in names if isinstance(value, Kernel)}


def _digest(function: Callable[..., object]) -> str:
    """Return a fingerprint of what a function and the kernels that it calls compute."""
    code = function.__code__
    numbers = [
        value for name in code.co_names if isinstance(value := function.__globals__.get(name), float | int)
    ]
    parts = [code.co_code.hex(), repr((code.co_consts, code.co_names, code.co_varnames, numbers))]
    parts += [_digest(other.function) for other in _called(function).values()]
    return sha256("".join(parts).encode()).hexdigest()[:16]


def frozen(array: ArrayLike, dtype: DTypeLike) -> np.ndarray[Any, np.dtype[Any]]:
    """Return `array` as a contiguous, read-only view of one type.

    numba compiles a kernel once for each combination of types, layouts and flags that
    it meets; arrays that have passed through here all look the same to it.
    """
    view = np.ascontiguousarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view

"""Compilation of kernels: on first use, cached on disk where a place for the cache can be found.

numba takes about half a second to import, so it is imported by the first call of a
kernel. A compiled kernel stays in `__pycache__` beside its source, else in the user's
cache folder; where both are read-only (and NUMBA_CACHE_DIR is not set) it is compiled
anew in each process.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
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
        self._function = function
        update_wrapper(self, function)

    @cached_property
    def compiled(self) -> Callable[P, R]:
        """The compiled form."""
        return compile_kernel(self._function)

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
    scope = dict(function.__globals__)
    for name in function.__code__.co_names:
        if isinstance(called := scope.get(name), Kernel):
            scope[name] = called.compiled
    linked = update_wrapper(FunctionType(function.__code__, scope), function)
    try:
        return cast(Callable[P, R], numba.njit(cache=True)(linked))
    except RuntimeError:  # numba's "no locator available": nowhere to write
        return cast(Callable[P, R], numba.njit(cache=False)(linked))


def frozen(array: ArrayLike, dtype: DTypeLike) -> np.ndarray[Any, np.dtype[Any]]:
    """Return `array` as a contiguous, read-only view of one type.

    numba compiles a kernel once for each combination of types, layouts and flags that
    it meets; arrays that have passed through here all look the same to it.
    """
    view = np.ascontiguousarray(array, dtype=dtype).view()
    view.flags.writeable = False
    return view

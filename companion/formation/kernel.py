"""The compiled auction, where it was built for this machine; auction.py's own form stands in for it where not."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LIBRARY = Path(__file__).with_name("libkernel.so")
_INT, _REAL, _POINTER = ctypes.c_int32, ctypes.c_double, ctypes.c_void_p


class Kernel:
    """The functions of kernel.c; raises OSError where the library is not there or is another machine's."""

    def __init__(self, library: Path = LIBRARY) -> None:
        functions = ctypes.CDLL(str(library))
        self._auction, self._ways = functions.shoal_auction, functions.shoal_ways
        self._auction.argtypes = (_INT, _INT, _POINTER, _POINTER, _POINTER, _REAL, _REAL, *[_POINTER] * 3)
        self._auction.restype = ctypes.c_int
        self._ways.argtypes = (_INT, _INT, _POINTER, _POINTER, _POINTER)
        self._ways.restype = None

    def auction(
        self,
        costs: Array,
        room: NDArray[np.int32] | None,
        order: NDArray[np.int32] | None,
        epsilon: float,
        coarsening: float,
    ) -> tuple[list[int], list[float], float, float]:
        """Winners and prices as auction.py defines them, total and bound, of costs (L, J); raises MemoryError."""
        points, columns = costs.shape
        winner, figures = np.empty(points, dtype=np.int32), np.empty(columns + 2)
        given = (_at(costs), room if room is None else _at(room), order if order is None else _at(order))
        out = _at(figures)
        if self._auction(points, columns, *given, epsilon, coarsening, _at(winner), out, out + 8 * columns):
            raise MemoryError(f"auction of {points} points among {columns} vehicles")
        numbers: list[float] = figures.tolist()
        return winner.tolist(), numbers[:-2], numbers[-2], numbers[-1]

    def ways(self, points: Array, vehicles: Array) -> Array:
        """Straight ways (L, J) m from vehicles (J, 3) to points (L, 3)."""
        to, here = np.array(points, dtype=float, order="C"), np.array(vehicles, dtype=float, order="C")
        if not to.size or not here.size:
            return np.empty((len(to), len(here)))
        ways = np.empty((len(to), len(here)))
        self._ways(len(to), len(here), _at(to), _at(here), _at(ways))
        return ways


def load() -> Kernel | None:
    """The kernel, None where there is none for this machine."""
    try:
        return Kernel()
    except OSError:
        return None


# The address of an array's first element; of all ways to ask, the quickest, for arrays that may be written to.
def _at(array: NDArray[np.generic]) -> int:
    return ctypes.addressof(ctypes.c_char.from_buffer(array.data))

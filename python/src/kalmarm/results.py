"""What calls return beside plain arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray


class Derivatives(NamedTuple):
    """Derivatives of an acceleration, and the acceleration itself, of n DoF that are asked about.

    Column j of dq is for a change of q along DoF j's velocity, so that joints with quaternions have
    as many columns as DoF.
    """

    dq: NDArray[Any]  # by q, (..., n, n)
    dqd: NDArray[Any]  # by qd, (..., n, n)
    dtau: NDArray[Any]  # by tau, (..., n, n): the inverse of what a step or M factors
    a: NDArray[Any]  # (..., n)

"""Bodies that hang on frames, as calls take them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray


def payload(
    mass: ArrayLike, center: ArrayLike = (0.0, 0.0, 0.0), inertia: ArrayLike = 0.0
) -> NDArray[np.floating]:
    """The ten numbers of a body that hangs on a frame, of a call's `loads`.

    mass (...) [kg]; center (..., 3), of mass, in the frame's axes from its origin [m]; inertia, about the center in
    the frame's axes [kg m^2]: (..., 3, 3), or (..., 3) moments where these are principal axes; 0: a point
    -> (..., 10): m, h = m c, and about the frame's origin
    Ixx, Iyy, Izz, Ixy, Ixz, Iyz of I + m (c'c 1 - c c').

    robot.forward_dynamics(q, qd, tau, loads=payload(np.linspace(0, 2, 100), center=(0, 0, 0.1)))
    """
    m, c, given = np.asarray(mass), np.asarray(center), np.asarray(inertia)
    dtype = np.result_type(m, c, given, np.float32)
    return np.stack(np.broadcast_arrays(*ten_numbers(m, c, given, np.eye(3))), -1).astype(dtype)


def ten_numbers(m: Any, c: Any, given: Any, one: Any) -> list[Any]:
    """Those of `payload`, of arrays of any framework: mass, center and inertia; one: its (3, 3) of ones."""
    if c.shape[-1:] != (3,):
        raise ValueError(f"payload: center has shape {tuple(c.shape)}, (..., 3) is needed")
    if given.ndim == 0:
        given = given + 0 * c
    if given.shape[-2:] == (3, 3):
        tensor = given
    elif given.shape[-1:] == (3,):
        tensor = given[..., None] * one
    else:
        raise ValueError(f"payload: inertia has shape {tuple(given.shape)}, (..., 3, 3) or (..., 3) is needed")
    h = m[..., None] * c
    about = tensor + (h * c).sum(-1)[..., None, None] * one - h[..., :, None] * c[..., None, :]
    moments = [about[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
    return [m, h[..., 0], h[..., 1], h[..., 2], *moments]

"""Bodies that hang on frames, as calls take them."""

from __future__ import annotations

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
    if c.shape[-1:] != (3,):
        raise ValueError(f"payload: center has shape {c.shape}, (..., 3) is needed")
    if given.ndim == 0:
        given = np.zeros(3) + given
    if given.shape[-2:] == (3, 3):
        tensor = given
    elif given.shape[-1:] == (3,):
        tensor = given[..., None] * np.eye(3)
    else:
        raise ValueError(f"payload: inertia has shape {given.shape}, (..., 3, 3) or (..., 3) is needed")
    h = m[..., None] * c
    moments = tensor + (
        np.sum(h * c, axis=-1)[..., None, None] * np.eye(3) - h[..., :, None] * c[..., None, :]
    )
    shape = np.broadcast_shapes(m.shape, h.shape[:-1], moments.shape[:-2])
    out = np.empty((*shape, 10), dtype)
    out[..., 0] = m
    out[..., 1:4] = h
    for column, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)], 4):
        out[..., column] = moments[..., i, j]
    return out

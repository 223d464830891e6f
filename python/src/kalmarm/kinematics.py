"""Where a robot's frames and its mass are, and how they move."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._names import one_of, several

if TYPE_CHECKING:
    from ._core import Frame, Model


COLUMNS = ("rotations", "coriolis", "regressor")  # matrices that come column after column


class Kinematics(_core.Kinematics):
    """Made by `Robot.kinematics(frames)`. Every call takes one state or states in leading dimensions, as
    those of `Robot` do, and returns a dictionary of the results that are asked for:

        hand = robot.kinematics(["hand"])
        now = hand.compute(["positions", "jacobians", "velocities"], q, qd, axes="local")
        v = now["jacobians"][0] @ qd  # now["velocities"][0]

    F: the number of frames, n: that of degrees of freedom.

    positions (F, 3), rotations (F, 3, 3), quaternions (F, 4), w first and not negative: of the frames in
        the base's axes.
    jacobians (F, 6, n), velocities (F, 6), accelerations (F, 6): (angular; linear) in `axes`. Velocities are
        J qd, accelerations J qdd + dJ/dt qd, without gravity; qdd is zero where it is not given.
    center (3,), center_velocity, center_acceleration, center_jacobian (3, n): of the centre of mass.
    momentum (6,): angular about the centre of mass, linear: A qd. momentum_rate (6,): A qdd + dA/dt qd.
        momentum_matrix (6, n): A.
    kinetic_energy (), with rotors; potential_energy ().
    coriolis (n, n): C of tau = M qdd + C qd + gravity, for which dM/dt - 2 C is skew-symmetric.
    regressor (n, 10 n), or (n, 10 b) of b chosen bodies: Y of tau = Y pi + r qdd, gravity included, with
        pi = (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of the link of every DoF or of each body, about its origin in its
        axes, and r the armatures. Derivatives of a by pi: solve(q, -Y.T).T with Y at qdd = a.

    axes: "local": the frame's own (Pinocchio's LOCAL); "world": the base's, of what passes its origin (WORLD);
        "aligned": the base's, of the frame's origin, with its classical acceleration (LOCAL_WORLD_ALIGNED;
        MuJoCo's mj_jac).
    """

    def __init__(
        self, model: Model, names: Iterable[str], frames: Iterable[Frame], bodies: Iterable[int] = ()
    ) -> None:
        chosen, placed = list(bodies), list(frames)
        super().__init__(model, placed, chosen)
        self.frames: tuple[str, ...] = tuple(names)
        self._made = (model, self.frames, placed, chosen)
        count, nv = len(self.frames), model.nv
        self.model = model
        self._widths = {"q": model.nq, "p": 3 * count, "o": 9 * count, "j": 6 * count * nv}  # of operators
        self._shapes: dict[str, tuple[int, ...]] = {
            "positions": (count, 3),
            "rotations": (count, 3, 3),
            "quaternions": (count, 4),
            "jacobians": (count, 6, nv),
            "velocities": (count, 6),
            "accelerations": (count, 6),
            "center": (3,),
            "center_velocity": (3,),
            "center_acceleration": (3,),
            "center_jacobian": (3, nv),
            "momentum": (6,),
            "momentum_rate": (6,),
            "momentum_matrix": (6, nv),
            "kinetic_energy": (),
            "potential_energy": (),
            "coriolis": (nv, nv),
            "regressor": (10 * (len(chosen) or nv), nv),
        }

    def compute(
        self,
        results: Iterable[str],
        q: ArrayLike,
        qd: ArrayLike | None = None,
        qdd: ArrayLike | None = None,
        *,
        axes: str = "aligned",
        threads: int = 1,
    ) -> dict[str, NDArray[Any]]:
        """The results of that name; what moves needs qd (..., nv). A state that is not finite gives
        results that are not, in its own row."""
        known = tuple(self._shapes)
        names = [one_of("result", name, known) for name in several("results", results)]
        numbers = [known.index(name) for name in names]
        out = {}
        for name, flat in zip(names, self._compute(numbers, q, qd, qdd, axes, threads)):
            shaped = flat.reshape(flat.shape[:-1] + self._shapes[name])
            out[name] = np.swapaxes(shaped, -1, -2) if name in COLUMNS else shaped
        return out

    def __repr__(self) -> str:
        dofs = self._made[0].nv
        return f"<kalmarm.Kinematics of {dofs} DoF, {', '.join(self.frames) or 'no frame'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """By what it was made of: copies take memory of their own."""
        return type(self), self._made

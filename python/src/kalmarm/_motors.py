"""What the actuators of a robot's file do in an implicit step."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._names import numbers
from .robot import Actuator, Robot

Array = NDArray[np.float64]


class Driven(NamedTuple):
    """Of states: the torque, and gains with references of zero where they are not the step's own."""

    torque: Array  # (..., nv)
    damping: Array | None = None  # (..., nv)
    stiffness: Array | None = None

    def gains(self) -> dict[str, Array]:
        if self.damping is None or self.stiffness is None:
            return {}
        zero = np.zeros_like(self.damping)
        return {"damping": self.damping, "stiffness": self.stiffness, "reference": zero}


class Motors:
    """With the control u, and the length l and rate l' of its joint or tendon, an actuator exerts

        f = gain u + constant - k l - b l',   k = stiffness + (u - control) stiffness_by_control    (1)

    and b likewise. `Terms` has them at their controls: dampers B, springs K, and a pull of
    torque + K reference. As in MuJoCo, one whose f leaves its range, and all of a joint where their
    sum does, are the force of that limit, without k and b. In other words a state has

        pull + sum of (f0 - f0 of Terms),   f0 = gain u + constant, or the limit                    (2)
        B + sum of (b - b of Terms),  K + sum of (k - k of Terms)
    """

    def __init__(self, robot: Robot, ctrl: Any, *, has_own_gains: bool) -> None:
        """has_own_gains: dampers and springs are not the file's, so that limits are those of
        actuators without them."""
        terms, nv = robot.terms, robot.nv
        self.count = len(terms.actuators)
        actuators = terms.actuators
        self._loaded = np.array([one.control for one in actuators])
        self._range = np.array([one.control_range for one in actuators]).reshape(-1, 2).T
        self._gain = np.array([one.gain for one in actuators])
        self._moves = np.zeros((self.count, nv))
        for moved, one in zip(self._moves, actuators):
            if one.dof >= 0:
                moved[one.dof] = 1
            else:
                moved[:] = terms.rows[one.row].jacobian
        self.ctrl = self._loaded if ctrl is None else self._within(ctrl)

        # Those that may be at a limit, or be stiffer at other controls.
        limits = (
            np.full((nv, 2), np.inf) * (-1, 1) if terms.force_range is None else terms.force_range
        )
        self._joint_range = limits.T

        def changes(one: Actuator) -> bool:
            limited = np.isfinite([*one.force_range, *limits[one.dof]]).any()
            by_control = one.stiffness_by_control != 0 or one.damping_by_control != 0
            is_spring = by_control or one.stiffness != 0 or one.damping != 0
            return one.dof >= 0 and (limited or by_control) and not (has_own_gains and is_spring)

        self._changing = np.array([changes(one) for one in actuators], bool)
        self._with_slope = [
            one.name
            for one, changing in zip(actuators, self._changing)
            if not changing and (one.stiffness_by_control != 0 or one.damping_by_control != 0)
        ]
        some = [one for one, changing in zip(actuators, self._changing) if changing]
        self._dof = [one.dof for one in some]
        self._q = [robot.model.q_index[dof] for dof in self._dof]
        (
            self._constant,
            self._stiffness,
            self._damping,
            self._stiffness_by,
            self._damping_by,
        ) = (
            np.array(
                [
                    (
                        one.constant,
                        one.stiffness,
                        one.damping,
                        one.stiffness_by_control,
                        one.damping_by_control,
                    )
                    for one in some
                ]
            )
            .reshape(-1, 5)
            .T
        )
        self._forces = np.array([one.force_range for one in some]).reshape(-1, 2).T
        self._terms = terms

    def _within(self, ctrl: Any) -> Array:
        given = numbers("ctrl", ctrl)
        if given.ndim and given.shape[-1] != self.count:
            raise ValueError(
                f"ctrl has shape {given.shape}, (..., {self.count}) is needed: one for each of the "
                "robot's terms.actuators"
            )
        return np.clip(np.broadcast_to(given, (*given.shape[:-1], self.count)), *self._range)

    def driven(self, q: Any, qd: Any, ctrl: Any) -> Driven:
        """(2) of states, at their controls."""
        u = self.ctrl if ctrl is None else self._within(ctrl)
        more = u - self._loaded
        torque = self._terms.torque + (more * self._gain) @ self._moves
        if self._with_slope and np.any(more):
            raise ValueError(
                f"ctrl: actuator '{self._with_slope[0]}' has a gain by its length or velocity, and "
                "other terms of the step stand in its way: load the robot with these controls"
            )
        if not self._dof:
            return Driven(torque)
        more, u, gain = (x[..., self._changing] for x in (more, u, self._gain))
        k = self._stiffness + more * self._stiffness_by
        b = self._damping + more * self._damping_by
        q, qd = np.asarray(q, float), np.asarray(qd, float)
        length, rate = q[..., self._q], qd[..., self._dof] if qd.ndim else qd
        f0 = gain * u + self._constant
        f = f0 - k * length - b * rate
        limited = np.clip(f, *self._forces)
        of_joints = self._moves[self._changing]
        total = limited @ of_joints
        limited_total = np.clip(total, *self._joint_range)
        over = limited_total != total
        of_over = over[..., self._dof]
        held = (limited != f) | of_over
        instead = np.where(held, np.where(of_over, 0, limited), f0) - f0
        torque = torque + instead @ of_joints + np.where(over, limited_total, 0)
        more_k = (np.where(held, 0, k) - self._stiffness) @ of_joints
        more_b = (np.where(held, 0, b) - self._damping) @ of_joints
        if not np.any(more_k) and not np.any(more_b):
            return Driven(torque)
        terms = self._terms
        return Driven(
            torque + terms.stiffness * terms.reference,
            np.maximum(terms.damping + more_b, 0),  # of differences that round below zero
            np.maximum(terms.stiffness + more_k, 0),
        )

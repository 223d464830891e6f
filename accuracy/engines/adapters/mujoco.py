"""MuJoCo, float64, by its own Python package."""

import mujoco
import numpy as np

from protocol import Call, Engine, Mechanism, State, Unsupported


STEP = 1e-6  # of finite differences, as its manual has it


class Adapter(Engine):
    name = "MuJoCo"
    package = "mujoco-core"
    calls = {
        "mass": "mj_fwdPosition, mj_fullM",
        "inverse": "mj_fwdPosition, mj_solveM on the unit vectors",
        "acceleration": "mj_forward, qacc_smooth",
        "inverse_dynamics": "mj_inverse, qfrc_inverse",
        "derivatives": "mjd_inverseFD: finite differences of inverse dynamics, by mj_solveM",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        try:
            self.model = mujoco.MjModel.from_xml_path(str(mechanism.mjcf))
        except ValueError as error:
            raise Unsupported(str(error).splitlines()[0]) from None
        self.data = mujoco.MjData(self.model)
        self.unit = np.eye(mechanism.nv)

    def call(self, task: str, state: State) -> Call:
        model, data = self.model, self.data

        def mass():
            M = np.empty((model.nv, model.nv))
            data.qpos = state.q
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fullM(model, data, M)
            return M

        def inverse():
            X = np.empty((model.nv, model.nv))
            data.qpos = state.q
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_solveM(model, data, X, self.unit)
            return X

        def acceleration():
            data.qpos, data.qvel, data.qfrc_applied = state.q, state.v, state.tau
            mujoco.mj_forward(model, data)
            return data.qacc_smooth

        def inverse_dynamics():
            data.qpos, data.qvel, data.qacc = state.q, state.v, state.a
            mujoco.mj_inverse(model, data)
            return data.qfrc_inverse

        def derivatives():
            acceleration()
            data.qacc = data.qacc_smooth
            by = np.empty((3, model.nv, model.nv))  # rows of torques by q, v and a
            mujoco.mjd_inverseFD(model, data, STEP, False, *by, None, None, None, None)
            mujoco.mj_fwdPosition(model, data)  # its last M is of another q
            by[2] = -self.unit
            solved = np.empty((3 * model.nv, model.nv))
            mujoco.mj_solveM(model, data, solved, -by.reshape(-1, model.nv))
            return np.hstack([X.T for X in solved.reshape(by.shape)])

        return Call(locals()[task], lambda x: np.array(x))

    def batch(self, states: list[State]):
        from mujoco.batch import Batch

        many = Batch(self.model, nsim=len(states))  # on all cores
        rows = zip(*(state[:3] for state in states), strict=True)
        for name, x in zip(("qpos", "qvel", "qfrc_applied"), rows, strict=True):
            many.bind(name)[:] = np.stack(x)
        a = many.bind("qacc_smooth")

        def run():
            many.forward()
            return a

        return Call(run, lambda x: np.array(x))

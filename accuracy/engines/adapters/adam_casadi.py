"""adam's CasADi implementation, as C that CasADi writes and gcc compiles for every mechanism anew. A robot on a
fixed base is the last nv rows and columns of one whose base floats, at rest and unmoved by gravity.
"""

import tempfile

import casadi
import numpy as np
from adam.casadi import KinDynComputations

from protocol import Base, Call, Coordinates, Engine, Mechanism, State, Unsupported, joint_order, rotation


class Adapter(Engine):
    name = "adam by CasADi"
    package = "adam-robotics"
    armature = False
    calls = {
        "mass": "mass_matrix",
        "inverse": "mass_matrix, casadi.inv",
        "acceleration": "mass_matrix, bias_force, casadi.solve",
        "inverse_dynamics": "mass_matrix times accelerations plus bias_force",
        "derivatives": "casadi.jacobian of the acceleration",
    }

    def __init__(self, mechanism: Mechanism, precision: str):
        moving = [joint for joint in mechanism.joints if joint.type != "free"]
        names, n = [joint.name for joint in moving], len(moving)
        if not n:
            raise Unsupported("a body without joints")
        gravity = np.array([*mechanism.gravity, 0, 0, 0])
        robot = KinDynComputations(str(mechanism.urdf), names, gravity=gravity)
        self.floats, self.q_of = mechanism.floats, [joint.q for joint in moving]
        first = 6 if self.floats else 0
        order = joint_order(
            mechanism, lambda it: 0 if it.type == "free" else first + names.index(it.name)
        )
        self.coordinates = Coordinates(mechanism, order, Base("world", "world"))
        self.H, self.q = casadi.SX.sym("H", 4, 4), casadi.SX.sym("q", n)
        self.v, self.x = (casadi.SX.sym(name, first + n) for name in "vx")  # x: torque or a
        still = casadi.vertcat(casadi.SX(6 - first, 1), self.v)
        self.M = robot.mass_matrix(self.H, self.q)[6 - first :, 6 - first :]
        self.bias = robot.bias_force(self.H, self.q, still[:6], still[6:])[6 - first :]
        self.built, self.folder = {}, tempfile.TemporaryDirectory()

    def compiled(self, task: str) -> casadi.Function:
        M, bias, x = self.M, self.bias, self.x
        out = {
            "mass": lambda: M,
            "inverse": lambda: casadi.inv(M),
            "acceleration": lambda: casadi.solve(M, x - bias),
            "inverse_dynamics": lambda: M @ x + bias,
            "derivatives": lambda: casadi.jacobian(
                casadi.solve(M, x - bias), casadi.vertcat(self.q, self.v, x)
            ),
        }[task]()
        built = {"compiler": "gcc", "flags": ["-O1"], "directory": f"{self.folder.name}/"}
        options = {"cse": True, "jit": True, "compiler": "shell", "jit_options": built}
        return casadi.Function(task, [self.H, self.q, self.v, x], [out], options)

    def call(self, task: str, state: State) -> Call:
        its, H = self.coordinates, np.eye(4)
        if self.floats:
            H[:3, :3], H[:3, 3] = rotation(state.q[3:7]), state.q[:3]
        x = its.acceleration(state) if task == "inverse_dynamics" else its.torque(state)
        f = self.built[task] = self.built.get(task) or self.compiled(task)
        given = H, state.q[self.q_of], its.velocity(state), x
        read = np.ravel if task in ("acceleration", "inverse_dynamics") else np.asarray
        return Call(lambda: f(*given), lambda out: its.read(task, state, read(out.full())))

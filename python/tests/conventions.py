"""Between Pinocchio's conventions and ours, for tests and for scripts/robot_files: states at random,
T of qd = T v with v Pinocchio's, and the parameters of links."""

import numpy as np
import pinocchio as pin

LINEAR_FIRST = [3, 4, 5, 0, 1, 2]  # Pinocchio's order of six rows


def pinocchio_states(model, count, seed):
    rng = np.random.default_rng(seed)
    low = np.maximum(model.lowerPositionLimit, -1.0)
    high = np.minimum(model.upperPositionLimit, 1.0)
    high = np.maximum(low, high)  # limits that are all beyond 1, or the wrong way round
    pin.seed(seed)
    q = np.array([pin.randomConfiguration(model, low, high) for _ in range(count)])
    v, tau = rng.standard_normal((2, count, model.nv))
    return q, v, tau


def turned(ours, q, nv):
    """T of qd = T v, v Pinocchio's."""
    return ours.qd(q, np.eye(nv)).T


def turning(model, T, v):
    """dT/dt: free and planar joints turn the axes of their linear velocities."""
    out = np.zeros_like(T)
    for joint in model.joints:
        at = joint.idx_v
        if joint.shortname() == "JointModelFreeFlyer":
            some, cross = slice(at, at + 3), pin.skew(v[at + 3 : at + 6])
        elif joint.shortname() == "JointModelPlanar":
            some, cross = slice(at, at + 2), v[at + 2] * np.array([[0.0, -1.0], [1.0, 0.0]])
        else:
            continue
        out[some, some] = T[some, some] @ cross
    return out


def of_links(model, robot, bodies):
    """The matrix that takes parameters of all joints, as Pinocchio has them, to those of links, by
    bodies that both know, of every joint one or more."""
    out = np.zeros((10 * robot.nv, 10 * (model.njoints - 1)))
    for name in bodies:
        body, ours = model.frames[model.getFrameId(name, pin.BODY)], robot.frames[name]
        if not body.parentJoint:
            continue
        joint = model.joints[body.parentJoint]
        assert ours.link == joint.idx_v + joint.nv - 1
        w, x, y, z = ours.rotation
        to_body = pin.SE3(pin.Quaternion(w, x, y, z).matrix(), np.array(ours.translation))
        X = (to_body * body.placement.inverse()).homogeneous
        for k, pi in enumerate(np.eye(10)):
            column = 10 * (body.parentJoint - 1) + k
            out[10 * ours.link : 10 * ours.link + 10, column] = moved_parameters(X, pi)
    return out


def moved_parameters(X, pi):
    """Ours in the axes to which X leads, by second moments, of Pinocchio's."""
    m, h, (xx, xy, yy, xz, yz, zz) = pi[0], pi[1:4], pi[4:]
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    second = np.trace(tensor) / 2 * np.eye(3) - tensor
    moved = X @ np.block([[second, h[:, None]], [h, m]]) @ X.T
    tensor = np.trace(moved[:3, :3]) * np.eye(3) - moved[:3, :3]
    return [moved[3, 3], *moved[:3, 3], *np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]

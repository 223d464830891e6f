"""The filter on a GPU, a thread a robot: H x = b with H = M + J'DJ, which MuJoCo Warp's Newton
solver factors, in float32 and without forming H. Takes MuJoCo Warp's own Model and Data.

A body is six rows of noise; a contact of it with the world is one more, whose weight is its d.
Forces are (moment; force) about the body's origin in world axes; p is from there to the contact:
  body k:      (c x e_i; e_i) of weight m,   (principal axis i; 0) of weight J_i             (1)
  a contact:   e = (p x f; f) of weight d;   (f; 0) where it resists torsion or rolling      (2)
P- = sum w a a' over the rows of body k and those that children left is never added up. It is kept
as U diag(d) U', U unit upper triangular, whose columns are six rows. To absorb a row (w, a), whose
entry is y, a pivot (D, g) is turned with it by Gentleman's rotation without square roots (1973):
  D* = D + w y^2,   g* = (D g + w y a) / D*,   w* = w D / D*,   a* = a - y g                 (3)
  compress:  the pivots are columns 5 ... 0 of U, y is the row's entry there                 (4)
  joint:     the pivot is (r, 0), y = H a of the six rows. It ends as D of (3.6) and g of
             (3.10), the six rows as those of P+                                             (5)
  tips to base:   e(k) = b(k) - H z-,   z+ = z- + g e                                        (6)
  base to tips:   x(k) = e(k) / D(k) - g' v-,   v+ = v- + H' x(k)                            (7)
phi of parallel frames adds p x f to a moment, and w x p to a velocity.

Why this covariance update (docs/contacts.md has the study): in float32 P - g U' loses d u of x,
reflections and rows beside P sqrt(d) u, rotations and weighted Gram-Schmidt nothing. Of these two
a rotation takes a row when it comes, so that a body is 42 numbers whatever touches it and however
many children it has: memory of one size for every thread, nothing sorted or chosen, no roots.
About 2200 flops a hinge with its body and 230 a contact row, counted by hand; weighted
Gram-Schmidt takes 1400 a link.
"""

import enum

import warp as wp
from mujoco import mjtConstraint, mjtJoint

FREE = wp.constant(int(mjtJoint.mjJNT_FREE))
BALL = wp.constant(int(mjtJoint.mjJNT_BALL))
SLIDE = wp.constant(int(mjtJoint.mjJNT_SLIDE))
HINGE = wp.constant(int(mjtJoint.mjJNT_HINGE))
FRICTION = wp.constant(int(mjtConstraint.mjCNSTR_FRICTION_DOF))
LIMIT = wp.constant(int(mjtConstraint.mjCNSTR_LIMIT_JOINT))
FRICTIONLESS = wp.constant(int(mjtConstraint.mjCNSTR_CONTACT_FRICTIONLESS))
PYRAMIDAL = wp.constant(int(mjtConstraint.mjCNSTR_CONTACT_PYRAMIDAL))
UNIT_ROUNDOFF = wp.constant(2.0**-24)
Friction = wp.types.vector(length=5, dtype=float)

wp.set_module_options({"enable_backward": False})


class Outcome(enum.IntEnum):
    """Of a robot. Its x is NaN unless it is solved."""

    SOLVED = 0
    SINGULAR = 1  # a D is no more than rounding can make of 0
    UNCOVERED = 2  # a row with weight couples two bodies that move, or more than one joint


SINGULAR = wp.constant(int(Outcome.SINGULAR))
UNCOVERED = wp.constant(int(Outcome.UNCOVERED))


@wp.struct
class Links:
    """Of all robots: (robots, bodies) and, of joints, (robots, nv)."""

    d: wp.array2d[wp.spatial_vector]
    U: wp.array2d[wp.spatial_matrix]  # a row is a column of U
    z: wp.array2d[wp.spatial_vector]
    v: wp.array2d[wp.spatial_vector]
    r: wp.array2d[float]
    H: wp.array2d[wp.spatial_vector]
    g: wp.array2d[wp.spatial_vector]
    nu: wp.array2d[float]  # e / D


@wp.func
def turn(D: float, g: wp.spatial_vector, w: float, a: wp.spatial_vector, y: float):
    """(3). What underflows has no weight."""
    share = w * y
    total = D + share * y
    if not share * y > 0.0:
        return D, g, w, a
    rest = D / total
    return total, rest * g + share / total * a, rest * w, a - y * g


@wp.func
def absorb(links: Links, robot: int, body: int, weight: float, row: wp.spatial_vector):
    """(4)."""
    d = links.d[robot, body]
    U = links.U[robot, body]
    w = weight
    a = row
    for i in range(6):
        j = 5 - i
        D, u, w, a = turn(d[j], U[j], w, a, a[j])
        u[j] = 1.0
        d[j] = D
        U[j] = u
    links.d[robot, body] = d
    links.U[robot, body] = U


@wp.func
def force(p: wp.vec3, f: wp.vec3):
    return wp.spatial_vector(wp.cross(p, f), f)


@wp.func
def force_to_parent(p: wp.vec3, a: wp.spatial_vector):
    f = wp.spatial_bottom(a)
    return wp.spatial_vector(wp.spatial_top(a) + wp.cross(p, f), f)


@wp.func
def motion_to_child(p: wp.vec3, v: wp.spatial_vector):
    w = wp.spatial_top(v)
    return wp.spatial_vector(w, wp.spatial_bottom(v) + wp.cross(w, p))


@wp.func
def contact_axis(i: int, p: wp.vec3, frame: wp.mat33):
    """(2): along the normal and two tangents, then about them."""
    if i < 3:
        return force(p, frame[i])
    return wp.spatial_vector(frame[i - 3], wp.vec3(0.0))


@wp.func
def contact_row(kind: int, i: int, p: wp.vec3, frame: wp.mat33, friction: Friction):
    """Row i of a contact. A pyramid's edges are the normal and a tangent, either way."""
    if kind != PYRAMIDAL:
        return contact_axis(i, p, frame)
    edge = friction[i // 2] * (1.0 - 2.0 * float(i % 2))
    return contact_axis(0, p, frame) + edge * contact_axis(i // 2 + 1, p, frame)


@wp.func
def joint_axis(kind: int, i: int, axis: wp.vec3, anchor: wp.vec3, turned: wp.mat33):
    """H of the i-th degree of freedom of a joint about a point; anchor is from there."""
    if kind == SLIDE:
        return wp.spatial_vector(wp.vec3(0.0), axis)
    if kind == HINGE:
        return wp.spatial_vector(axis, wp.cross(anchor, axis))
    if kind == FREE and i < 3:
        unit = wp.vec3(0.0)
        unit[i] = 1.0
        return wp.spatial_vector(wp.vec3(0.0), unit)
    about = wp.transpose(turned)[i % 3]
    return wp.spatial_vector(about, wp.cross(anchor, about))


@wp.kernel
def inertias(
    # Model
    body_mass: wp.array2d[float],
    body_inertia: wp.array2d[wp.vec3],
    body_dofadr: wp.array[int],
    body_dofnum: wp.array[int],
    dof_jntid: wp.array[int],
    dof_armature: wp.array2d[float],
    jnt_type: wp.array[int],
    jnt_dofadr: wp.array[int],
    # Data
    xpos: wp.array2d[wp.vec3],
    xmat: wp.array2d[wp.mat33],
    xipos: wp.array2d[wp.vec3],
    ximat: wp.array2d[wp.mat33],
    xanchor: wp.array2d[wp.vec3],
    xaxis: wp.array2d[wp.vec3],
    # out
    links: Links,
):
    """(1), H and r of a body, a thread each."""
    robot, body = wp.tid()
    o = xpos[robot, body]
    com = xipos[robot, body] - o
    principal = wp.transpose(ximat[robot, body])
    m = body_mass[robot % body_mass.shape[0], body]
    J = body_inertia[robot % body_inertia.shape[0], body]
    for i in range(3):
        unit = wp.vec3(0.0)
        unit[i] = 1.0
        absorb(links, robot, body, m, force(com, unit))
    for i in range(3):
        absorb(links, robot, body, J[i], wp.spatial_vector(principal[i], wp.vec3(0.0)))
    for k in range(body_dofadr[body], body_dofadr[body] + body_dofnum[body]):
        joint = dof_jntid[k]
        anchor = xanchor[robot, joint] - o
        links.r[robot, k] = dof_armature[robot % dof_armature.shape[0], k]
        links.H[robot, k] = joint_axis(
            jnt_type[joint], k - jnt_dofadr[joint], xaxis[robot, joint], anchor, xmat[robot, body]
        )


@wp.kernel
def constraints(
    # Model
    body_treeid: wp.array[int],
    geom_bodyid: wp.array[int],
    jnt_type: wp.array[int],
    jnt_dofadr: wp.array[int],
    # Data
    xpos: wp.array2d[wp.vec3],
    geom: wp.array[wp.vec2i],
    address: wp.array2d[int],
    pos: wp.array[wp.vec3],
    frame: wp.array[wp.mat33],
    friction: wp.array[Friction],
    nefc: wp.array[int],
    efc_type: wp.array2d[int],
    efc_id: wp.array2d[int],
    weight: wp.array2d[float],
    # out
    links: Links,
    outcome: wp.array[int],
):
    """(2) of a robot."""
    robot = wp.tid()
    for row in range(wp.min(nefc[robot], efc_id.shape[1])):
        w = weight[robot, row]
        kind = efc_type[robot, row]
        of = efc_id[robot, row]
        if w == 0.0:
            continue
        dof = int(-1)
        body = int(-1)
        if kind == FRICTION:
            dof = of
        if kind == LIMIT and jnt_type[of] >= SLIDE:
            dof = jnt_dofadr[of]
        if kind >= FRICTIONLESS and geom[of][0] >= 0 and geom[of][1] >= 0:
            one = geom_bodyid[geom[of][0]]
            other = geom_bodyid[geom[of][1]]
            if body_treeid[one] < 0:
                body = other
            if body_treeid[other] < 0:
                body = one
        if dof >= 0:
            links.r[robot, dof] += w
        elif body >= 0:
            i = row - address[of, 0]
            e = contact_row(kind, i, pos[of] - xpos[robot, body], frame[of], friction[of])
            absorb(links, robot, body, w, e)
        else:
            outcome[robot] = UNCOVERED


@wp.kernel
def sweep(
    # Model
    body_parentid: wp.array[int],
    body_dofadr: wp.array[int],
    body_dofnum: wp.array[int],
    # Data
    xpos: wp.array2d[wp.vec3],
    # in
    b: wp.array2d[float],
    # out
    links: Links,
    x: wp.array2d[float],
    outcome: wp.array[int],
):
    """(4) to (7) of a robot."""
    robot = wp.tid()
    bodies = body_parentid.shape[0]
    for i in range(1, bodies):
        body = bodies - i
        parent = body_parentid[body]
        d = links.d[robot, body]
        U = links.U[robot, body]
        z = links.z[robot, body]
        last = body_dofadr[body] + body_dofnum[body] - 1
        for j in range(body_dofnum[body]):
            k = last - j
            H = links.H[robot, k]
            D = links.r[robot, k]
            g = wp.spatial_vector()
            rounding = D
            for n in range(6):
                y = wp.dot(U[n], H)
                size = wp.dot(wp.abs(U[n]), wp.abs(H))
                rounding += d[n] * size * size
                D, g, w, a = turn(D, g, d[n], U[n], y)
                d[n] = w
                U[n] = a
            if not D > UNIT_ROUNDOFF * UNIT_ROUNDOFF * rounding:
                outcome[robot] = wp.max(outcome[robot], SINGULAR)
            e = b[robot, k] - wp.dot(H, z)
            z += e * g
            links.g[robot, k] = g
            links.nu[robot, k] = e / D
        if parent > 0:
            p = xpos[robot, body] - xpos[robot, parent]
            for n in range(6):
                absorb(links, robot, parent, d[n], force_to_parent(p, U[n]))
            links.z[robot, parent] += force_to_parent(p, z)

    for body in range(1, bodies):
        parent = body_parentid[body]
        v = motion_to_child(xpos[robot, body] - xpos[robot, parent], links.v[robot, parent])
        for k in range(body_dofadr[body], body_dofadr[body] + body_dofnum[body]):
            of_joint = links.nu[robot, k] - wp.dot(links.g[robot, k], v)
            v += of_joint * links.H[robot, k]
            x[robot, k] = of_joint
            if outcome[robot] != 0:
                x[robot, k] = wp.nan
        links.v[robot, body] = v


def solve(m, d, weight: wp.array, b: wp.array, x: wp.array) -> wp.array:
    """x = H^-1 b of all robots, after fwd_position; returns an Outcome each.

    weight: (nworld, njmax) or wider, D of the rows of d.efc that act, 0 of others, so that
    H = M + J' diag(weight) J. b, x: (nworld, nv). M holds no armature of tendons.
    """
    robots, bodies, nv = d.nworld, m.nbody, m.nv
    links = Links()
    links.d = wp.zeros((robots, bodies), dtype=wp.spatial_vector)
    links.U = wp.zeros((robots, bodies), dtype=wp.spatial_matrix)
    links.z = wp.zeros((robots, bodies), dtype=wp.spatial_vector)
    links.v = wp.zeros((robots, bodies), dtype=wp.spatial_vector)
    links.r = wp.empty((robots, nv), dtype=float)
    links.H = wp.empty((robots, nv), dtype=wp.spatial_vector)
    links.g = wp.empty((robots, nv), dtype=wp.spatial_vector)
    links.nu = wp.empty((robots, nv), dtype=float)
    outcome = wp.zeros(robots, dtype=int)

    joints = [m.dof_jntid, m.dof_armature, m.jnt_type, m.jnt_dofadr]
    of_bodies = [m.body_mass, m.body_inertia, m.body_dofadr, m.body_dofnum]
    poses = [d.xpos, d.xmat, d.xipos, d.ximat, d.xanchor, d.xaxis]
    wp.launch(inertias, (robots, bodies), inputs=[*of_bodies, *joints, *poses, links])
    touching = [m.body_treeid, m.geom_bodyid, m.jnt_type, m.jnt_dofadr, d.xpos]
    contacts = [getattr(d.contact, f) for f in ("geom", "efc_address", "pos", "frame", "friction")]
    rows = [d.nefc, d.efc.type, d.efc.id, weight]
    wp.launch(constraints, robots, inputs=[*touching, *contacts, *rows, links, outcome])
    tree = [m.body_parentid, m.body_dofadr, m.body_dofnum, d.xpos]
    wp.launch(sweep, robots, inputs=[*tree, b, links, x, outcome])
    return outcome

// Positions q that hold quaternions: moved by a displacement, the displacement between two, the
// Jacobians of both, the zero position and random ones.
//
// A displacement v (nv) has an entry for each DoF [rad or m], in the axes of the DoF's velocity: h
// qd is one. q [+] v is q moved by v, and q1 [-] q0 is the v for which q0 [+] v = q1. For hinges,
// slides and the positions of free joints, which add along the axes of their linear velocity,
//   q [+] v = q + v,  q1 [-] q0 = q1 - q0                                                (1)
// and for quaternions q = (w, x), normalised as they are read, with t = |v|, n = v / t,
//   q [+] v = q exp(v / 2),  exp(v / 2) = (cos(t/2), sin(t/2) n),  normalised            (2)
//   q1 [-] q0 = 2 atan2(|y|, |c|) sign(c) y / |y|                                        (3)
//   c = w0 w1 + x0'x1,  y = w0 x1 - w1 x0 - x0~ x1    scalar and vector part of q0* q1
// (3) is the shorter turn, |v| <= pi: q and -q are the same rotation.
//
// Jacobians are in displacements on both sides: column j of dF/dq is for q [+] v with v along DoF
// j, and row i is the displacement of F along DoF i. Where (1) holds they are 1, by q0 -1, on the
// diagonal; the blocks of quaternions are
//   d(q [+] v)/dq = exp(-t n~) = I - sin(t) n~ + (1 - cos(t)) n~^2                       (4)
//   d(q [+] v)/dv = J(v) = I - (1 - cos(t))/t n~ + (1 - sin(t)/t) n~^2                   (5)
//   d(q1 [-] q0)/dq1 = J^-1(v) = I + t/2 n~ + (1 - (t/2) cot(t/2)) n~^2,  v = q1 [-] q0  (6)
//   d(q1 [-] q0)/dq0 = -J^-1(v)'                                                         (7)
// J is the right Jacobian of SO(3): J. Sola, J. Deray, D. Atchuthan, A micro Lie theory for state
// estimation in robotics, 2018, appendix B. Since n has unit length, every coefficient is accurate
// to a few roundoffs of 1 at small t too, and no series is needed.
//
// The model is one that Dynamics takes. Sizes are checked: std::invalid_argument names the call
// and both sizes. What is not finite passes into the entries of its own joint alone, as NaN or
// infinity; so does, as NaN, a quaternion that is no turn: of no length, or so long or short that
// its square overflows or is subnormal. Quaternions are computed in double. No call takes memory,
// and calls may run on any number of threads. Of rows of states, row i of each argument is of
// state i, and each result is to the bit what the call of one state gives.
#pragma once

#include <cstddef>
#include <random>

#include "kalmarm/export.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// q_next (nq) = q [+] v; q_next may be q, and else lies apart from q and v. (1) and (2): a flop a
// hinge, 65 and a sine and a cosine a quaternion.
KALMARM_EXPORT void integrate(const RobotModel& model, VectorView<const double> q,
                              VectorView<const double> v, VectorView<double> q_next);
KALMARM_EXPORT void integrate(const RobotModel& model, VectorView<const float> q,
                              VectorView<const float> v, VectorView<float> q_next);
KALMARM_EXPORT void integrate(const RobotModel& model, std::ptrdiff_t rows,
                              RowsView<const double> q, RowsView<const double> v,
                              RowsView<double> q_next);
KALMARM_EXPORT void integrate(const RobotModel& model, std::ptrdiff_t rows, RowsView<const float> q,
                              RowsView<const float> v, RowsView<float> q_next);

// v (nv) = q1 [-] q0. (1) and (3): a flop a hinge, 70 and an arc tangent a quaternion.
KALMARM_EXPORT void difference(const RobotModel& model, VectorView<const double> q0,
                               VectorView<const double> q1, VectorView<double> v);
KALMARM_EXPORT void difference(const RobotModel& model, VectorView<const float> q0,
                               VectorView<const float> q1, VectorView<float> v);
KALMARM_EXPORT void difference(const RobotModel& model, std::ptrdiff_t rows,
                               RowsView<const double> q0, RowsView<const double> q1,
                               RowsView<double> v);
KALMARM_EXPORT void difference(const RobotModel& model, std::ptrdiff_t rows,
                               RowsView<const float> q0, RowsView<const float> q1,
                               RowsView<float> v);

// q (nq) = 0, and quaternions (1, 0, 0, 0). A hinge or slide is at its placement where q is its
// LinkParameters::reference: where a file has references other than zero, its home (MuJoCo's
// qpos0, LoadedRobot::home) is another position.
KALMARM_EXPORT void neutral(const RobotModel& model, VectorView<double> q);
KALMARM_EXPORT void neutral(const RobotModel& model, VectorView<float> q);

// q (nq), random: uniform from lower to upper (nq each) for hinges, slides and positions, and
// uniform over all rotations for quaternions, whose bounds are not read. The numbers depend on the
// generator's state, not on the compiler. std::invalid_argument with the DoF where a bound is not
// finite or lower > upper, before anything is drawn.
KALMARM_EXPORT void random(const RobotModel& model, VectorView<const double> lower,
                           VectorView<const double> upper, std::mt19937_64& generator,
                           VectorView<double> q);
KALMARM_EXPORT void random(const RobotModel& model, VectorView<const float> lower,
                           VectorView<const float> upper, std::mt19937_64& generator,
                           VectorView<float> q);

// Rows of states within the same bounds, drawn one after another.
KALMARM_EXPORT void random(const RobotModel& model, std::ptrdiff_t rows,
                           VectorView<const double> lower, VectorView<const double> upper,
                           std::mt19937_64& generator, RowsView<double> q);
KALMARM_EXPORT void random(const RobotModel& model, std::ptrdiff_t rows,
                           VectorView<const float> lower, VectorView<const float> upper,
                           std::mt19937_64& generator, RowsView<float> q);

// dq = d(q [+] v)/dq and dv = d(q [+] v)/dv, each nv x nv, column-major, block diagonal, by (4)
// and (5), which do not depend on q. nv^2 stores each, and 170 flops a quaternion.
KALMARM_EXPORT void integrate_jacobians(const RobotModel& model, VectorView<const double> q,
                                        VectorView<const double> v, MatrixView<double> dq,
                                        MatrixView<double> dv);
KALMARM_EXPORT void integrate_jacobians(const RobotModel& model, VectorView<const float> q,
                                        VectorView<const float> v, MatrixView<float> dq,
                                        MatrixView<float> dv);

// Rows of states: a row of dq and dv has the columns of one state's matrix after each other.
KALMARM_EXPORT void integrate_jacobians(const RobotModel& model, std::ptrdiff_t rows,
                                        RowsView<const double> q, RowsView<const double> v,
                                        RowsView<double> dq, RowsView<double> dv);
KALMARM_EXPORT void integrate_jacobians(const RobotModel& model, std::ptrdiff_t rows,
                                        RowsView<const float> q, RowsView<const float> v,
                                        RowsView<float> dq, RowsView<float> dv);

// d0 = d(q1 [-] q0)/dq0 and d1 = d(q1 [-] q0)/dq1, in the same form, by (7) and (6). At a turn of
// pi, where the shorter turn changes sides, they are those of the side that `difference` takes.
KALMARM_EXPORT void difference_jacobians(const RobotModel& model, VectorView<const double> q0,
                                         VectorView<const double> q1, MatrixView<double> d0,
                                         MatrixView<double> d1);
KALMARM_EXPORT void difference_jacobians(const RobotModel& model, VectorView<const float> q0,
                                         VectorView<const float> q1, MatrixView<float> d0,
                                         MatrixView<float> d1);
KALMARM_EXPORT void difference_jacobians(const RobotModel& model, std::ptrdiff_t rows,
                                         RowsView<const double> q0, RowsView<const double> q1,
                                         RowsView<double> d0, RowsView<double> d1);
KALMARM_EXPORT void difference_jacobians(const RobotModel& model, std::ptrdiff_t rows,
                                         RowsView<const float> q0, RowsView<const float> q1,
                                         RowsView<float> d0, RowsView<float> d1);

}  // namespace kalmarm

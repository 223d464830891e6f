// Measured motion of a robot: what a fit of its parameters starts from, as CSV.
//
// The first line names the columns, in any order; columns whose names begin otherwise are passed
// over:
//   time          [s], increasing from line to line; the steps need not be equal
//   q:NAME        positions [rad or m]; NAME is a joint, of a ball joint BALL:qw BALL:qx BALL:qy
//                 BALL:qz, of a free joint FREE:x FREE:y FREE:z FREE:r:qw .. FREE:r:qz
//   qd:DOF        velocities [rad/s or m/s]; DOF is a joint, of a ball joint BALL:x BALL:y BALL:z,
//                 of a free joint FREE:x FREE:y FREE:z FREE:r:x FREE:r:y FREE:r:z
//   qdd:DOF       accelerations; all of them or none
//   tau:DOF       torques or forces of the joints [N m or N]
// in MuJoCo's conventions. Velocities may be missing too, all of them and all accelerations:
// differentiate.hpp makes what is missing.
#pragma once

#include <string>
#include <vector>

#include "robots/scene/scene.hpp"

namespace kalmarm {

inline constexpr const char* samples_help =
    "CSV with a header: time, q:JOINT, qd:JOINT, qdd:JOINT, tau:JOINT, in any order; qdd, or qd "
    "and "
    "qdd, may be missing, of all joints, and are then derivatives of the others; a ball joint has "
    "q:JOINT:qw :qx :qy :qz and qd:JOINT:x :y :z, a free joint q:JOINT:x :y :z "
    ":r:qw :r:qx :r:qy :r:qz and qd:JOINT:x :y :z :r:x :r:y :r:z; other columns are passed over";

struct Samples {
  VectorX<double> time;             // [s], increasing
  MatrixX<double> q, qd, qdd, tau;  // nq, nv, nv, nv x count, a sample a column; qdd may be empty,
                                    // or qd and qdd
  MatrixX<double> mass;             // lower triangles of M, row by row; simulated samples alone
  int normalized = 0;               // quaternions that did not have unit length and were normalised

  int count() const { return static_cast<int>(time.size()); }
  bool has_velocities() const { return qd.size() > 0; }
  bool has_accelerations() const { return qdd.size() > 0; }
  State state(int i) const { return {q.col(i), qd.col(i), tau.col(i)}; }
};

// `count` samples from `first` on, and every `stride`-th sample.
Samples part(const Samples& samples, int first, int count);
Samples every(const Samples& samples, int stride);

// Names of the entries of q, as columns have them after "q:" (nq of them).
std::vector<std::string> position_names(const Model<double>& model);

// Throws InputError in one line with file, line and column: no file, a column that is missing
// (with the nearest name), doubled or of a joint that the robot does not have, a line with too many
// or too few fields, what is no finite number, time that does not increase, a quaternion of length
// zero, fewer than two samples. Decimal numbers are read exactly.
Samples read_samples(const Scene& scene, const std::string& path);

// The CSV that read_samples reads back to the bit.
std::string to_csv(const Scene& scene, const Samples& samples);

}  // namespace kalmarm

// Numbers and names as the writers of robots' files put them: 17 digits, so that what is read back is
// the same to the bit.
#pragma once

#include <string>

#include "algorithms/model/model.hpp"
#include "algorithms/model/short_text.hpp"

namespace kalmarm {

inline std::string text_of(double value) { return short_text("%.17g", value); }

inline std::string text_of(const Vector3<double>& v) {
  return text_of(v[0]) + ' ' + text_of(v[1]) + ' ' + text_of(v[2]);
}

inline std::string text_of(const Eigen::Quaternion<double>& q) {
  return text_of(q.w()) + ' ' + text_of(Vector3<double>(q.vec()));
}

// Of the joint that has DoF k: "ball" of "ball:x".
inline std::string joint_name(const Model<double>& model, int k) {
  return model.name(k).substr(0, model.name(k).find(':'));
}

}  // namespace kalmarm

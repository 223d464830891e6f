// check_paper for any T; instantiated once for each in equations_*.cpp.
#pragma once

#include "accuracy/paper/beyond.hpp"
#include "accuracy/paper/equations.hpp"
#include "accuracy/paper/section_1.hpp"
#include "accuracy/paper/section_2.hpp"
#include "accuracy/paper/section_3.hpp"
#include "accuracy/paper/section_4.hpp"
#include "accuracy/paper/section_5.hpp"
#include "accuracy/paper/section_6.hpp"

namespace kalmarm {

template <class T>
Soundness soundness(const Model<double>& model, const State& state) {
  const Model<T> in_T = model.cast<T>();
  LinkKinematics<T> kin(in_T);
  set_position(in_T, VectorX<T>(state.q.cast<T>()), kin);
  set_velocity(in_T, VectorX<T>(state.qd.cast<T>()), kin);
  const Process<T> process(in_T, kin);
  Soundness out{find_flaw(process), {}};
  if (out.flaw) return out;
  Covariances<T> cov(process);
  out.outcome = set_state_covariances(process, cov);
  return out;
}

template <class T>
std::vector<Row> check_paper(const Model<double>& paper, const State& at,
                             const Model<double>& other, const State& other_at) {
  const auto setting = [](const Model<double>& model, const State& state) {
    return Setting<T>(model.cast<T>(), state.q.cast<T>(), state.qd.cast<T>(), state.tau.cast<T>());
  };
  Rows rows;
  {
    const Setting<T> s = setting(paper, at);
    section_1(s, rows);
    section_2(s, rows);
    section_3(s, rows);
    section_4(s, rows);
    section_5(s, rows);
    section_6(s, rows);
  }
  beyond(setting(other, other_at), rows);
  return rows.all();
}

}  // namespace kalmarm

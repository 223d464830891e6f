// The library's way with contacts beside the study's: H^-1 b by Dynamics, whose rungs are said in
// fast/covariance/contacts.hpp.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/contacts/contact_row.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

template <class T>
class StandingLadder {
 public:
  // Links of contacts are the last of their joints.
  StandingLadder(const Model<double>& model, const std::vector<ContactRow<T>>& contacts,
                 double tolerance)
      : dynamics_(plain(model), {.tolerance = tolerance, .question = question(contacts)}) {
    for (const ContactRow<T>& row : contacts) {
      const Vector6<T> w = std::sqrt(row.d) * row.e;
      w_.insert(w_.end(), w.data(), w.data() + 6);
    }
  }

  static std::string name(double tolerance) {
    return tolerance == last_bits ? "Ladder<last_bits>" : "Ladder<default>";
  }

  // x = H^-1 b at q, one state.
  Outcome operator()(const VectorX<T>& q, const VectorX<T>& b, VectorX<T>& x) {
    return solved(dynamics_.factor(q, {VectorView<const T>(w_), Axes::local}), b, x);
  }
  // The same of M, without contacts.
  Outcome without_contacts(const VectorX<T>& q, const VectorX<T>& b, VectorX<T>& x) {
    return solved(dynamics_.factor(q), b, x);
  }

  Dynamics<T>& dynamics() { return dynamics_; }
  const std::vector<T>& rows() const { return w_; }  // w of every contact

 private:
  static Question question(const std::vector<ContactRow<T>>& contacts) {
    Question out;
    out.want = {Want::solve};
    for (const ContactRow<T>& row : contacts) out.contacts.push_back({row.link});
    return out;
  }

  Outcome solved(const Outcome& factored, const VectorX<T>& b, VectorX<T>& x) {
    return factored ? dynamics_.solve(b, x) : factored;
  }

  Dynamics<T> dynamics_;
  std::vector<T> w_;
};

}  // namespace kalmarm

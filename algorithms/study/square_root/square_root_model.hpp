// A model lowered for the square-root form (square_root.hpp): the fast path's frames, and every body
// as weighted rows in its own.
#pragma once

#include <vector>

#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/study/square_root/factored_body.hpp"

namespace kalmarm {

template <class S>
class SquareRootModel : public LoweredModel<S> {
 public:
  explicit SquareRootModel(const Model<S>& model) : LoweredModel<S>(model), factored_(model.nv()) {
    using std::sqrt;
    using W = Wider<S>;
    for (int k = 0; k < model.nv(); ++k) {
      const RigidBody<W> body = model.template cast<W>().joint(k).body;
      const Transform<W> principal = this->phi_on_link(k, {rotation(body.axes), body.com});
      factor_body(body.mass, principal.p, principal.R, body.moments, factored_[k]);
      factored_[k].length = sqrt(this->body(k).reach / S(this->link(k).slides ? 4 : 2));
    }
    for (int k = model.nv() - 1; k >= 0; --k) {
      if (model.parent(k) < 0) continue;
      FactoredBody<S>& parent = factored_[model.parent(k)];
      parent.outboard_mass += factored_[k].outboard_mass;
      parent.outboard_spin += factored_[k].outboard_spin;
      factored_[k].light_parent = parent.is_light_beside(factored_[k]);
    }
  }

  const FactoredBody<S>& factored(int k) const { return factored_[k]; }

 private:
  std::vector<FactoredBody<S>> factored_;
};

}  // namespace kalmarm

#include "accuracy/contenders/asked_step.hpp"

#include <string>

#include "algorithms/model/short_text.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

VectorX<double> held(const VectorX<double>& x) { return x.cast<float>().cast<double>(); }

VectorX<double> vector_of(const std::vector<double>& x) {
  return Eigen::Map<const VectorX<double>>(x.data(), static_cast<int>(x.size()));
}

}  // namespace

AskedStep::AskedStep(const Scene& scene, Integrator integrator, double h, const JointTerms& joints)
    : integrator_(integrator),
      h_(h),
      terms_(scene, integrator, joints),
      damping_(vector_of(terms_.terms().damping)),
      stiffness_(vector_of(terms_.terms().stiffness)),
      reference_(vector_of(terms_.terms().reference)) {
  for (int k = 0; k < scene.model.nv(); ++k) {
    const Joint<double>& joint = scene.model.joint(k);
    q_of_.push_back(joint.q_index);
    coordinates_.push_back(joint.coordinate);
    const auto refuse_negative = [&](const char* what, double x) {
      if (!(x >= 0 && std::isfinite(x)))
        throw InputError(scene.name + ": joint '" + scene.model.name(k) + "': " + what + " " +
                         short_text("%g", x));
    };
    refuse_negative("damping", damping_[k]);
    refuse_negative("stiffness", stiffness_[k]);
    if (!std::isfinite(reference_[k]))
      throw InputError(scene.name + ": joint '" + scene.model.name(k) +
                       "': its spring's reference is not finite");
  }
  const bool at_end = terms_.scheme() == Scheme::springs_at_end;
  noise_ = h * (damping_ + (at_end ? h : 0) * stiffness_);
  rows_ = AskedRows(q_of_, terms_.terms().rows, h, at_end ? h : 0);
}

Model<double> AskedStep::model(Model<double> given) const {
  for (int k = 0; k < given.nv(); ++k) given.set_noise(k, given.joint(k).r + noise_[k]);
  return given;
}

AskedStep AskedStep::rounded() const {
  AskedStep out = *this;
  out.terms_ = terms_.rounded();
  for (VectorX<double>* term : {&out.damping_, &out.stiffness_, &out.reference_})
    *term = held(*term);
  out.h_ = static_cast<float>(h_);
  const bool at_end = terms_.scheme() == Scheme::springs_at_end;
  out.rows_ = AskedRows(q_of_, out.terms_.terms().rows, out.h_, at_end ? out.h_ : 0);
  return out;
}

}  // namespace kalmarm

#include "robots/loader/actuators.hpp"

#include <algorithm>
#include <cmath>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"
#include "robots/loader/tendons.hpp"

namespace kalmarm {
namespace {

// DoF of the joint that an actuator of a compiled model drives; -1 where that is a tendon.
int driven_dof(const mjModel* m, int i) {
  return drives_joint(m->actuator_trntype[i]) ? m->jnt_dofadr[m->actuator_trnid[2 * i]] : -1;
}

// Of a compiled model.
struct Law {
  double torque, constant, stiffness, damping;  // G g0, G b0, k, b
  double stiffness_by_u, damping_by_u;
};
Law law_of(const mjModel* m, int i, double u) {
  const mjtNum *gain = m->actuator_gainprm + static_cast<std::ptrdiff_t>(i) * mjNGAIN,
               *bias = m->actuator_biasprm + static_cast<std::ptrdiff_t>(i) * mjNBIAS;
  const double G = m->actuator_gear[6 * i];
  const bool affine = m->actuator_gaintype[i] == mjGAIN_AFFINE,
             biased = m->actuator_biastype[i] == mjBIAS_AFFINE;
  const auto sloped = [&](int p) {  // as 0 rather than -0
    return 0 - G * G * ((affine ? gain[p] * u : 0) + (biased ? bias[p] : 0));
  };
  return {G * gain[0], biased ? G * bias[0] : 0,         sloped(1),
          sloped(2),   affine ? 0 - G * G * gain[1] : 0, affine ? 0 - G * G * gain[2] : 0};
}

// Of the actuators of one joint or tendon: their stiffness and what they pull with at length zero.
struct Spring {
  double stiffness = 0, pull = 0;

  // (2)
  void add_to(double& k, double& reference) const {
    if (stiffness == 0) return;
    const double K = k + stiffness;
    reference = (k > 0 ? k * reference + pull : pull) / K;
    k = K;
  }
};

std::array<double, 2> range_of(bool is_limited, const mjtNum* ranges, std::ptrdiff_t i) {
  if (!is_limited) return {-Actuator::limitless, Actuator::limitless};
  return {ranges[2 * i], ranges[2 * i + 1]};
}

std::array<double, 2> control_range(const mjModel* m, int i) {
  const int at = control_address(m, i);
  const bool clamps = (m->opt.disableflags & mjDSBL_CLAMPCTRL) == 0;
  return range_of(clamps && m->actuator_ctrllimited[at], m->actuator_ctrlrange, at);
}

// Of the joint, which feels G times the actuator's force.
std::array<double, 2> force_range(const mjModel* m, int i) {
  auto [low, high] = range_of(m->actuator_forcelimited[i], m->actuator_forcerange, i);
  const double G = m->actuator_gear[6 * i];
  return {std::min(G * low, G * high), std::max(G * low, G * high)};
}

// A control within its limits.
double limited(const mjModel* m, int i, double value) {
  const auto [low, high] = control_range(m, i);
  return std::clamp(value, low, high);
}

bool is_muted(const Law& law) {
  return law.torque == 0 && law.constant == 0 && law.stiffness == 0 && law.damping == 0;
}

std::string name_of_actuator(const mjModel* m, int i) {
  const char* name = mj_id2name(m, mjOBJ_ACTUATOR, i);
  return name ? name : "";
}

}  // namespace

void mute(mjsActuator* a) {
  a->gaintype = mjGAIN_FIXED;
  a->biastype = mjBIAS_NONE;
  a->dyntype = mjDYN_NONE;
  std::fill_n(a->gainprm, mjNGAIN, 0.0);
  std::fill_n(a->biasprm, mjNBIAS, 0.0);
  a->actdim = -1;  // as the compiler finds it
  a->actlimited = a->ctrllimited = a->forcelimited = mjLIMITED_FALSE;
  a->inheritrange = 0;
  a->actearly = 0;
  a->nsample = 0;
  a->delay = 0;
  a->plugin.active = 0;
  clear_signature(*a);
}

void mute(mjModel* m, int i) {
  m->actuator_gaintype[i] = mjGAIN_FIXED;
  m->actuator_biastype[i] = mjBIAS_NONE;
  std::fill_n(m->actuator_gainprm + static_cast<std::ptrdiff_t>(i) * mjNGAIN, mjNGAIN, 0.0);
}

std::vector<Control> controls_of(mjSpec* spec, const LoadOptions& options) {
  const std::vector<mjsElement*> all = elements(spec, mjOBJ_ACTUATOR);
  const std::vector<ActuatorPart> parts = actuator_parts(spec);
  const double* keyed = nullptr;
  int count = 0;
  for (mjsElement* e : elements(spec, mjOBJ_KEY))
    if (!options.key.empty() && name_of(e) == options.key)
      keyed = mjs_getDouble(mjs_asKey(e)->ctrl, &count);
  // Some actuators have several controls: then a keyframe has more of them than there are actuators.
  if (count != static_cast<int>(all.size())) keyed = nullptr;

  std::vector<Control> out;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string name = parts[i].name, why = parts[i].left_out();
    const auto given = options.controls.find(name);
    const bool is_given = !name.empty() && given != options.controls.end();
    if (!name.empty()) names.push_back(name);
    if (is_given && !why.empty())
      throw InputError("controls: '" + name + "' is an " + why + ", which is left out");
    if (!why.empty()) continue;
    out.push_back({all[i], is_given ? given->second : keyed ? keyed[i] : 0});
    if (!std::isfinite(out.back().value))
      throw InputError("the control of actuator '" + name + "' is not finite");
  }
  for (const auto& [name, value] : options.controls)
    if (std::ranges::find(names, name) == names.end())
      throw InputError(unknown_name("controls: actuator", name, names));
  return out;
}

VectorX<double> limited_controls(const mjModel* m, const std::vector<Control>& controls) {
  VectorX<double> out = VectorX<double>::Zero(actuator_count(m));
  for (const auto& [actuator, value] : controls)
    out[mjs_getId(actuator)] = limited(m, mjs_getId(actuator), value);
  return out;
}

VectorX<double> limited_controls(const mjModel* m, const std::vector<ActuatorPart>& actuators,
                                 const VectorX<double>& ctrl) {
  VectorX<double> out = VectorX<double>::Zero(actuator_count(m));
  for (int i = 0; i < actuator_count(m); ++i)
    if (actuators[i].left_out().empty()) out[i] = limited(m, i, ctrl[control_address(m, i)]);
  return out;
}

std::vector<DampingRatio> damping_ratios(mjSpec* spec) {
  std::vector<DampingRatio> out;
  for (mjsElement* e : elements(spec, mjOBJ_ACTUATOR)) {
    const mjsActuator* a = mjs_asActuator(e);
    const double kp = a->gainprm[0], ratio = a->biasprm[2];
    if (a->gaintype == mjGAIN_FIXED && a->biastype == mjBIAS_AFFINE && kp == -a->biasprm[1] &&
        kp > 0 && ratio > 0)
      out.push_back({e, ratio});
  }
  return out;
}

void set_dampers(const std::vector<DampingRatio>& ratios, const VectorX<double>& M0, mjModel* m) {
  for (const auto& [actuator, ratio] : ratios) {
    const int i = mjs_getId(actuator), dof = driven_dof(m, i);
    if (dof < 0) continue;  // along a tendon MuJoCo's own
    const double kp = m->actuator_gainprm[static_cast<std::ptrdiff_t>(i) * mjNGAIN],
                 G = m->actuator_gear[6 * i];
    m->actuator_biasprm[static_cast<std::ptrdiff_t>(i) * mjNBIAS + 2] =
        -2 * ratio * std::sqrt(kp * M0[dof]) / std::abs(G);
  }
}

int mute_destabilising(mjModel* m, const VectorX<double>& controls) {
  int muted = 0;
  for (int i = 0; i < actuator_count(m); ++i) {
    const Law law = law_of(m, i, controls[i]);
    if (!(law.stiffness < 0 || law.damping < 0)) continue;
    mute(m, i);
    ++muted;
  }
  return muted;
}

std::vector<Actuator> actuators_of(const mjModel* m, const VectorX<double>& controls) {
  std::vector<Actuator> out;
  const std::vector<int> rows = rows_of_tendons(m);
  for (int i = 0; i < actuator_count(m); ++i) {
    const double u = controls[i];
    const Law law = law_of(m, i, u);
    if (is_muted(law)) continue;
    const double sum = law.torque * u + law.constant + law.stiffness + law.damping;
    if (!std::isfinite(sum))
      throw InputError("actuator '" + name_of_actuator(m, i) + "': a number is not finite");
    out.push_back(
        {.name = name_of_actuator(m, i),
         .dof = driven_dof(m, i),
         .row = m->actuator_trntype[i] == mjTRN_TENDON ? rows[m->actuator_trnid[2 * i]] : -1,
         .control = u,
         .gain = law.torque,
         .constant = law.constant,
         .stiffness = law.stiffness,
         .damping = law.damping,
         .stiffness_by_control = law.stiffness_by_u,
         .damping_by_control = law.damping_by_u,
         .control_range = control_range(m, i),
         .force_range = force_range(m, i)});
  }
  return out;
}

std::vector<std::array<double, 2>> force_ranges(const mjModel* m) {
  std::vector<std::array<double, 2>> out(m->nv, {-Actuator::limitless, Actuator::limitless});
  for (int j = 0; j < m->njnt; ++j)
    if (has_one_axis(m->jnt_type[j]))
      out[m->jnt_dofadr[j]] = range_of(m->jnt_actfrclimited[j], m->jnt_actfrcrange, j);
  return out;
}

JointTerms joint_terms(const mjModel* m) {
  const bool damps = (m->opt.disableflags & mjDSBL_DAMPER) == 0,
             springs = (m->opt.disableflags & mjDSBL_SPRING) == 0;
  JointTerms out;
  out.damping.assign(m->nv, 0);
  out.stiffness.assign(m->nv, 0);
  out.reference.assign(m->nv, 0);
  if (damps) std::copy_n(m->dof_damping, m->nv, out.damping.begin());
  for (int i = 0; damps && i < actuator_count(m); ++i) {
    const double G = m->actuator_gear[6 * i];
    if (const int dof = driven_dof(m, i); dof >= 0)
      out.damping[dof] += G * G * m->actuator_damping[i];
  }
  for (int j = 0; springs && j < m->njnt; ++j) {
    if (!has_one_axis(m->jnt_type[j])) continue;
    out.stiffness[m->jnt_dofadr[j]] = m->jnt_stiffness[j];
    out.reference[m->jnt_dofadr[j]] = m->qpos_spring[m->jnt_qposadr[j]];
  }
  out.rows = tendon_rows(m);
  return out;
}

Driven driven(JointTerms joints, const std::vector<Actuator>& actuators) {
  Driven out{std::move(joints), {}};
  JointTerms& terms = out.terms;
  const std::size_t nv = terms.damping.size();
  out.torque.assign(nv, 0);
  std::vector<Spring> of_dof(nv), of_row(terms.rows.size());
  for (const Actuator& a : actuators) {
    const double force = a.gain * a.control + a.constant;
    Spring& spring = a.row < 0 ? of_dof[a.dof] : of_row[a.row];
    (a.row < 0 ? terms.damping[a.dof] : terms.rows[a.row].damping) += a.damping;
    spring.stiffness += a.stiffness;
    if (a.stiffness > 0)
      spring.pull += force;
    else if (a.row < 0)
      out.torque[a.dof] += force;
    else
      for (std::size_t k = 0; k < nv; ++k) out.torque[k] += terms.rows[a.row].jacobian[k] * force;
  }
  for (std::size_t k = 0; k < nv; ++k) of_dof[k].add_to(terms.stiffness[k], terms.reference[k]);
  for (std::size_t i = 0; i < of_row.size(); ++i)
    of_row[i].add_to(terms.rows[i].stiffness, terms.rows[i].reference);
  return out;
}

}  // namespace kalmarm

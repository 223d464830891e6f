#include "robots/loader/files/given_inertia.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "algorithms/spatial/principal_axes.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/mujoco_strip.hpp"

namespace kalmarm {
namespace {

using Vec3 = Vector3<double>;

constexpr double thinnest = 1e-4;   // least of a balanced body's second moments over the largest
constexpr double least = 1e-14;     // moment of inertia that MuJoCo takes [kg m^2]
constexpr double rounding = 1e-12;  // of a tensor that is singular as written, over its largest
constexpr double digits = 1e-6;     // of a tensor as exporters write it, over its largest

// A + B - C over C of moments A <= B <= C: not negative of solid bodies, zero of flat ones.
double thickness(Vec3 moments) {
  std::sort(moments.begin(), moments.end());
  return moments[2] > 0 ? (moments[0] + moments[1] - moments[2]) / moments[2] : 0;
}

bool is_solid(const Vec3& moments) { return thickness(moments) >= -digits; }

bool is_full(const mjsBody* body) { return !std::isnan(body->fullinertia[0]); }

// About the axes of the inertial frame, unless the whole tensor is given.
RigidBody<double> principal(const mjsBody* body) {
  const double* I = body->fullinertia;  // xx, yy, zz, xy, xz, yz
  if (!is_full(body)) return {.mass = body->mass, .moments = Eigen::Map<const Vec3>(body->inertia)};
  if (Eigen::Map<const Vec3>(I + 3).isZero(0))  // exact: a zero stays one
    return {.mass = body->mass, .moments = Eigen::Map<const Vec3>(I)};
  Matrix3<double> tensor;
  tensor << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return with_principal_axes<double>(body->mass, Vec3::Zero(), tensor);
}

// The body that a file describes by a mass, a tensor, an inertial frame or none of them, in that frame and
// with the bounds and the balance that the file asks for; none where geoms describe it. Where there is no
// mass a negative moment is zero.
std::optional<RigidBody<double>> given_body(const mjSpec* spec, mjsBody* body) {
  if (inertia_from_geoms(spec, body)) return std::nullopt;
  RigidBody<double> out;
  if (body->explicitinertial) out = principal(body);
  const double zero = std::max(least, rounding * out.moments.maxCoeff());
  if (out.moments.minCoeff() > -zero) out.moments = out.moments.cwiseMax(0);
  if (!(out.mass > 0)) out.moments = out.moments.cwiseMax(0);
  const double least_mass = spec->compiler.boundmass, least_moment = spec->compiler.boundinertia;
  if (least_mass > 0) out.mass = std::max(out.mass, least_mass);
  // MuJoCo leaves out what is to be fused and has no mass.
  const bool is_left_out = out.mass == 0 && !has_joint(body) && spec->compiler.fusestatic;
  if (least_moment > 0 && !is_left_out) out.moments = out.moments.cwiseMax(least_moment);
  if (!out.moments.allFinite()) return out;
  if (spec->compiler.balanceinertia) {
    out.moments = out.moments.cwiseMax(0);
    if (thickness(out.moments) < 0) out.moments.setConstant(out.moments.mean());
  }
  return out;
}

// The inertial frame's axes become the principal ones.
void set_moments(mjsBody* body, const Eigen::Quaternion<double>& axes, const Vec3& moments) {
  if (is_full(body)) {
    const double* q = body->iquat;
    const Eigen::Quaternion<double> turned =
        Eigen::Quaternion<double>(q[0], q[1], q[2], q[3]) * axes;
    const double quat[] = {turned.w(), turned.x(), turned.y(), turned.z()};
    std::copy(quat, quat + 4, body->iquat);
    body->fullinertia[0] = std::numeric_limits<double>::quiet_NaN();  // not given
  }
  Eigen::Map<Vec3>(body->inertia) = moments;
}

std::string words(const Vec3& moments) {
  char text[96];
  std::snprintf(text, sizeof text, "%.3g, %.3g, %.3g", moments[0], moments[1], moments[2]);
  return text;
}

// Whether MuJoCo's compiler takes a body that has mass, whose own eigenvalues of a whole tensor are
// rounded. Where it is welded to others its moments may be zero, unless the whole tensor is given.
bool is_held(const mjSpec* spec, mjsBody* body, const Vec3& moments) {
  if (is_full(body) && principal(body).moments.minCoeff() < least) return false;
  const double thinnest_held = is_full(body) ? digits : 0;
  if (!spec->compiler.balanceinertia && thickness(moments) < thinnest_held) return false;
  if (moments.minCoeff() >= least) return true;
  return !is_full(body) && !has_joint(body) &&
         Eigen::Map<const Vec3>(body->inertia).minCoeff() >= 0;
}

double mass_of_ball(const RigidBody<double>& given) { return given.mass > 0 ? given.mass : 1; }

// In the place of a body, on its principal axes.
void set_ball(mjsBody* body, const RigidBody<double>& given) {
  if (!body->explicitinertial)  // where MuJoCo has a body that only its bounds give an inertia
    std::copy(body->pos, body->pos + 3, body->ipos);
  body->explicitinertial = 1;
  body->mass = mass_of_ball(given);
  set_moments(body, given.axes,
              Vec3::Constant(given.mass > 0 ? std::max(given.moments.mean(), 2 * least) : 1));
}

}  // namespace

std::vector<GivenInertia> take_out_inertias(mjSpec* spec, bool keeps_bodies) {
  std::vector<GivenInertia> taken, frames;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (!moves(body)) continue;
    const std::optional<RigidBody<double>> given = given_body(spec, body);
    if (!given || !given->moments.allFinite() || !std::isfinite(given->mass)) continue;
    if (given->mass < 0) throw InputError("body '" + name_of(e) + "' has a negative mass");
    if (given->massless() && !has_joint(body)) {
      set_moments(body, given->axes, Vec3::Zero());
      frames.push_back({body, *given});
      continue;
    }
    if (given->mass > 0 && is_held(spec, body, given->moments)) continue;
    if (given->moments.minCoeff() < 0)
      throw InputError("body '" + name_of(e) + "' has a negative moment of inertia (" +
                       words(given->moments) + "): option inertia=balanced takes the nearest body");
    set_ball(body, *given);
    taken.push_back({body, *given});
  }
  // A sum of inertias could not be put back.
  if (spec->compiler.fusestatic && (keeps_bodies || !taken.empty())) {
    spec->compiler.fusestatic = 0;
    taken.insert(taken.end(), frames.begin(), frames.end());
  }
  return taken;
}

bool GivenInertia::is_of_solid() const {
  return given.mass > 0 && given.moments.minCoeff() > 0 && is_solid(given.moments);
}

std::string balance_inertias(mjSpec* spec) {
  std::string changed;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (!body->explicitinertial || inertia_from_geoms(spec, body) || !moves(body)) continue;
    const RigidBody<double> given = principal(body);
    const Vec3 second = given.moments.sum() / 2 - given.moments.array();
    const double largest = second.maxCoeff();
    if (!given.moments.allFinite() || is_solid(given.moments) || !(largest > 0)) continue;
    const Vec3 clipped = second.cwiseMax(thinnest * largest);
    const Vec3 balanced = clipped.sum() - clipped.array();
    set_moments(body, given.axes, balanced);
    changed += (changed.empty() ? "'" : ", '") + name_of(e) + "' from " + words(given.moments) +
               " to " + words(balanced) + " kg m^2";
  }
  return changed.empty() ? "" : "balanced moments of inertia: " + changed;
}

void put_back(const std::vector<GivenInertia>& taken, const mjSpec* spec, mjModel* model) {
  for (const auto& [body, given] : taken) {
    const int i = mjs_getId(body->element);
    const double scale = model->body_mass[i] / mass_of_ball(given);
    model->body_mass[i] = scale * given.mass;
    Eigen::Map<Vec3>(model->body_inertia + 3 * i) = scale * given.moments;
  }
  if (!taken.empty() && spec->compiler.settotalmass > 0) {
    if (std::all_of(model->body_mass, model->body_mass + model->nbody,
                    [](double m) { return m == 0; }))
      throw InputError("settotalmass: no body has a mass");
    mj_setTotalmass(model, spec->compiler.settotalmass);
  }
  std::copy(model->body_mass, model->body_mass + model->nbody, model->body_subtreemass);
  for (auto body = model->nbody - 1; body > 0; --body)
    model->body_subtreemass[model->body_parentid[body]] += model->body_subtreemass[body];
}

}  // namespace kalmarm

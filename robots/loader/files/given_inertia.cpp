#include "robots/loader/files/given_inertia.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

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

bool is_solid(Vec3 moments) {
  std::sort(moments.begin(), moments.end());
  return moments[0] + moments[1] >= moments[2];
}

bool is_full(const mjsBody* body) { return !std::isnan(body->fullinertia[0]); }

// Its axes are those of the inertial frame, unless the whole tensor is given.
RigidBody<double> principal(const mjsBody* body) {
  const double* I = body->fullinertia;  // xx, yy, zz, xy, xz, yz
  if (!is_full(body)) return {.mass = body->mass, .moments = Eigen::Map<const Vec3>(body->inertia)};
  Matrix3<double> tensor;
  tensor << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return with_principal_axes<double>(body->mass, Vec3::Zero(), tensor);
}

// The axes of the inertial frame become the principal ones.
void set_moments(mjsBody* body, const Eigen::Quaternion<double>& axes, const Vec3& moments) {
  if (is_full(body)) {
    const double quat[] = {axes.w(), axes.x(), axes.y(), axes.z()};
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

// Whether MuJoCo's compiler takes these moments of the body. Where it is welded to others they may
// be zero, unless the whole tensor is given.
bool is_held(mjsBody* body, const Vec3& moments) {
  if (!is_solid(moments)) return false;
  return moments.minCoeff() >= least || (!is_full(body) && !has_joint(body));
}

bool has_mass(mjSpec* spec, mjsBody* body) {
  if (inertia_from_geoms(spec, body)) return mjs_firstChild(body, mjOBJ_GEOM, 0) != nullptr;
  return body->mass > 0;
}

// A link without mass between joints, as ROS's files have them; one with nothing beyond it is
// MuJoCo's to refuse, and so is what a file asks MuJoCo to change of masses.
bool is_massless_link(mjSpec* spec, mjsBody* body) {
  if (!has_joint(body) || has_mass(spec, body)) return false;
  if (spec->compiler.boundmass > 0 || spec->compiler.settotalmass > 0) return false;
  bool bears_mass = false;
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_BODY, 1); e; e = mjs_nextChild(body, e, 1)) {
    mjsBody* at = mjs_asBody(e);
    if (!has_mass(spec, at)) continue;
    bears_mass = true;
    while (at != body && !has_joint(at)) at = mjs_getParent(at->element);
    if (at == body) return false;  // welded to it
  }
  return bears_mass;
}

GivenInertia take_out_massless(mjsBody* body) {
  body->explicitinertial = 1;
  body->mass = 1;
  std::fill(body->ipos, body->ipos + 3, 0.0);
  set_moments(body, Eigen::Quaternion<double>::Identity(), Vec3::Ones());
  return {body, 0, Vec3::Zero()};
}

}  // namespace

std::vector<GivenInertia> take_out_inertias(mjSpec* spec) {
  std::vector<GivenInertia> taken;
  if (spec->compiler.balanceinertia) return taken;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (is_massless_link(spec, body)) {
      taken.push_back(take_out_massless(body));
      continue;
    }
    if (!body->explicitinertial || inertia_from_geoms(spec, body) || !(body->mass > 0)) continue;
    const RigidBody<double> given = principal(body);
    const double zero = std::max(least, rounding * given.moments.maxCoeff());
    const bool is_rounded = given.moments.minCoeff() > -zero;
    const Vec3 moments = is_rounded ? given.moments.cwiseMax(0) : given.moments;
    if (!moments.allFinite() || is_held(body, moments)) continue;
    if (moments.minCoeff() < 0)
      throw InputError("body '" + name_of(e) + "' has a negative moment of inertia (" +
                       words(moments) + "): --inertia balanced takes the nearest body");
    set_moments(body, given.axes, Vec3::Constant(std::max(moments.mean(), 2 * least)));
    taken.push_back({body, body->mass, moments.cwiseMax(spec->compiler.boundinertia)});
  }
  if (!taken.empty()) spec->compiler.fusestatic = 0;  // a sum of inertias could not be put back
  return taken;
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

void put_back(const std::vector<GivenInertia>& taken, mjModel* model) {
  for (const GivenInertia& given : taken) {
    const int body = mjs_getId(given.body->element);
    const double scale = model->body_mass[body] / given.body->mass;
    model->body_mass[body] = scale * given.mass;
    Eigen::Map<Vec3>(model->body_inertia + 3 * body) = scale * given.moments;
  }
  std::copy(model->body_mass, model->body_mass + model->nbody, model->body_subtreemass);
  for (auto body = model->nbody - 1; body > 0; --body)
    model->body_subtreemass[model->body_parentid[body]] += model->body_subtreemass[body];
}

}  // namespace kalmarm

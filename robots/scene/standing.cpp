#include "robots/scene/standing.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>

#include "robots/loader/input_error.hpp"
#include "robots/scene/question.hpp"

namespace kalmarm {

namespace {

// Links that have mass and carry no other link that has.
std::vector<int> tips(const Model<double>& model) {
  std::vector<bool> carries(model.nv());  // a link that has mass
  std::vector<int> out;
  for (int k = model.nv() - 1; k >= 0; --k) {
    const bool massive = !model.joint(k).body.massless();
    if (massive && !carries[k]) out.push_back(k);
    if (model.parent(k) >= 0 && (massive || carries[k])) carries[model.parent(k)] = true;
  }
  return {out.rbegin(), out.rend()};
}

}  // namespace

std::vector<int> standing_links(const Scene& scene, const std::vector<std::string>& feet) {
  if (feet.empty()) return tips(scene.model);
  QuestionOptions named;
  named.dofs = feet;
  std::vector<int> out = question_of(scene, named).dofs;
  std::erase_if(out, [&](int k) { return scene.model.joint(k).body.massless(); });
  if (out.empty()) throw InputError("no link of " + feet.front() + " has mass to stand on");
  return out;
}

std::vector<ContactRow<double>> contacts_of(const Model<double>& model, const Standing& standing,
                                            std::uint64_t seed) {
  constexpr double tangent = 0.3;
  boost::random::mt19937_64 engine(seed);
  boost::random::normal_distribution<double> normal;
  const auto direction = [&]() -> Vector3<double> {
    return Vector3<double>::NullaryExpr([&] { return normal(engine); }).normalized();
  };
  std::vector<ContactRow<double>> out;
  for (const int link : standing.links) {
    const RigidBody<double>& body = model.joint(link).body;
    const double gyration = std::sqrt(body.moments.sum() / (2 * body.mass));
    for (int i = 0; i < standing.points; ++i) {
      const Vector3<double> p = body.com + gyration * direction(), n = direction();
      const Vector3<double> t = n.cross(direction()).normalized();
      const auto add = [&](const Vector3<double>& f, double d) {
        ContactRow<double> row{link, Vector6<double>::Zero(), d};
        row.e << p.cross(f), f;
        out.push_back(row);
      };
      add(n, 1);
      add(t, tangent);
      add(n.cross(t), tangent);
    }
  }
  return out;
}

}  // namespace kalmarm

// What a scene's file holds, against MuJoCo's own compilation of all of it; and that the fast path
// trusts what ships.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/names.hpp"
#include "robots/scene/inventory.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/sites.hpp"

namespace kalmarm {
namespace {

// A scene as MuJoCo compiles it when nothing is stripped.
class Unstripped {
 public:
  explicit Unstripped(const std::string& file)
      : model_(mj_loadXML(file.c_str(), nullptr, error_, sizeof error_), mj_deleteModel),
        data_(model_ ? mj_makeData(model_.get()) : nullptr, mj_deleteData) {}

  const mjModel* model() const { return model_.get(); }
  mjData* data() const { return data_.get(); }
  void set(const VectorX<double>& q) {
    std::copy(q.begin(), q.end(), data_->qpos);
    mj_forward(model_.get(), data_.get());
  }

 private:
  char error_[500] = "";
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
};

class ShippedScene : public testing::TestWithParam<std::string> {};

TEST_P(ShippedScene, HasTheMassMatrixOfTheWholeFile) {
  const Scene scene = load_scene(GetParam());
  Unstripped whole(scene.file);
  ASSERT_TRUE(whole.model());
  const int nv = scene.model.nv();
  ASSERT_EQ(whole.model()->nv, nv);
  LinkKinematics<double> kin(scene.model);
  CompositeInertia<double> composite(scene.model);
  MatrixX<double> M(nv, nv), theirs(nv, nv);
  for (const State& state : random_states(scene, 3, 7)) {
    whole.set(state.q);
    full_mass_matrix(whole.model(), whole.data(), theirs.data());
    set_position(scene.model, state.q, kin);
    mass_matrix(scene.model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    EXPECT_LE((M - theirs).norm(), 1e-13 * M.norm());
  }
}

// Rows (angular; linear) in the site's axes against MuJoCo's (linear), (angular) in the world's.
TEST_P(ShippedScene, HasMujocosSiteJacobians) {
  const Scene scene = load_scene(GetParam());
  Unstripped whole(scene.file);
  const mjModel* m = whole.model();
  const int nv = scene.model.nv();
  const State state = random_states(scene, 1, 5)[0];
  whole.set(state.q);
  LinkKinematics<double> kin(scene.model);
  set_position(scene.model, state.q, kin);
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
  Rows linear(3, nv), angular(3, nv);
  MatrixX<double> J(6, nv);
  int compared = 0;
  for (const NamedSite& named : sites_of(scene)) {
    const int site = mj_name2id(m, mjOBJ_SITE, named.name.c_str());
    const int body = mj_name2id(m, mjOBJ_BODY, named.name.c_str());
    if (site >= 0)
      mj_jacSite(m, whole.data(), linear.data(), angular.data(), site);
    else
      mj_jacBody(m, whole.data(), linear.data(), angular.data(), body);
    const double* R =
        site >= 0 ? whole.data()->site_xmat + 9 * site : whole.data()->xmat + 9 * body;
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> axes(R);
    site_jacobian<double>(scene.model, kin, {named.site}, J);
    EXPECT_LE((J.topRows(3) - axes.transpose() * angular).norm(), 1e-12) << named.name;
    EXPECT_LE((J.bottomRows(3) - axes.transpose() * linear).norm(), 1e-12) << named.name;
    ++compared;
  }
  EXPECT_GE(compared, m->nsite);
}

// Of random states, the calls that double does not answer by its own kernels.
std::set<std::string> climbs_from_double(const Scene& scene, int states) {
  Dynamics<double> robot(
      plain(scene.model),
      {.question = {.want = {Want::acceleration, Want::solve, Want::inverse, Want::diagonal}}});
  VectorX<double> a(robot.nv());
  MatrixX<double> X(robot.nv(), robot.nv());
  std::set<std::string> climbs;
  const auto look = [&](const char* call, const Outcome& out) {
    if (!out || out.rung > Outcome::Rung::float64 || out.warns()) climbs.insert(call);
  };
  for (const State& at : random_states(scene, states, 1)) {
    look("forward_dynamics", robot.forward_dynamics(at.q, at.qd, at.tau, a));
    look("factor", robot.factor(at.q));
    look("solve", robot.solve(at.tau, a));
    look("diagonal", robot.diagonal(at.q, a));
    if (robot.nv() <= 300) look("inverse_mass", robot.inverse_mass(at.q, X));
  }
  return climbs;
}

// Of rows of random states, the calls of which float's lanes leave some to double.
std::set<std::string> climbs_from_lanes(const Scene& scene, int states) {
  using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  Dynamics<float> robot(plain(scene.model),
                        {.question = {.want = {Want::acceleration, Want::solve, Want::inverse,
                                               Want::diagonal, Want::log_det}}});
  const int nv = robot.nv();
  Rows q(states, robot.nq()), qd(states, nv), tau(states, nv), x(states, nv), one(states, 1),
      X(states, nv * nv);
  const std::vector<State> all = random_states(scene, states, 1);
  for (int i = 0; i < states; ++i) {
    q.row(i) = all[i].q.cast<float>();
    qd.row(i) = all[i].qd.cast<float>();
    tau.row(i) = all[i].tau.cast<float>();
  }
  std::vector<Outcome> outcomes(states);
  std::set<std::string> climbs;
  const auto look = [&](const char* call, int failed) {
    for (const Outcome& out : outcomes)
      if (failed > 0 || out.rung > Outcome::Rung::float_lanes || out.warns()) climbs.insert(call);
  };
  look("forward_dynamics", robot.forward_dynamics(q, qd, tau, x, outcomes));
  look("solve", robot.solve(q, tau, x, outcomes));
  look("diagonal", robot.diagonal(q, x, outcomes));
  look("log_det", robot.log_det(q, one, outcomes));
  if (nv <= 96) look("inverse_mass", robot.inverse_mass(q, X, outcomes));
  return climbs;
}

TEST_P(ShippedScene, IsAnsweredByTheFirstRungInRandomStates) {
  const Scene scene = load_scene(GetParam());
  EXPECT_EQ(climbs_from_double(scene, 20), std::set<std::string>{});
  EXPECT_EQ(climbs_from_lanes(scene, 32), std::set<std::string>{});
}

TEST(FamiliesOfScenes, AreAnsweredByTheFirstRungInRandomStates) {
  for (const std::string family : {"straight", "chain", "tree"}) {
    for (const std::string links : {"30", "300", "1000"}) {
      SCOPED_TRACE(family + ':' + links);
      EXPECT_EQ(climbs_from_double(load_scene(family + ':' + links), 10), std::set<std::string>{});
    }
    for (const std::string links : {"7", "31", "127"}) {
      SCOPED_TRACE(family + ':' + links);
      EXPECT_EQ(climbs_from_lanes(load_scene(family + ':' + links), 32), std::set<std::string>{});
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScene, testing::ValuesIn(shipped_scenes()),
                         [](const auto& info) { return info.param; });
INSTANTIATE_TEST_SUITE_P(Robots, ShippedScene, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });

TEST(Inventory, OfTheTable) {
  const Inventory inventory = inventory_of(load_scene("table"));
  EXPECT_EQ(inventory.bodies, 39);
  EXPECT_EQ(inventory.moving, 35);  // 9 + 6 of the arms, 20 things
  const auto find = [&](const std::string& kind) {
    for (const Inventory::Element& element : inventory.elements)
      if (element.kind == kind) return element;
    return Inventory::Element{};
  };
  EXPECT_EQ(find("geom").given, 22);
  EXPECT_EQ(find("geom").kept, 20);  // the things' inertias come from them
  EXPECT_EQ(find("light").kept, 0);
  EXPECT_EQ(find("sensor").given, 1);
}

TEST(Names, NearestComeFirst) {
  EXPECT_EQ(unknown_name("joint", "left_kne", {"hip", "left_knee", "LEFT_KNEE_2", "left_hip"}),
            "joint 'left_kne' is unknown; nearest: left_knee, LEFT_KNEE_2, left_hip");
  EXPECT_EQ(unknown_name("rule", "x", {}), "rule 'x' is unknown");
  EXPECT_TRUE(matches("left_*", "left_knee"));
  EXPECT_FALSE(matches("left_*", "right_knee"));
}

}  // namespace
}  // namespace kalmarm

#include "algorithms/dynamics/check_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"

namespace kalmarm {
namespace {

// The DoF that a joint's first one needs behind it, each on the one before.
int followers_of(Coordinate coordinate) {
  return coordinate == Coordinate::quaternion || coordinate == Coordinate::position ? 2 : 0;
}

// Calls f(name, number) for every number of a link.
template <class F>
void each_number(const LinkParameters& link, const F& f) {
  const auto all = [&](const char* what, const auto& numbers) {
    for (const double x : numbers) f(what, x);
  };
  f("reference", link.reference);
  all("rotation", link.rotation);
  all("translation", link.translation);
  f("armature", link.armature);
  f("mass", link.mass);
  all("centre of mass", link.center_of_mass);
  all("inertia axes", link.inertia_axes);
  all("principal moment", link.principal_moments);
}

class ModelCheck {
 public:
  ModelCheck(const RobotModel& model, double largest) : model_(model), largest_(largest) {}

  void run() {
    const int nv = model_.nv();
    if (static_cast<int>(model_.names.size()) != nv)
      throw std::invalid_argument("robot model: " + std::to_string(model_.names.size()) +
                                  " names for " + std::to_string(nv) + " DoF");
    for (const double x : model_.gravity) held("robot model: gravity", x);
    std::vector<char> read(std::max(model_.nq, 0), 0);
    int nq = 0;
    for (at_ = 0; at_ < nv; ++at_) {
      tree();
      parameters();
      nq += entries(read);
    }
    if (nq != model_.nq)
      throw std::invalid_argument("robot model: nq is " + std::to_string(model_.nq) +
                                  ", its joints read " + std::to_string(nq));
  }

 private:
  std::string dof() const { return "robot model: DoF '" + model_.names[at_] + "': "; }

  [[noreturn]] void refuse(const std::string& why) const {
    throw std::invalid_argument(dof() + why);
  }

  void held(const std::string& what, double x) const {
    if (std::abs(x) <= largest_) return;
    const std::string most = ", more than " + short_text("%g", largest_);
    throw std::invalid_argument(what + " is " + short_text("%g", x) +
                                (std::isfinite(x) ? most : ""));
  }

  void tree() {
    const LinkParameters& link = model_.links[at_];
    if (link.parent < -1 || link.parent >= at_)
      refuse("parent " + std::to_string(link.parent) + " does not come before it");
    const int kind = static_cast<int>(link.coordinate);
    if (kind < 0 || kind > static_cast<int>(Coordinate::follower))
      refuse("coordinate " + std::to_string(kind) + " is none");
    if (link.coordinate == Coordinate::follower) {
      if (followers_left_ == 0 || link.parent != at_ - 1) refuse("a follower that follows nothing");
      if (link.slides != model_.links[at_ - 1].slides)
        refuse("of one joint a DoF slides and another turns");
      --followers_left_;
      return;
    }
    if (followers_left_ > 0)
      refuse("DoF of the joint before it are missing: " + std::to_string(followers_left_));
    const bool slides =
        link.coordinate == Coordinate::distance || link.coordinate == Coordinate::position;
    if (link.slides != slides)
      refuse(slides ? "its coordinate is a length, but it turns"
                    : "its coordinate is an angle or a quaternion, but it slides");
    followers_left_ = followers_of(link.coordinate);
    if (at_ + followers_left_ >= model_.nv()) refuse("the last DoF of its joint are missing");
  }

  void parameters() const {
    const LinkParameters& link = model_.links[at_];
    each_number(link, [&](const char* what, double x) { held(dof() + what, x); });
    turns("rotation", link.rotation);
    turns("inertia axes", link.inertia_axes);
    if (link.armature < 0) refuse("armature is " + short_text("%g", link.armature));
    if (link.mass < 0) refuse("mass is " + short_text("%g", link.mass));
    // The loader takes moments as given that no solid body has, but none below zero. Rounding is
    // forgiven.
    const auto& moments = link.principal_moments;
    const double least = *std::min_element(moments.begin(), moments.end()),
                 most = *std::max_element(moments.begin(), moments.end());
    if (least < -1e-9 * most || most < 0) refuse("principal moment is " + short_text("%g", least));
  }

  void turns(const char* what, const std::array<double, 4>& quaternion) const {
    if (!is_turn(quaternion_of(quaternion)))
      refuse(std::string(what) + ": a quaternion of no length");
  }

  // Entries of q that the DoF reads, each the first and only one to do so.
  int entries(std::vector<char>& read) const {
    const LinkParameters& link = model_.links[at_];
    const int count = q_entries(link.coordinate);
    if (link.q_index < 0 || link.q_index > model_.nq - count)
      refuse("q[" + std::to_string(link.q_index) + "] of " + std::to_string(model_.nq));
    for (int i = link.q_index; i < link.q_index + count; ++i) {
      if (read[i]) refuse("q[" + std::to_string(i) + "] is another joint's");
      read[i] = 1;
    }
    return count;
  }

  const RobotModel& model_;
  double largest_;
  int at_ = 0, followers_left_ = 0;
};

}  // namespace

bool fits_float(const RobotModel& model) {
  bool out = true;
  for (const LinkParameters& link : model.links)
    each_number(link, [&](const char*, double x) {
      out = out && std::abs(x) <= std::numeric_limits<float>::max();
    });
  return out;
}

void check_frame(const char* what, const Frame& frame, int nv) {
  const std::string name = std::string(what) + ": a frame on link " + std::to_string(frame.link);
  if (frame.link < -1 || frame.link >= nv)
    throw std::invalid_argument(name + " of a robot with " + std::to_string(nv));
  const Vector3<double> at(frame.translation.data());
  if (!is_turn(quaternion_of(frame.rotation)) || !at.allFinite())
    throw std::invalid_argument(name +
                                " has a quaternion of no length or a number that is not finite");
}

void check_tolerance(double tolerance) {
  if (!(tolerance >= last_bits && tolerance <= 1))
    throw std::invalid_argument("options: tolerance " + short_text("%.3g", tolerance) +
                                " is not within " + short_text("%.3g", last_bits) + " and 1");
}

void check_model(const RobotModel& model, double largest) { ModelCheck(model, largest).run(); }

}  // namespace kalmarm

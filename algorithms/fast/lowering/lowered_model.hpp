// A model lowered once for the fast path: frames moved along and about the joint axes, which stay
// z, so that most numbers of phi(parent,k) become 0 or 1.
//
//   phi(parent,k) = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)       T: translation, R: rotation
// angle = q + offset + quarters of a turn at a hinge, d = q + offset at a slide; all else is
// constant. An angle of quarters alone is exact, and so is alpha where it is zero or a right angle:
// such links are marked. A link's frame may be turned about its axis and moved along it. That is
// chosen for one child, the aligned one (child k + 1 where both joints are hinges or slides), so
// that its
//   theta = 0 and p = (a, 0, 0)
// as in modified Denavit-Hartenberg: the origin is the foot of the axes' common perpendicular.
// Where the axes are so near to parallel that the foot is farther away than twice the distance of
// the origins, the origin stays where it is and p = (a, b, 0). Other children keep theta and any p.
// The fixed base has a frame for each of its children: p = 0, theta = alpha = 0.
// Ball and free joints keep their frames: a matrix that depends on q, then two followers, DoF whose
// phi is a cyclic permutation of the axes (model.hpp). Where their DoF have no joint noise and no
// body between them, the sweeps treat the joint in one block step (three_axes.hpp).
// A link on which forces act from outside, contacts or loads, has a sum over its children even where it has none: the
// sum begins at these.
//
// All constants are computed in a wider precision and rounded once.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "algorithms/fast/lowering/link_frame.hpp"
#include "algorithms/fast/lowering/lowered_frame.hpp"
#include "algorithms/fast/lowering/lowered_link.hpp"
#include "algorithms/fast/lowering/rounding_weights.hpp"
#include "algorithms/fast/lowering/terms_of_columns.hpp"
#include "algorithms/fast/lowering/zeros.hpp"
#include "algorithms/model/model.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/sincos.hpp"
#include "kalmarm/call.hpp"

namespace kalmarm {

template <class S>
class LoweredModel {
 public:
  // error_of_D: that is accepted of a D (covariance/rounding_test.hpp); frames: of calls, each on the last DoF of a
  // joint.
  template <class Given>
  explicit LoweredModel(const Model<Given>& model, Zeros zeros = Zeros::left_out,
                        double error_of_D = accepted_error(default_tolerance<S>),
                        const CallFrames& frames = {});

  int nv() const { return static_cast<int>(links_.size()); }
  int nq() const { return nq_; }
  int angles() const { return static_cast<int>(hinges_.q_index.size()); }
  int matrices() const { return matrices_; }  // of ball joints, and of positions of free joints
  int branch_count() const { return branch_count_; }
  const HingeAngles<S>& hinges() const { return hinges_; }
  const std::vector<LinkRun>& runs() const { return runs_; }
  double error_of_D() const { return error_of_D_; }
  // c u over that error, of which N and the weights are multiples.
  S rounding_unit() const { return kalmarm::rounding_unit<S>(error_of_D_); }
  // (c u)^2 over its square, beside which N stands in these units: at most 1 where an error of c u sqrt(N) is let pass.
  S share_of_noise() const {
    const S cu = S(rounding_constant) * unit_roundoff<S>(), share = cu / S(error_of_D_);
    return share * share / rounding_unit();
  }
  // Whether rounding of some P- can matter to a D in some position (rounding_weights.hpp).
  bool may_lose_D() const {
    return std::any_of(bodies_.begin(), bodies_.end(),
                       [](const LoweredBody<S>& body) { return body.weights.tested; });
  }
  // Whether some link cannot absorb, or no T for all states is known (force_noise.hpp).
  bool rounding_depends_on_state() const {
    return !(largest_variance_ < S(no_body)) ||
           std::any_of(bodies_.begin(), bodies_.end(), [](const LoweredBody<S>& body) {
             return body.weights.counts && !body.weights.absorbs();
           });
  }
  const LoweredLink<S>& link(int k) const { return links_[k]; }
  const LoweredBody<S>& body(int k) const { return bodies_[k]; }
  // Of a joint that has some, and not less: what was derived from the robot's own still holds.
  void set_noise(int k, const S& r) { bodies_[k].r = r; }
  // Axx to Czz of the links' weights, link after link.
  const std::vector<S>& weights() const { return weights_; }
  // mu(k) of least_inertia.hpp, nv of them [kg m^2, of a slide kg].
  const std::vector<S>& least_inertias() const { return least_inertias_; }
  // The largest that M(k,k) can be wherever the joints stand (rounding_weights.hpp), nv of them, likewise;
  // 0 where slides let what hangs on joint k go any distance.
  const std::vector<S>& largest_inertias() const { return largest_inertias_; }
  // T of (3) of least_inertia.hpp [1 / (kg m^2), of slides 1 / kg].
  const S& largest_variance() const { return largest_variance_; }
  const S& mass() const { return mass_; }  // of all that moves
  // |gravity|^2 times that [N^2 / kg].
  S energy_of_gravity() const { return mass_ * squared_gravity_; }
  const S& squared_gravity() const { return squared_gravity_; }  // |gravity|^2
  // (2) of terms_of_columns.hpp.
  const S& terms_of_columns() const { return terms_of_columns_; }
  const CentralBody<S>& central(int k) const { return central_[k]; }
  const UncommonPlacement<S>& uncommon(const LoweredLink<S>& link) const {
    return uncommon_[link.uncommon];
  }

  const std::vector<LoweredFrame<S>>& acted_on() const { return acted_on_; }
  const std::vector<LoweredFrame<S>>& contacts() const { return contacts_; }
  const std::vector<LoweredFrame<S>>& loaded() const { return loaded_; }
  std::vector<LoweredFrame<S>> lowered(const std::vector<Frame>& frames) const;
  // Of a call, with so many rows of J.
  Widths widths(std::ptrdiff_t rows_of_J = 0) const {
    return {nq_, nv(), nv(), rows_of_J, frames_};
  }

  // phi from a frame on link k to the link: from the link frame of Model to the one used here.
  Transform<Wider<S>> phi_on_link(int k, const Transform<Wider<S>>& phi) const {
    const Move& move = moves_[k];
    const Matrix3<Wider<S>> back = detail::about_z(move.gamma).transpose();
    const Vector3<Wider<S>> p = back * (phi.p - move.shift * Vector3<Wider<S>>::UnitZ());
    return {Matrix3<Wider<S>>(back * phi.R), p};
  }

 private:
  // Of a link's frame: Rz(gamma) T(0,0,shift).
  struct Move {
    Direction<Wider<S>> gamma{Wider<S>(1), Wider<S>(0)};
    Wider<S> shift = Wider<S>(0);
  };

  // The angle of a hinge from q on, when it is `angle` at q = ref.
  template <class W>
  void add_hinge(int q_index, const Direction<W>& angle, const W& ref) {
    using std::atan2;
    static constexpr int cos[] = {1, 0, -1, 0};
    const int quarters = detail::nearest_quarters(angle);
    const Direction<W> rest = detail::sum(angle, {W(cos[quarters]), W(-cos[(quarters + 3) % 4])});
    const auto i = hinges_.q_index.size();
    hinges_.q_index.push_back(q_index);
    if (i % padding<S> == 0) {
      hinges_.offset.resize(i + padding<S>, S(0));
      hinges_.quarters.resize(i + padding<S>);
    }
    hinges_.offset[i] = S(atan2(rest.s, rest.c) - ref);
    hinges_.quarters[i] = quarters;
  }

  static bool has_matrix(const Coordinate& coordinate) {
    return coordinate == Coordinate::quaternion || coordinate == Coordinate::position;
  }
  static bool on_a_screw(const Coordinate& coordinate) {
    return coordinate == Coordinate::angle || coordinate == Coordinate::distance;
  }

  template <class W>
  void lower(const Model<W>& model);

  void add_sum(LoweredLink<S>& link) {
    if (link.branch < 0) link.branch = branch_count_++;
  }

  // Whether DoF k is the first of three about, or along, the axes of one joint, between which there
  // is nothing else.
  bool is_one_joint(int k) const {
    for (int i = k; i < k + 3; ++i) {
      const LoweredLink<S>& link = links_[i];
      if (link.has_noise || (i > k && link.coordinate != Coordinate::follower)) return false;
      if (i < k + 2 && (!link.massless || link.branch >= 0)) return false;
    }
    return true;
  }

  // How many DoF from k on are one block step: six of a free joint, three of a ball joint, or none.
  int dofs_at_once(int k) const {
    const auto begins = [this](int first, Coordinate coordinate) {
      return first + 3 <= nv() && links_[first].coordinate == coordinate && is_one_joint(first);
    };
    if (begins(k, Coordinate::quaternion)) return 3;
    const bool is_free = begins(k, Coordinate::position) && begins(k + 3, Coordinate::quaternion) &&
                         links_[k + 2].massless && links_[k + 2].branch < 0 &&
                         links_[k + 3].parent == k + 2 && links_[k + 3].p.isZero(S(0));
    return is_free ? 6 : 0;
  }

  void set_runs();

  template <class W>
  void set_link(const Model<W>& model, const detail::LinkFrame<W>& frame, int k);

  Zeros zeros_;
  double error_of_D_;
  int nq_, matrices_ = 0, branch_count_ = 0;
  HingeAngles<S> hinges_;
  std::vector<LoweredLink<S>> links_;
  std::vector<LoweredBody<S>> bodies_;
  std::vector<S> weights_, least_inertias_, largest_inertias_;
  S terms_of_columns_ = S(0), largest_variance_ = S(0), squared_gravity_ = S(0), mass_ = S(0);
  std::vector<CentralBody<S>> central_;  // and for inverse dynamics
  std::vector<UncommonPlacement<S>> uncommon_;
  std::vector<Move> moves_;
  std::vector<LinkRun> runs_;
  CallFrames frames_;
  std::vector<LoweredFrame<S>> acted_on_, contacts_, loaded_;
};

template <class S>
template <class Given>
LoweredModel<S>::LoweredModel(const Model<Given>& model, Zeros zeros, double error_of_D,
                              const CallFrames& frames)
    : zeros_(zeros),
      error_of_D_(error_of_D),
      nq_(model.nq()),
      links_(model.nv()),
      bodies_(model.nv()),
      central_(model.nv()),
      moves_(model.nv()),
      frames_(frames) {
  // A float's tilt of 1e-16 is no rounding yet, which in double it could be.
  using Next = Wider<Given>;
  lower(model.template cast<std::conditional_t<std::is_same_v<Given, float>, Wider<Next>, Next>>());
}

template <class S>
std::vector<LoweredFrame<S>> LoweredModel<S>::lowered(const std::vector<Frame>& frames) const {
  using std::abs;
  std::vector<LoweredFrame<S>> out;
  for (const Frame& frame : frames) {
    const auto site = site_of(frame).template cast<Wider<S>>().phi();
    const auto phi = frame.link < 0 ? site : phi_on_link(frame.link, site);
    out.push_back({frame.link, phi.R.template cast<S>(), phi.p.template cast<S>(), {}, {}});
    LoweredFrame<S>& lowered = out.back();
    S reach = S(0);
    for (int k = frame.link; k >= 0; k = links_[k].parent) {
      const LoweredLink<S>& link = links_[k];
      lowered.way.push_back(k);
      lowered.reach.push_back(reach);
      reach += link.slides ? std::numeric_limits<S>::infinity() : S(link.p.norm() + abs(link.d));
    }
    std::reverse(lowered.way.begin(), lowered.way.end());
    std::reverse(lowered.reach.begin(), lowered.reach.end());
  }
  return out;
}

template <class S>
template <class W>
void LoweredModel<S>::lower(const Model<W>& model) {
  std::vector<detail::LinkFrame<W>> frames(model.nv());
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<W>& joint = model.joint(k);
    detail::LinkFrame<W>& frame = frames[k];
    if (joint.parent < 0 || joint.coordinate == Coordinate::follower) continue;
    detail::LinkFrame<W>& parent = frames[joint.parent];
    if (joint.parent == k - 1 && on_a_screw(joint.coordinate) &&
        on_a_screw(model.joint(k - 1).coordinate)) {
      detail::align(parent, frame, model.E(k), joint.translation);
    } else {
      const Matrix3<W> back = detail::about_z(parent.gamma).transpose();
      const Vector3<W> d = joint.translation - parent.shift * Vector3<W>::UnitZ();
      frame.place(back * model.E(k), back * d);
    }
  }
  for (int k = 0; k < model.nv(); ++k) set_link(model, frames[k], k);
  for (const Frame& frame : frames_.acted_on) add_sum(links_[frame.link]);
  for (const Frame& frame : frames_.contacts) {
    add_sum(links_[frame.link]);
    links_[frame.link].resists = true;
  }
  for (const Frame& frame : frames_.loaded) {
    add_sum(links_[frame.link]);
    links_[frame.link].loaded = true;
    links_[frame.link].massless = false;
  }
  acted_on_ = lowered(frames_.acted_on);
  contacts_ = lowered(frames_.contacts);
  loaded_ = lowered(frames_.loaded);
  set_runs();
  const auto unit = static_cast<double>(rounding_unit());
  const auto covariances = detail::free_covariances(links_, bodies_);
  const auto largest = detail::WeightsOfLinks<S>::set(links_, runs_, covariances, unit, bodies_);
  for (const LoweredBody<S>& body : bodies_) mass_ += body.m;
  squared_gravity_ = S(model.gravity().squaredNorm());
  least_inertias_ = detail::least_inertias(links_, bodies_, runs_, uncommon_, covariances);
  largest_variance_ = S(detail::largest_variance(links_, bodies_, runs_, least_inertias_));
  terms_of_columns_ =
      contacts_.empty() && loaded_.empty()
          ? S(detail::terms_of_columns(links_, bodies_, least_inertias_, largest, unit))
          : S(no_body);  // P may be any
  for (int k = 0; k < nv(); ++k) {
    const RoundingWeights<S>& w = bodies_[k].weights;
    const double inertia =
        links_[k].slides ? largest[k].force : (largest[k].unbounded ? 0 : largest[k].moment);
    largest_inertias_.push_back(S(std::min(inertia, no_body)) + bodies_[k].r);
    weights_.insert(weights_.end(), {w.Axx, w.Ayy, w.Azz, w.Cxx, w.Cyy, w.Czz});
  }
}

template <class S>
template <class W>
void LoweredModel<S>::set_link(const Model<W>& model, const detail::LinkFrame<W>& frame, int k) {
  using std::sqrt;
  using Kind = typename LoweredLink<S>::Kind;
  using Tilt = typename LoweredLink<S>::Tilt;
  const Joint<W>& joint = model.joint(k);
  LoweredLink<S>& link = links_[k];
  LoweredBody<S>& body = bodies_[k];
  link.parent = joint.parent;
  link.slides = joint.slides;
  link.coordinate = joint.coordinate;
  link.q_index = joint.q_index;
  body.r = S(joint.r);
  link.has_noise = body.r != S(0);
  link.hangs_on_previous = joint.parent >= 0 && joint.parent == k - 1;
  if (joint.parent >= 0 && !link.hangs_on_previous) add_sum(links_[joint.parent]);
  link.kind = has_matrix(joint.coordinate)               ? Kind::matrix
              : joint.coordinate == Coordinate::follower ? Kind::cyclic
                                                         : Kind::screws;
  moves_[k] = {{Wider<S>(frame.gamma.c), Wider<S>(frame.gamma.s)}, Wider<S>(frame.shift)};
  link.p = frame.p.template cast<S>();
  link.turned = frame.theta.s != W(0) || frame.theta.c != W(1);
  link.aligned = link.hangs_on_previous && joint.coordinate == Coordinate::angle && !link.turned &&
                 link.p[2] == S(0);
  link.alpha = Turn<S>(S(frame.alpha.c), S(frame.alpha.s));
  link.tilt = zeros_ == Zeros::kept                           ? Tilt::any
              : frame.alpha.s == W(0) && frame.alpha.c > W(0) ? Tilt::none
              : frame.alpha.c == W(0)                         ? Tilt::right
                                                              : Tilt::any;
  const Direction<W> angle = detail::sum(frame.angle, frame.gamma);
  const W d = frame.d + frame.shift;
  link.d = S(joint.slides ? W(d - joint.ref) : d);
  const Vector3<W> along(W(0), -d * frame.alpha.s, d * frame.alpha.c);
  const Vector3<W> origin =
      joint.slides ? frame.p : Vector3<W>(frame.p + detail::about_z(frame.theta) * along);
  body.reach = S((joint.slides ? W(4) : W(2)) * origin.squaredNorm());
  if (joint.slides || link.turned || link.kind == Kind::matrix || joint.parent < 0) {
    link.uncommon = static_cast<int>(uncommon_.size());
    uncommon_.push_back({Turn<S>(S(angle.c), S(angle.s)),
                         Turn<S>(S(frame.theta.c), S(frame.theta.s)), frame.E.template cast<S>(),
                         (-(model.E(k).transpose() * model.gravity())).template cast<S>(),
                         model.E(k).template cast<S>(), joint.translation.template cast<S>()});
  }
  if (joint.coordinate == Coordinate::angle) {
    link.varying = angles();
    add_hinge(joint.q_index, angle, joint.ref);
  }
  if (link.kind == Kind::matrix) link.varying = matrices_++;

  const LinkInertia<W>& inertia = model.inertia(k);
  const Matrix3<W> back = detail::about_z(frame.gamma).transpose();
  const Vector3<W> com = back * (joint.body.com - frame.shift * Vector3<W>::UnitZ());
  const Vector3<W> h = joint.body.mass * com;
  const Matrix3<W> I_cm = back * inertia.I_cm * back.transpose();
  const Matrix3<W> I = I_cm - cross_matrix(h) * cross_matrix(com);
  link.massless = inertia.massless;
  body.m = S(joint.body.mass);
  for (int i = 0; i < 3; ++i) body.h[i] = S(h[i]);
  body.Ixx = S(I(0, 0));
  body.Ixy = S(I(0, 1));
  body.Ixz = S(I(0, 2));
  body.Iyy = S(I(1, 1));
  body.Iyz = S(I(1, 2));
  body.Izz = S(I(2, 2));
  const W half = I_cm.trace() / W(2);
  central_[k] = {body.m,
                 {S(com[0]), S(com[1]), S(com[2])},
                 S(half - I_cm(0, 0)),
                 S(-I_cm(0, 1)),
                 S(-I_cm(0, 2)),
                 S(half - I_cm(1, 1)),
                 S(-I_cm(1, 2)),
                 S(half - I_cm(2, 2))};
}

template <class S>
void LoweredModel<S>::set_runs() {
  for (int k = 0; k < nv();) {
    if (const int dofs = dofs_at_once(k)) {
      runs_.push_back({k, k + dofs - 1, true});
      k += dofs;
      continue;
    }
    if (runs_.empty() || runs_.back().at_once) runs_.push_back({k, k, false});
    runs_.back().last = k++;
  }
}

}  // namespace kalmarm

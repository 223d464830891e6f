// A model lowered once for the fast path: frames moved along and about the joint axes, which stay
// z, so that most numbers of phi(parent,k) become 0 or 1.
//
//   phi(parent,k) = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)       T: translation, R: rotation
// angle = q + offset + quarters of a turn at a hinge, d = q + offset at a slide; all else is
// constant. An angle of quarters alone is exact, and so is alpha where it is zero or a right angle:
// such links are marked. A link's frame may be turned about its axis and moved along it; this is
// spent on one child, the heir, so that there
//   theta = 0 and p = (a, 0, 0)
// as in modified Denavit-Hartenberg: the origin is the foot of the common perpendicular of the
// link's axis and its heir's.
// Where the axes are so near to parallel that the foot is farther away than twice the distance of
// the origins, the origin stays where it is and p = (a, b, 0). Other children keep theta and any p.
// The fixed base has a frame for each of its children: p = 0, theta = alpha = 0.
// Ball and free joints keep their frames: a matrix that depends on q, then two followers, whose phi
// is a cyclic permutation (model.hpp). Where no noise and no body is between their DoF, these are
// crossed at once (three_axes.hpp).
//
// Everything is worked out in a wider precision and rounded once.
#pragma once

#include <cmath>
#include <type_traits>
#include <vector>

#include "algorithms/model/model.hpp"
#include "algorithms/spatial/sincos.hpp"
#include "algorithms/structured/factored_body.hpp"

namespace kalmarm {

// A turn about a coordinate axis: cos and sin, which vectors need.
template <class T>
struct Direction {
  T c, s;
};

// The same, with sin^2 and sin cos for tensors.
template <class T>
struct Turn : Direction<T> {
  T ss, cs;

  Turn(const T& c, const T& s) : Direction<T>{c, s}, ss(s * s), cs(c * s) {}
};

// What few links need, kept apart so that long chains stay in the cache.
template <class S>
struct UncommonPlacement {
  Turn<S> turn{S(1), S(0)}, theta{S(1), S(0)};  // turn: Rz(angle) of a slide
  Matrix3<S> E = Matrix3<S>::Identity();        // matrix: the placement's rotation
  Vector3<S> a0 = Vector3<S>::Zero();           // child of the base: its acceleration, -gravity
};

// Of all hinges: their angle is q[q_index] + offset + quarters of a turn, 0 to 3.
template <class S>
struct HingeAngles {
  std::vector<int> q_index;
  std::vector<S> offset;
  std::vector<IntegerOf<S>> quarters;  // padded, as sin_cos takes them
};

// What only the inward sweep needs.
template <class S>
struct StructuredBody {
  S r = S(0), m = S(0);                                                      // joint noise, mass
  S h[3] = {S(0), S(0), S(0)};                                               // m c
  S Ixx = S(0), Ixy = S(0), Ixz = S(0), Iyy = S(0), Iyz = S(0), Izz = S(0);  // about the origin
  S reach = S(0);  // 2 |origin from the parent's|^2; of a slide 4 |p|^2, without its d
};

// What inverse dynamics needs, about the centre of mass.
template <class S>
struct CentralBody {
  S m, c[3];
  S Jxx, Jxy, Jxz, Jyy, Jyz, Jzz;  // integral of r r' dm = tr(I)/2 - I
};

template <class S>
struct StructuredLink {
  enum class Kind { screws, matrix, cyclic };
  enum class Tilt { none, right, any };  // alpha = 0, a right angle

  Kind kind = Kind::screws;
  Tilt tilt = Tilt::any;
  int parent = -1;
  bool slides = false, noise = false, massless = false, hangs_on_previous = false, turned = false;
  bool is_heir = false;  // at a hinge: theta = 0, p = (a, b, 0)
  int slot = -1;         // in the workspace, for links with a child other than k + 1; else -1
  int q_index = 0;       // of the joint's first coordinate
  Coordinate coordinate = Coordinate::angle;
  int varying = -1;   // of the joint's angle in HingeAngles, or of its matrix
  int uncommon = -1;  // of its UncommonPlacement

  S d = S(0);  // of a slide: what is added to q
  Turn<S> alpha{S(1), S(0)};
  Vector3<S> p = Vector3<S>::Zero();
};

// Links that are crossed one by one, or the three or six DoF of a joint that is crossed at once.
struct LinkRun {
  int first, last;
  bool at_once;
};

// What a model does of angles that are zero or right (zero_terms.hpp): kept is to compare.
enum class Zeros { left_out, kept };

template <class S>
class StructuredModel {
 public:
  template <class Given>
  explicit StructuredModel(const Model<Given>& model, Zeros zeros = Zeros::left_out)
      : zeros_(zeros),
        nq_(model.nq()),
        links_(model.nv()),
        bodies_(model.nv()),
        factored_(model.nv()),
        central_(model.nv()),
        moves_(model.nv()) {
    // A float's tilt of 1e-16 is no rounding yet, which in double it could be.
    using Next = Wider<Given>;
    lower(
        model.template cast<std::conditional_t<std::is_same_v<Given, float>, Wider<Next>, Next>>());
  }

  int nv() const { return static_cast<int>(links_.size()); }
  int nq() const { return nq_; }
  int angles() const { return static_cast<int>(hinges_.q_index.size()); }
  int matrices() const { return matrices_; }  // of ball joints, and of positions of free joints
  int slots() const { return slots_; }
  const HingeAngles<S>& hinges() const { return hinges_; }
  const std::vector<LinkRun>& runs() const { return runs_; }
  const StructuredLink<S>& link(int k) const { return links_[k]; }
  const StructuredBody<S>& body(int k) const { return bodies_[k]; }
  const FactoredBody<S>& factored(int k) const { return factored_[k]; }
  const CentralBody<S>& central(int k) const { return central_[k]; }
  const UncommonPlacement<S>& uncommon(const StructuredLink<S>& link) const {
    return uncommon_[link.uncommon];
  }

  // phi from a frame on link k to the link, whose own frame has gone from that of Model to here.
  Transform<S> phi_on_link(int k, const Transform<Wider<S>>& phi) const {
    const Move& move = moves_[k];
    const Matrix3<Wider<S>> back = about_z(move.gamma).transpose();
    const Vector3<Wider<S>> p = back * (phi.p - move.shift * Vector3<Wider<S>>::UnitZ());
    return {Matrix3<Wider<S>>(back * phi.R).template cast<S>(), p.template cast<S>()};
  }

 private:
  // Of a link's frame: Rz(gamma) T(0,0,shift).
  struct Move {
    Direction<Wider<S>> gamma{Wider<S>(1), Wider<S>(0)};
    Wider<S> shift = Wider<S>(0);
  };

  // Where link k's frame goes from that of Model: Rz(gamma) T(0,0,shift); and its placement there.
  template <class W>
  struct Frame {
    Direction<W> gamma{W(1), W(0)}, theta = gamma, alpha = gamma, angle = gamma;
    W shift = W(0), d = W(0);
    Vector3<W> p = Vector3<W>::Zero();
    Matrix3<W> E = Matrix3<W>::Identity();

    // phi(parent,k) at q = ref, in the parent's new frame.
    void place(const Matrix3<W>& rotation, const Vector3<W>& translation) {
      using std::sqrt;
      E = without_rounding(rotation);
      p = translation;
      alpha = {E(2, 2), sqrt(E(0, 2) * E(0, 2) + E(1, 2) * E(1, 2))};
      theta = direction_of(W(-E(1, 2)), E(0, 2));
      const Matrix3<W> rest = about_z(theta).transpose() * E;  // Rx(alpha) Rz(angle)
      angle = direction_of(rest(0, 0), W(-rest(0, 1)));
    }
  };

  // What is rounding alone would become subnormal where it is multiplied with itself.
  template <class W>
  static Matrix3<W> without_rounding(const Matrix3<W>& R) {
    using std::abs;
    const W resolution = W(16) * unit_roundoff<W>();
    return R.unaryExpr([&](const W& x) { return abs(x) > resolution ? x : W(0); });
  }

  // Of (x, y); (1, 0) where that is zero.
  template <class W>
  static Direction<W> direction_of(const W& x, const W& y) {
    using std::sqrt;
    const W length = sqrt(x * x + y * y);
    if (length == W(0)) return {W(1), W(0)};
    return {x / length, y / length};
  }

  template <class W>
  static Direction<W> sum(const Direction<W>& a, const Direction<W>& b) {
    return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s};
  }

  template <class W>
  static int nearest_quarters(const Direction<W>& angle) {
    using std::abs;
    if (abs(angle.c) >= abs(angle.s)) return angle.c < W(0) ? 2 : 0;
    return angle.s < W(0) ? 3 : 1;
  }

  // The angle of a hinge from q on, when it is `angle` at q = ref.
  template <class W>
  void add_hinge(int q_index, const Direction<W>& angle, const W& ref) {
    using std::atan2;
    static constexpr int cos[] = {1, 0, -1, 0};
    const int quarters = nearest_quarters(angle);
    const Direction<W> rest = sum(angle, {W(cos[quarters]), W(-cos[(quarters + 3) % 4])});
    const auto i = hinges_.q_index.size();
    hinges_.q_index.push_back(q_index);
    hinges_.offset.push_back(S(atan2(rest.s, rest.c) - ref));
    if (i % padding<S> == 0) hinges_.quarters.resize(i + padding<S>);
    hinges_.quarters[i] = quarters;
  }

  template <class W>
  static Matrix3<W> about_z(const Direction<W>& by) {
    Matrix3<W> R;
    R << by.c, -by.s, W(0), by.s, by.c, W(0), W(0), W(0), W(1);
    return R;
  }

  static bool has_matrix(const Coordinate& coordinate) {
    return coordinate == Coordinate::quaternion || coordinate == Coordinate::position;
  }
  static bool on_a_screw(const Coordinate& coordinate) {
    return coordinate == Coordinate::angle || coordinate == Coordinate::distance;
  }

  // Link k is its parent's heir: the parent's frame is turned and moved so that theta = 0 and p has
  // no z, and no y where the foot of the common perpendicular is near.
  template <class W>
  static void inherit(Frame<W>& parent, Frame<W>& frame, const Matrix3<W>& E, const Vector3<W>& d) {
    using std::abs;
    using std::sqrt;
    frame.place(E, d);
    const W sin_alpha = frame.alpha.s, cos_alpha = frame.alpha.c;
    const bool parallel = sin_alpha == W(0);
    parent.gamma = parallel ? direction_of(d[0], d[1]) : frame.theta;
    const Matrix3<W> back = about_z(parent.gamma).transpose();
    frame.place(back * E, back * d);
    frame.theta = {W(1), W(0)};

    // p = (a, b, 0) + d (0, -sin alpha, cos alpha) + (0, 0, shift)
    W y = frame.p[1], z = frame.p[2];
    if (parallel) y = W(0);
    const W farthest = W(2) * sqrt(d.squaredNorm());
    frame.d = z / cos_alpha;
    if (!parallel) {
      const W foot = -y / sin_alpha, shift = z - foot * cos_alpha;
      if (abs(foot) <= farthest && abs(shift) <= farthest) {
        frame.d = foot;
        parent.shift = shift;
        y = -sin_alpha * foot;
      }
    }
    frame.p << frame.p[0], parallel ? W(0) : W(y + sin_alpha * frame.d), W(0);
  }

  template <class W>
  void lower(const Model<W>& model) {
    std::vector<Frame<W>> frames(model.nv());
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<W>& joint = model.joint(k);
      Frame<W>& frame = frames[k];
      if (joint.parent < 0 || joint.coordinate == Coordinate::follower) continue;
      Frame<W>& parent = frames[joint.parent];
      if (joint.parent == k - 1 && on_a_screw(joint.coordinate) &&
          on_a_screw(model.joint(k - 1).coordinate)) {
        inherit(parent, frame, model.E(k), joint.translation);
      } else {
        const Matrix3<W> back = about_z(parent.gamma).transpose();
        const Vector3<W> d = joint.translation - parent.shift * Vector3<W>::UnitZ();
        frame.place(back * model.E(k), back * d);
      }
    }
    for (int k = 0; k < model.nv(); ++k) set_link(model, frames[k], k);
    set_runs();
    for (int k = model.nv() - 1; k >= 0; --k) {
      if (links_[k].parent < 0) continue;
      FactoredBody<S>& parent = factored_[links_[k].parent];
      parent.outboard_mass += factored_[k].outboard_mass;
      parent.outboard_spin += factored_[k].outboard_spin;
    }
  }

  // Whether DoF k is the first of three about, or along, the axes of one joint, between which there
  // is nothing else.
  bool is_one_joint(int k) const {
    for (int i = k; i < k + 3; ++i) {
      const StructuredLink<S>& link = links_[i];
      if (link.noise || (i > k && link.coordinate != Coordinate::follower)) return false;
      if (i < k + 2 && (!link.massless || link.slot >= 0)) return false;
    }
    return true;
  }

  // How many DoF from k on are crossed at once: six of a free joint, three of a ball joint, or
  // none.
  int dofs_at_once(int k) const {
    const auto begins = [this](int first, Coordinate coordinate) {
      return first + 3 <= nv() && links_[first].coordinate == coordinate && is_one_joint(first);
    };
    if (begins(k, Coordinate::quaternion)) return 3;
    const bool is_free = begins(k, Coordinate::position) && begins(k + 3, Coordinate::quaternion) &&
                         links_[k + 2].massless && links_[k + 2].slot < 0 &&
                         links_[k + 3].parent == k + 2 && links_[k + 3].p.isZero(S(0));
    return is_free ? 6 : 0;
  }

  void set_runs() {
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

  template <class W>
  void set_link(const Model<W>& model, const Frame<W>& frame, int k) {
    using std::sqrt;
    using Kind = typename StructuredLink<S>::Kind;
    using Tilt = typename StructuredLink<S>::Tilt;
    const Joint<W>& joint = model.joint(k);
    StructuredLink<S>& link = links_[k];
    StructuredBody<S>& body = bodies_[k];
    link.parent = joint.parent;
    link.slides = joint.slides;
    link.coordinate = joint.coordinate;
    link.q_index = joint.q_index;
    body.r = S(joint.r);
    link.noise = body.r != S(0);
    link.hangs_on_previous = joint.parent >= 0 && joint.parent == k - 1;
    if (joint.parent >= 0 && !link.hangs_on_previous && links_[joint.parent].slot < 0)
      links_[joint.parent].slot = slots_++;
    link.kind = has_matrix(joint.coordinate)               ? Kind::matrix
                : joint.coordinate == Coordinate::follower ? Kind::cyclic
                                                           : Kind::screws;
    moves_[k] = {{Wider<S>(frame.gamma.c), Wider<S>(frame.gamma.s)}, Wider<S>(frame.shift)};
    link.p = frame.p.template cast<S>();
    link.turned = frame.theta.s != W(0) || frame.theta.c != W(1);
    link.is_heir = link.hangs_on_previous && joint.coordinate == Coordinate::angle &&
                   !link.turned && link.p[2] == S(0);
    link.alpha = Turn<S>(S(frame.alpha.c), S(frame.alpha.s));
    link.tilt = zeros_ == Zeros::kept                           ? Tilt::any
                : frame.alpha.s == W(0) && frame.alpha.c > W(0) ? Tilt::none
                : frame.alpha.c == W(0)                         ? Tilt::right
                                                                : Tilt::any;
    const Direction<W> angle = sum(frame.angle, frame.gamma);
    const W d = frame.d + frame.shift;
    link.d = S(joint.slides ? W(d - joint.ref) : d);
    const Vector3<W> along(W(0), -d * frame.alpha.s, d * frame.alpha.c);
    const Vector3<W> origin =
        joint.slides ? frame.p : Vector3<W>(frame.p + about_z(frame.theta) * along);
    body.reach = S((joint.slides ? W(4) : W(2)) * origin.squaredNorm());
    factored_[k].length = S(sqrt(origin.squaredNorm()));
    if (joint.slides || link.turned || link.kind == Kind::matrix || joint.parent < 0) {
      link.uncommon = static_cast<int>(uncommon_.size());
      uncommon_.push_back({Turn<S>(S(angle.c), S(angle.s)),
                           Turn<S>(S(frame.theta.c), S(frame.theta.s)), frame.E.template cast<S>(),
                           (-(model.E(k).transpose() * model.gravity())).template cast<S>()});
    }
    if (joint.coordinate == Coordinate::angle) {
      link.varying = angles();
      add_hinge(joint.q_index, angle, joint.ref);
    }
    if (link.kind == Kind::matrix) link.varying = matrices_++;

    const LinkInertia<W>& inertia = model.inertia(k);
    const Matrix3<W> back = about_z(frame.gamma).transpose();
    const Vector3<W> com = back * (joint.body.com - frame.shift * Vector3<W>::UnitZ());
    const Vector3<W> h = joint.body.mass * com;
    const Matrix3<W> I_cm = back * inertia.I_cm * back.transpose();
    const Matrix3<W> I = I_cm - cross_matrix(h) * cross_matrix(com);
    link.massless = inertia.massless;
    factor_body(joint.body.mass, com, Matrix3<W>(back * rotation(joint.body.axes)),
                joint.body.moments, factored_[k]);
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

  Zeros zeros_;
  int nq_, matrices_ = 0, slots_ = 0;
  HingeAngles<S> hinges_;
  std::vector<StructuredLink<S>> links_;
  std::vector<StructuredBody<S>> bodies_;
  std::vector<FactoredBody<S>> factored_;  // the same bodies, for the square-root form
  std::vector<CentralBody<S>> central_;    // and for inverse dynamics
  std::vector<UncommonPlacement<S>> uncommon_;
  std::vector<Move> moves_;
  std::vector<LinkRun> runs_;
};

}  // namespace kalmarm

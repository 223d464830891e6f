#include "accuracy/adversary/genome.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace kalmarm::adversary {
namespace {

using Vec3 = Vector3<double>;
using Quaternion = Eigen::Quaternion<double>;

constexpr int body_genes = 20, global_genes = 3, dof_genes = 3;
constexpr double pi = std::numbers::pi;

enum class Type { hinge, slide, ball, free };

double power(double u, double low, double high) { return std::pow(10, low + (high - low) * u); }
double sign_of(double u) { return u < 0.5 ? -1 : 1; }
double angle(double u) { return pi * (2 * u - 1); }

Quaternion about_x(double a) { return {std::cos(a / 2), std::sin(a / 2), 0, 0}; }
Quaternion about_z(double a) { return {std::cos(a / 2), 0, 0, std::sin(a / 2)}; }

// Reads one number after another.
class Reader {
 public:
  Reader(const std::vector<double>& x, std::size_t at) : x_(x), at_(at) {}

  double next() { return x_[at_++]; }

  // The first `share` of the range chooses a special value; else the number is spread again.
  bool special(double share) {
    const double u = next();
    rest_ = u < share ? u / share : (u - share) / (1 - share);
    return u < share;
  }
  double rest() const { return rest_; }

  // 0 in the given share, else 10^U(low, high).
  double length(double none, double low, double high) {
    return special(none) ? 0 : power(rest_, low, high);
  }

  Vec3 direction() {
    const bool axis = special(0.6);
    const double u = rest_, v = next();
    if (axis) return sign_of(v) * Vec3::Unit(std::min(2, static_cast<int>(3 * u)));
    const double z = 1 - 2 * u, r = std::sqrt(std::max(0.0, 1 - z * z));
    return {r * std::cos(angle(v)), r * std::sin(angle(v)), z};
  }

  // From the parent's axes to the link's.
  Quaternion turn() {
    const double kind = next(), u = next();
    const double tilt = kind < 0.3   ? 0
                        : kind < 0.5 ? sign_of(u) * pi / 2
                        : kind < 0.7 ? power(u, -8, -1)
                                     : angle(u);
    const double about = special(0.4) ? 0 : angle(rest_);
    return (about_z(about) * about_x(tilt)).normalized();
  }

  Quaternion orientation() {
    const double a = angle(next()), b = angle(next()), c = angle(next());
    return (about_z(a) * about_x(b) * about_z(c)).normalized();
  }

 private:
  const std::vector<double>& x_;
  std::size_t at_;
  double rest_ = 0;
};

struct Body {
  int parent = -1;  // body
  Type type = Type::hinge;
  Joint<double> joint;      // of its first DoF; the rest is the same for all
  RigidBody<double> rigid;  // outboard of its last
  int slot = 0;             // of its first DoF among the numbers of the state

  int dofs() const { return type == Type::free ? 6 : type == Type::ball ? 3 : 1; }
};

RigidBody<double> read_rigid(Reader& read) {
  RigidBody<double> out;
  out.mass = power(read.next(), -8, 8);
  const double distance = read.length(0.25, -3, 3);
  out.com = distance * read.direction();
  const double kind = read.next(), rho = power(read.next(), -4, 3);
  Vec3 second(1, power(read.next(), -4, 0), power(read.next(), -4, 0));
  if (kind < 0.2) second.setZero();
  if (kind >= 0.2 && kind < 0.35) second = {1, 0, 0};
  for (int i = 0; i < 3; ++i)
    out.moments[i] = out.mass * rho * rho * (second[(i + 1) % 3] + second[(i + 2) % 3]);
  const bool aligned = read.special(0.5);
  const double a = angle(read.rest()), b = angle(read.next()), c = angle(read.next());
  if (!aligned) out.axes = (about_z(a) * about_x(b) * about_z(c)).normalized();
  return out;
}

Type type_of(double u, bool first, Kernel kernel) {
  if (kernel == Kernel::translational) return Type::slide;
  if (first && u >= 0.95) return Type::free;
  return u < 0.65 ? Type::hinge : u < 0.85 ? Type::slide : Type::ball;
}

// before: the bodies up to it
Body read_body(Reader& read, const std::vector<Body>& before, Kernel kernel) {
  const int index = static_cast<int>(before.size());
  Body out;
  const bool chained = read.special(0.75);
  if (index > 0)
    out.parent = chained ? index - 1 : std::min(index - 1, static_cast<int>(read.rest() * index));
  out.type = type_of(read.next(), index == 0, kernel);
  out.rigid = read_rigid(read);
  const double offset = read.length(0.25, -3, 3);
  out.joint.translation = offset * read.direction();
  out.joint.rotation = read.turn();
  out.joint.r = read.length(0.7, -6, 6);
  return out;
}

std::vector<Body> read_bodies(const Genome& genome, Kernel kernel) {
  std::vector<Body> out;
  int dofs = 0;
  for (int i = 0; i < genome.bodies; ++i) {
    Reader read(genome.x, static_cast<std::size_t>(i) * body_genes);
    Body body = read_body(read, out, kernel);
    const int later = genome.bodies - i - 1;
    if (dofs + body.dofs() + later > most_dofs) body.type = Type::hinge;
    body.slot = dofs;
    dofs += body.dofs();
    out.push_back(body);
  }
  return out;
}

// Joints as the loader makes them, and of each DoF its slot.
class Assembly {
 public:
  // Depth first, as MuJoCo numbers.
  explicit Assembly(const std::vector<Body>& bodies) {
    std::vector<int> links(bodies.size()), todo = {0};
    while (!todo.empty()) {
      const int i = todo.back();
      const Body& body = bodies[i];
      todo.pop_back();
      links[i] = add(body, body.parent < 0 ? -1 : links[body.parent],
                     std::string("j").append(std::to_string(i)));
      for (int child = static_cast<int>(bodies.size()) - 1; child > i; --child)
        if (bodies[child].parent == i) todo.push_back(child);
    }
  }

  std::vector<Joint<double>> joints;
  std::vector<std::string> names;
  std::vector<int> slots;
  int nq = 0;

 private:
  // Returns its last link.
  int add(const Body& body, int link, const std::string& name) {
    Joint<double> first = body.joint;
    first.parent = link;
    switch (body.type) {
      case Type::hinge:
        add_dof(first, name, body.slot);
        break;
      case Type::slide:
        first.slides = true;
        first.coordinate = Coordinate::distance;
        add_dof(first, name, body.slot);
        break;
      case Type::ball:
        first.coordinate = Coordinate::quaternion;
        add_three(first, name, body.slot);
        break;
      case Type::free: {
        Joint<double> slide;
        slide.r = first.r;
        slide.slides = true;
        slide.coordinate = Coordinate::position;
        add_three(slide, name, body.slot);
        Joint<double> turn;
        turn.parent = static_cast<int>(joints.size()) - 1;
        turn.r = first.r;
        turn.coordinate = Coordinate::quaternion;
        add_three(turn, name + ":r", body.slot + 3);
        break;
      }
    }
    joints.back().body = body.rigid;
    return static_cast<int>(joints.size()) - 1;
  }

  void add_three(const Joint<double>& first, const std::string& name, int slot) {
    add_dof(first, name + ":x", slot);
    for (int i = 1; i < 3; ++i) {
      Joint<double> follower;
      follower.parent = static_cast<int>(joints.size()) - 1;
      follower.slides = first.slides;
      follower.coordinate = Coordinate::follower;
      follower.rotation = {0.5, 0.5, 0.5, 0.5};
      follower.q_index = joints.back().q_index;
      follower.r = first.r;
      add_dof(follower, name + (i == 1 ? ":y" : ":z"), slot + i);
    }
  }

  void add_dof(Joint<double> joint, const std::string& name, int slot) {
    if (joint.coordinate != Coordinate::follower)
      joint.q_index = std::exchange(nq, nq + q_entries(joint.coordinate));
    joints.push_back(joint);
    names.push_back(name);
    slots.push_back(slot);
  }
};

double read_angle(double u) {
  if (u < 0.15) return 0;
  if (u < 0.45) {
    const double choice = 9 * std::fmod(u - 0.15, 0.15) / 0.15, turns = std::floor(choice);
    const double at = (turns - 4) * (pi / 2);
    if (u < 0.3) return at;
    const double side = 2 * (choice - turns) - 1;
    return at + std::copysign(power(std::abs(side), -8, -1), side);
  }
  if (u < 0.6) return power((u - 0.45) / 0.15, -8, 0);
  return angle((u - 0.6) / 0.4);
}

// 0 in the middle share, else +- 10^U(low, high).
double read_signed(double u, double none, double low, double high) {
  const double y = 2 * u - 1, size = std::abs(y);
  return size < none ? 0 : std::copysign(power((size - none) / (1 - none), low, high), y);
}

}  // namespace

int length_of(int bodies) { return body_genes * bodies + global_genes + dof_genes * most_dofs; }

Mechanism decode(const Genome& genome, Kernel kernel) {
  assert(genome.bodies >= 1 && genome.bodies <= most_dofs);
  assert(static_cast<int>(genome.x.size()) == length_of(genome.bodies));
  const std::vector<Body> bodies = read_bodies(genome, kernel);
  Assembly assembly(bodies);
  const std::size_t globals = static_cast<std::size_t>(genome.bodies) * body_genes;
  Reader read(genome.x, globals);
  const bool weightless = read.special(0.25);
  const double moving = read.length(0.3, -3, 3), torque = read.length(0.15, -6, 6);
  const double velocity = kernel == Kernel::spatial_at_rest ? 0 : moving;

  Mechanism out;
  out.model = {assembly.joints, assembly.names, assembly.nq, Vec3(0, 0, weightless ? 0 : -9.81)};
  const int nv = out.model.nv();
  State& state = out.state;
  state.q = VectorX<double>::Zero(out.model.nq());
  state.qd = state.tau = VectorX<double>::Zero(nv);
  const auto gene = [&](int k, int which) {
    return globals + global_genes + static_cast<std::size_t>(which * most_dofs + assembly.slots[k]);
  };
  for (int k = 0; k < nv; ++k) {
    const Joint<double>& joint = out.model.joint(k);
    const int i = joint.q_index;
    switch (joint.coordinate) {
      case Coordinate::angle:
        state.q[i] = read_angle(genome.x[gene(k, 0)]);
        break;
      case Coordinate::distance:
        state.q[i] = read_signed(genome.x[gene(k, 0)], 0.2, -3, 3);
        break;
      case Coordinate::quaternion: {
        const Quaternion at = Reader(genome.x, gene(k, 0)).orientation();
        state.q.segment<4>(i) << at.w(), at.x(), at.y(), at.z();
        break;
      }
      case Coordinate::position:
        for (int j = 0; j < 3; ++j)
          state.q[i + j] = read_signed(genome.x[gene(k, 0) + j], 0.2, -3, 3);
        break;
      case Coordinate::follower:
        break;
    }
    state.qd[k] = velocity * (2 * genome.x[gene(k, 1)] - 1);
    state.tau[k] = torque * read_signed(genome.x[gene(k, 2)], 0.1, -8, 8);
  }
  return out;
}

}  // namespace kalmarm::adversary

// The test for singular mechanisms (singularity.hpp) as two more scans, of D, g, P+ and psi that the
// filter's scans have left.
//
// First look: is D(k) small beside the outboard side stretched out? With d_i the length of the way from
// the body i to the joint's origin, whatever its direction,
//   m = sum m_i,   F = sum m_i d_i,   J = sum m_i d_i^2
// and moved by a way of length L they are
//   m,   F + L m,   J + 2 L F + L^2 m                                                      (1)
// so that lengths add up along a path. A body alone has J = tr(I) / 2 and F = sqrt(m J). This J is at
// most that of polar_moment.hpp, whose squares do not compose: it has F = sqrt(m J) everywhere. A
// suspect is looked at, no more, and the limit for suspects is at least 8 times that of the second look.
//
// Second look: S of singularity.hpp, with P- = P+ + D g g' of the filter,
//   S-(k) = M(k) + sum over children c of phi(k,c) S+(c) phi'(k,c) + E(c)
//   S+(k) = (I - gH) S- (I - gH)' + P-
// so that of a block, with psi from c+ to its root m+ as in scan.hpp,
//   S+(m) = psi S+(c) psi' + S°(m)                       S°: with S+(c) = 0                (2)
//   H S- H' = n' S+(c) n + H S°- H',   n = H psi(k-,c+)  of a link on the path             (3)
// P is right to what S says of its rounding as far as the first D that is lost, tips to base.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/study/inverse_mass/singularity.hpp"
#include "algorithms/study/scan/blocks.hpp"
#include "algorithms/study/scan/tasks.hpp"

namespace kalmarm::scan {

template <class T>
struct Stretched {
  T m = T(0), F = T(0), J = T(0);

  Stretched() = default;
  explicit Stretched(const SpatialInertia<T>& M) : m(M.m), J(M.I.trace() / T(2)) {
    using std::sqrt;
    F = sqrt(m * J);
  }

  // (1) of what is outboard.
  void add(const Stretched& outboard, const T& L) {
    m += outboard.m;
    F += outboard.F + L * outboard.m;
    J += outboard.J + L * (T(2) * outboard.F + L * outboard.m);
  }

  T size(const Joint<T>& joint) const { return (joint.slides ? m : J) + joint.r; }
};

enum class Look { clear, suspect, lost };

template <class T>
class SingularityScan {
 public:
  SingularityScan(const Model<T>& model, const Blocks& blocks)
      : stretched_(model.nv()),
        scale_(model.nv()),
        S_(model.nv()),
        runs_(blocks.nodes().size()),
        found_(blocks.blocks().size(), {Look::clear, NearestToSingular<T>(1)}) {
    bodies_.reserve(model.nv());
    for (int k = 0; k < model.nv(); ++k) bodies_.emplace_back(model.M(k));
  }

  // lost: some D is not positive; suspect: some D may be rounding, of a form of that order.
  Look first_look(const Model<T>& model, const LinkKinematics<T>& kin, const std::vector<T>& D,
                  int order, const Blocks& blocks, Tasks<T>& tasks) {
    const T least = least_D_over_size<T>(order);
    for (const Height& height : blocks.heights()) {
      tasks.run(height.blocks, [&](int i) {
        const Block& block = blocks.blocks()[i];
        stretch(model, kin, block, nullptr);
        runs_[block.node].x = stretched_[block.root()];
        runs_[block.node].length = length(kin, block);
      });
      scan_stretched(height, blocks, tasks);
      tasks.run(height.blocks, [&](int i) {
        const Block& block = blocks.blocks()[i];
        if (block.open()) stretch(model, kin, block, &runs_[block.node].x_in);
        Look& look = found_[i].look;
        look = Look::clear;
        for (const int k : block.links) {
          if (!(D[k] > least * stretched_[k].size(model.joint(k))) && look == Look::clear)
            look = Look::suspect;
          if (!(D[k] > T(0))) look = Look::lost;
        }
      });
    }
    return worst();
  }

  // No outcome where some D <= least S; else ok, with a warning where one is nearly lost. `none` has
  // seen no joint yet. The workspace is that of the filter's scans.
  template <class Workspace>
  std::optional<Outcome> second_look(const Model<T>& model, const LinkKinematics<T>& kin,
                                     const T& least, const NearestToSingular<T>& none,
                                     Workspace& ws) {
    const std::vector<Block>& blocks = ws.blocks.blocks();
    for (const Height& height : ws.blocks.heights()) {
      ws.tasks.run(height.blocks, [&](int i) {
        add_up(model, kin, blocks[i], ws.factors);
        runs_[blocks[i].node].S = S_[blocks[i].root()];
      });
      scan_sizes(height, ws);
      ws.tasks.run(height.open_blocks,
                   [&](int i) { add_incoming(blocks[i], ws.reach[i].forces, ws); });
      ws.tasks.run(height.blocks, [&](int i) {
        Found& found = found_[i] = Found{Look::clear, none};
        for (const int k : blocks[i].links) {
          const T D = ws.factors.D[k];
          if (!(D > least * scale_[k])) found.look = Look::lost;
          found.nearest.see(k, D, scale_[k]);
        }
      });
    }
    if (worst() == Look::lost) return std::nullopt;
    NearestToSingular<T> nearest = none;
    for (const Found& found : found_) nearest.see(found.nearest);
    Outcome out = nearest.warning();
    out.rung = Outcome::Rung::refined;
    return out;
  }

  // What D(k) was compared with: by the first look, and S- + r of the second.
  const Stretched<T>& stretched(int k) const { return stretched_[k]; }
  const T& scale(int k) const { return scale_[k]; }

 private:
  // Of a node of the trees: a run of blocks.
  struct Run {
    T length = T(0);  // of the way from the port outboard to the root
    Stretched<T> x, x_in;
    Matrix6<T> S, S_in;  // S+
  };
  struct Found {  // in a block
    Look look;
    NearestToSingular<T> nearest;
  };

  Look worst() const {
    Look out = Look::clear;
    for (const Found& found : found_) out = std::max(out, found.look);
    return out;
  }

  static T length(const Transform<T>& phi) {
    using std::sqrt;
    return sqrt(phi.p.squaredNorm());
  }

  static T length(const LinkKinematics<T>& kin, const Block& block) {
    if (!block.open()) return T(0);
    T out = length(kin.phi[block.child]);
    for (std::size_t j = 0; j + 1 < block.ends.size(); ++j)
      out += length(kin.phi[block.links[block.ends[j] - 1]]);
    return out;
  }

  // (1) of a block's links, with x_in at its tip if there is one.
  void stretch(const Model<T>& model, const LinkKinematics<T>& kin, const Block& block,
               const Stretched<T>* x_in) {
    for (const int k : block.links) stretched_[k] = bodies_[k];
    for (const Block::Attached& light : block.attached)
      stretched_[block.links[light.position]].add(stretched_[light.child],
                                                  length(kin.phi[light.child]));
    if (x_in) stretched_[block.tip()].add(*x_in, length(kin.phi[block.child]));
    for (std::size_t i = 0; i + 1 < block.links.size(); ++i) {
      const int k = block.links[i];
      stretched_[model.parent(k)].add(stretched_[k], length(kin.phi[k]));
    }
  }

  void scan_stretched(const Height& height, const Blocks& blocks, Tasks<T>& tasks) {
    const std::vector<Node>& nodes = blocks.nodes();
    tasks.run_upwards(height.inner_nodes, [&](int i) {
      const Run &outer = runs_[nodes[i].left], &inner = runs_[nodes[i].right];
      runs_[i].x = inner.x;
      runs_[i].x.add(outer.x, inner.length);
      runs_[i].length = inner.length + outer.length;
    });
    tasks.run_downwards(height.inner_nodes, [&](int i) {
      Run &outer = runs_[nodes[i].left], &inner = runs_[nodes[i].right];
      inner.x_in = outer.x;
      if (!nodes[i].has_outboard) return;
      outer.x_in = runs_[i].x_in;
      inner.x_in.add(runs_[i].x_in, outer.length);
    });
  }

  // S°- + r of a block's links, and their S°+.
  template <class Factors>
  void add_up(const Model<T>& model, const LinkKinematics<T>& kin, const Block& block,
              const Factors& f) {
    for (const int k : block.links) S_[k] = model.M(k).matrix();
    for (const Block::Attached& light : block.attached)
      add_child(kin.phi[light.child], S_[light.child], covariance(light.child, f),
                S_[block.links[light.position]]);
    if (block.open())
      add_rounding(kin.phi[block.child], covariance(block.child, f), S_[block.tip()]);
    for (const int k : block.links) {
      const int h = model.joint(k).axis();
      Matrix6<T>& S = S_[k];
      scale_[k] = S(h, h) + model.joint(k).r;
      if (model.parent(k) < 0) continue;
      const Matrix6<T> P = covariance(k, f);
      const Vector6<T>& g = f.g[k];
      const T kept = T(1) - g[h];
      const Vector6<T> row = S.row(h);  // (I - gH) S, then that by (I - gH)'
      S.noalias() -= g * row.transpose();
      S.row(h) = kept * row.transpose();
      const Vector6<T> column = S.col(h);
      S.noalias() -= column * g.transpose();
      S.col(h) = kept * column;
      S += P;
      S.noalias() += Vector6<T>(f.D[k] * g) * g.transpose();
      if (k != block.root()) add_child(kin.phi[k], S, P, S_[model.parent(k)]);
    }
  }

  // (3) of the first `count` links of a block, and (2).
  template <class Workspace>
  void add_incoming(const Block& block, int count, const Workspace& ws) {
    const Matrix6<T>& S_in = runs_[block.node].S_in;
    for (const int end : block.ends) {
      if (end > count) break;
      const int k = block.links[end - 1];
      scale_[k] += ws.n[k].dot(S_in * ws.n[k]);
    }
    add_remembered(ws.runs[block.node], S_in, S_[block.root()]);
  }

  // S-(parent) += phi S+ phi' + E.
  static void add_child(const Transform<T>& phi, const Matrix6<T>& S_plus, const Matrix6<T>& P_plus,
                        Matrix6<T>& S) {
    S += phi.congruence(S_plus);
    add_rounding(phi, P_plus, S);
  }

  // S-(parent) += E.
  static void add_rounding(const Transform<T>& phi, const Matrix6<T>& P_plus, Matrix6<T>& S) {
    const Matrix6<T> phi_abs = phi.matrix().cwiseAbs();
    const Matrix6<T> sums = phi_abs * P_plus.cwiseAbs();
    S.diagonal() += sums.cwiseProduct(phi_abs).rowwise().sum();
  }

  template <class Factors>
  static Matrix6<T> covariance(int k, const Factors& f) {
    Matrix6<T> P;
    for (int j = 0; j < 6; ++j)
      P.col(j) = Factors::Update::P_plus_times(k, Vector6<T>(Vector6<T>::Unit(j)), f.update);
    return P;
  }

  // (2).
  template <class Workspace>
  void scan_sizes(const Height& height, Workspace& ws) {
    const std::vector<Node>& nodes = ws.blocks.nodes();
    ws.tasks.run_upwards(height.inner_nodes, [&](int i) {
      const Node& node = nodes[i];
      if (!node.has_inboard) return;
      runs_[i].S = runs_[node.right].S;
      add_remembered(ws.runs[node.right], runs_[node.left].S, runs_[i].S);
    });
    ws.tasks.run_downwards(height.inner_nodes, [&](int i) {
      const Node& node = nodes[i];
      if (node.has_outboard) runs_[node.left].S_in = runs_[i].S_in;
      runs_[node.right].S_in = runs_[node.left].S;
      add_remembered(ws.runs[node.left], runs_[i].S_in, runs_[node.right].S_in);
    });
  }

  // S += psi S_in psi'.
  template <class Transition>
  static void add_remembered(const Transition& run, const Matrix6<T>& S_in, Matrix6<T>& S) {
    if (run.closed) return;
    const Matrix6<T> remembered = run.psi * S_in;
    S.noalias() += remembered * run.psi.transpose();
  }

  std::vector<Stretched<T>> stretched_, bodies_;  // of the outboard side, of the link alone
  std::vector<T> scale_;
  std::vector<Matrix6<T>> S_;  // S- until the joint is passed, S+ after
  std::vector<Run> runs_;      // by node
  std::vector<Found> found_;   // by block
};

}  // namespace kalmarm::scan

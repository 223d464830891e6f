// The filter as a scan: parallel in the links.
//
// Blocks of links (blocks.hpp) run the sequential filter and smoother, all at once; what they do not
// know is what comes in at their ports. Every block is an element of an associative operation
// (covariance_element.hpp), and the elements of a path are combined up a tree of blocks; down the
// tree goes what comes in at every port. Tips to base, of P alone:
//   D°, g°, P° of every block with X = 0; its element (A, C, J)                            (1)
//   X = P+(c) of every block's child c by the scan of the elements                         (2)
//   D, g, P of every block with X = P+(c), as far as the block does not forget it          (3)
// From there the gains are those of the sequential filter, and what is left is linear, with
// psi = (I - gH) phi ... (I - gH) phi from c+ to the block's root m+:
//   z+(m) = psi z+(c) + z°(m)               z°: (4.2) to (4.6) with z+(c) = 0              (4)
//   l(c)  = psi' l(m) + l°(c)               l(k) = phi'(k) l-(parent(k)), l°: l(m) = 0     (5)
// (4) tips to base is the filter, (5) base to tips the smoother: two more scans, whose elements are
// (psi, z°) and (psi', l°), and combine as
//   psi = psi2 psi1,   z° = psi2 z°1 + z°2,   l° = psi1' l°2 + l°1      1 outboard of 2    (6)
// Blocks then repeat (4.2) to (4.11) with what came in, again as far as they do not forget it.
//
// Of a tree the paths of one height are scanned together, from the tips inwards in (1) to (4), from
// the base outwards in (5). With N links in blocks of B the span is O(B + log(N / B)) a height.
//
// The test for singular mechanisms is the sequential filter's, on the same D, as two more scans
// (singularity_scan.hpp). Where the scan fails it, or loses a D° to rounding, the sequential filter
// takes over and has the last word.
//
// Flops a link, beside those of the sequential form: about 300 for (1), and the whole again for
// (3) to (5); a block that forgets after F links pays that for F links alone.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/scan/blocks.hpp"
#include "algorithms/study/scan/covariance_element.hpp"
#include "algorithms/study/scan/singularity_scan.hpp"
#include "algorithms/study/scan/tasks.hpp"

namespace kalmarm {

template <class Form>
struct Scan {
  using Update = typename Form::Update;
  using Inner = Update;
  static std::string name() { return "Scan<" + Form::name() + ">"; }
  static constexpr VariantKind kind = VariantKind::scan;
  static constexpr const char* citation = "Särkkä and García-Fernández 2021, parallel scans";
  static constexpr const char* equation = "(3.3) by associative scans over blocks of links";
  template <class T>
  static constexpr bool supports = true;

  // As singularity.hpp: suspects of square roots in float32.
  template <class T>
  static constexpr bool looks_in_float64 = std::is_same_v<T, float>&& Update::resolution > 1;
  struct InFloat64;
  struct Nothing {
    template <class T>
    Nothing(const Model<T>&, const scan::Options&) {}
  };

  template <class T>
  struct Workspace {
    // Of a node of the trees: a run of blocks.
    struct Run {
      typename Form::template Element<T> element;
      typename Form::template Covariance<T> X;  // that comes in
      bool closed = true;                       // psi = 0
      Matrix6<T> psi;
      Vector6<T> z, z_in, l, l_in;
    };
    // Of a block, by positions among its links.
    struct Reach {
      int covariance = 0;  // links in front of it see X
      int forces = 0;      // links in front of it see z+(c)
      int motions = 0;     // links from it on see l(m)
      bool lost = false;   // some D° is not positive
    };

    Factors<T, Update> factors;
    Sweeps<T> sweeps;
    scan::Blocks blocks;
    scan::Tasks<T> tasks;
    std::vector<Run> runs;      // by node
    std::vector<Reach> reach;   // by block
    std::vector<Vector6<T>> n;  // H psi(k-,c+), of links that see what comes in
    scan::SingularityScan<T> test;
    [[no_unique_address]] std::conditional_t<looks_in_float64<T>, InFloat64, Nothing> in_float64;

    explicit Workspace(const Model<T>& model, const scan::Options& options = {})
        : factors(model),
          sweeps(model),
          blocks(model, options),
          tasks(options.threads),
          runs(blocks.nodes().size()),
          reach(blocks.blocks().size()),
          n(model.nv()),
          test(model, blocks),
          in_float64(model, options) {}
  };

  // The same mechanism in float64.
  struct InFloat64 {
    Model<double> model;
    LinkKinematics<double> kin;
    Workspace<double> ws;

    InFloat64(const Model<float>& exact, const scan::Options& options)
        : model(exact.cast<double>()), kin(model), ws(model, options) {}

    // False where a D may be lost even so.
    bool passes(const LinkKinematics<float>& exact) {
      set_position(model, exact.q, kin);  // phi of float32 is rounded, and moves D
      set_covariances(model, kin, ws);
      set_transitions(model, kin, ws);
      const double least = least_D_over_scale<double>(Update::resolution);
      return !is_lost(ws) &&
             ws.test.second_look(model, kin, least, NearestToSingular<double>(1), ws);
    }
  };

  // As factors.hpp. What the scan cannot factor, the sequential filter decides: an element of a link
  // that is light beside its neighbours may lose a D that the filter keeps.
  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    set_covariances(model, kin, ws);
    set_transitions(model, kin, ws);
    if (const std::optional<Outcome> passed = test(model, kin, ws)) return *passed;
    const Outcome outcome = kalmarm::factor(model, kin, ws.factors);
    if (outcome) set_transitions(model, kin, ws);
    return outcome;
  }

  // a (nv) from tau (nv), with the bias of kin, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    sweep(
        model, kin, tau, ws, [&](int k) { return kin.b[k]; },
        [&](int k, Vector6<T>& z) { z += Update::P_plus_times(k, kin.c[k], ws.factors.update); },
        [&](int k) { return kin.c[k]; }, base_acceleration(model), a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    const Vector6<T> zero = Vector6<T>::Zero();
    const auto none = [&](int) { return zero; };
    sweep(
        model, kin, tau, ws, none, [](int, Vector6<T>&) {}, none, zero, x);
  }

  // M^-1 (nv x nv), both triangles, after factor. Its columns are the parallel tasks.
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws,
                      MatrixX<T>& X) {
    inverse_by_columns(model, kin, ws.factors, ws.sweeps, X);
  }

 private:
  using Look = scan::Look;

  template <class T>
  static void set_covariances(const Model<T>& model, const LinkKinematics<T>& kin,
                              Workspace<T>& ws) {
    for (const scan::Height& height : ws.blocks.heights()) {
      ws.tasks.run(height.blocks, [&](int i) { set_element(model, kin, i, ws); });  // (1)
      scan_elements(height, ws);                                                    // (2)
      ws.tasks.run(height.open_blocks, [&](int i) {                                 // (3)
        const scan::Block& block = ws.blocks.blocks()[i];
        filter_covariance(model, kin, block, &ws.runs[block.node].X, ws.reach[i].covariance, ws,
                          [](int) {});
      });
    }
  }

  template <class T>
  static void set_transitions(const Model<T>& model, const LinkKinematics<T>& kin,
                              Workspace<T>& ws) {
    for (const scan::Height& height : ws.blocks.heights()) {
      ws.tasks.run(height.blocks, [&](int i) { set_transition(model, kin, i, ws); });
      scan_transitions(height, ws);
    }
  }

  // The sequential filter on the first `count` links of a block, with X at its tip if there is one.
  // after(k) is called behind every link. False where a D is not positive.
  template <class T, class After>
  static bool filter_covariance(const Model<T>& model, const LinkKinematics<T>& kin,
                                const scan::Block& block,
                                const typename Form::template Covariance<T>* X, int count,
                                Workspace<T>& ws, const After& after) {
    Factors<T, Update>& f = ws.factors;
    for (int i = 0; i < count; ++i)
      Update::set(block.links[i], model.inertia(block.links[i]), f.update);
    for (const scan::Block::Attached& light : block.attached)
      if (light.position < count) Update::propagate(model, kin, light.child, f.update);
    if (X && count > 0) Form::add(*X, block.tip(), kin.phi[block.child], f.update);
    bool positive = true;
    for (int i = 0; i < count; ++i) {
      const int k = block.links[i];
      f.D[k] = Update::measure(model, k, f.update, f.g[k]);
      positive = positive && f.D[k] > T(0);
      after(i);
      if (i + 1 < count) Update::propagate(model, kin, k, f.update);
    }
    return positive;
  }

  // (1), and how far the block remembers X.
  template <class T>
  static void set_element(const Model<T>& model, const LinkKinematics<T>& kin, int i,
                          Workspace<T>& ws) {
    const scan::Block& block = ws.blocks.blocks()[i];
    typename Form::template Element<T>& e = ws.runs[block.node].element;
    typename Workspace<T>::Reach& reach = ws.reach[i];
    const int links = static_cast<int>(block.links.size());
    e.closed = !block.open();
    reach.covariance = e.closed ? 0 : links;
    if (!e.closed) {
      e.A = kin.phi[block.child].matrix();
      Form::begin_information(e);
    }
    int on_path = 0;
    reach.lost = !filter_covariance(
        model, kin, block, static_cast<const typename Form::template Covariance<T>*>(nullptr),
        links, ws, [&](int position) {
          if (e.closed || position + 1 != block.ends[on_path]) return;
          const int k = block.links[position];
          const Vector6<T> n =
              scan::measure_transition(model.joint(k).axis(), ws.factors.g[k], e.A);
          Form::add_information(n, ws.factors.D[k], e);
          if (scan::forgotten(e.A)) {
            e.closed = true;
            reach.covariance = position + 1;
          } else if (position + 1 < links) {
            scan::propagate_transition(kin.phi[k], e.A);
          }
          ++on_path;
        });
    Form::set_covariance(block.root(), ws.factors.update, e);
  }

  // (2).
  template <class T>
  static void scan_elements(const scan::Height& height, Workspace<T>& ws) {
    const std::vector<scan::Node>& nodes = ws.blocks.nodes();
    ws.tasks.run_upwards(height.inner_nodes, [&](int i) {
      if (nodes[i].has_inboard)
        Form::combine(ws.runs[nodes[i].left].element, ws.runs[nodes[i].right].element,
                      ws.runs[i].element);
    });
    ws.tasks.run_downwards(height.inner_nodes, [&](int i) {
      auto &outer = ws.runs[nodes[i].left], &inner = ws.runs[nodes[i].right];
      if (nodes[i].has_outboard) outer.X = ws.runs[i].X;
      Form::apply(outer.element, ws.runs[i].X, inner.X);
    });
  }

  // No outcome where a D may be lost.
  template <class T>
  static std::optional<Outcome> test(const Model<T>& model, const LinkKinematics<T>& kin,
                                     Workspace<T>& ws) {
    constexpr int order = Update::resolution;
    const std::vector<T>& D = ws.factors.D;
    const auto first = ws.test.first_look(model, kin, D, order, ws.blocks, ws.tasks);
    if (first == Look::lost || is_lost(ws)) return std::nullopt;
    if (first == Look::clear) return Outcome{};
    if constexpr (looks_in_float64<T>)
      if (!ws.in_float64.passes(kin)) return std::nullopt;
    const T least = looks_in_float64<T> ? T(0) : least_D_over_scale<T>(order);
    return ws.test.second_look(model, kin, least, NearestToSingular<T>(order), ws);
  }

  template <class T>
  static bool is_lost(const Workspace<T>& ws) {
    return std::ranges::any_of(ws.reach, [](const auto& reach) { return reach.lost; });
  }

  // psi of a block, and how far it remembers what comes in.
  template <class T>
  static void set_transition(const Model<T>& model, const LinkKinematics<T>& kin, int i,
                             Workspace<T>& ws) {
    const scan::Block& block = ws.blocks.blocks()[i];
    const Factors<T, Update>& f = ws.factors;
    auto& run = ws.runs[block.node];
    auto& reach = ws.reach[i];
    run.closed = !block.open();
    reach.forces = reach.motions = 0;
    if (run.closed) return;
    const auto path_link = [&](std::size_t j) { return block.links[block.ends[j] - 1]; };
    const std::size_t links = block.ends.size();

    run.psi = kin.phi[block.child].matrix();
    for (std::size_t j = 0; j < links && !run.closed; ++j) {
      const int k = path_link(j);
      ws.n[k] = scan::measure_transition(model.joint(k).axis(), f.g[k], run.psi);
      reach.forces = block.ends[j];
      run.closed = scan::forgotten(run.psi);
      if (j + 1 < links) scan::propagate_transition(kin.phi[k], run.psi);
    }
    if (!run.closed) return;

    Matrix6<T> B = Matrix6<T>::Identity();  // psi from the root outwards, by columns of B'
    for (std::size_t j = links; j-- > 0;) {
      const int k = path_link(j);
      B.row(model.joint(k).axis()) -= f.g[k].transpose() * B;
      reach.motions = j > 0 ? block.ends[j - 1] : 0;
      if (scan::forgotten(B)) return;
      for (int c = 0; c < 6; ++c) B.col(c) = kin.phi[k].motion_from_parent(Vector6<T>(B.col(c)));
    }
  }

  template <class T>
  static void scan_transitions(const scan::Height& height, Workspace<T>& ws) {
    ws.tasks.run_upwards(height.inner_nodes, [&](int i) {
      const scan::Node& node = ws.blocks.nodes()[i];
      const auto &outer = ws.runs[node.left], &inner = ws.runs[node.right];
      auto& run = ws.runs[i];
      run.closed = outer.closed || inner.closed;
      if (!run.closed) run.psi.noalias() = inner.psi * outer.psi;  // (6)
    });
  }

  // Filter and smoother: start(k) is what z(k) starts from, P_plus_c(k, z) adds P+ c, c(k) is c.
  template <class T, class Start, class Add, class C>
  static void sweep(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, const Start& start, const Add& P_plus_c, const C& c,
                    const Vector6<T>& base, VectorX<T>& a) {
    const std::vector<scan::Block>& blocks = ws.blocks.blocks();
    const std::vector<scan::Height>& heights = ws.blocks.heights();
    const auto filter = [&](const scan::Block& block, const Vector6<T>* z_in, int count) {
      filter_forces(model, kin, tau, block, z_in, count, ws, start, P_plus_c);
    };
    const auto smoother = [&](const scan::Block& block, const Vector6<T>& l_in, int first) {
      smooth_motions(model, kin, block, l_in, first, ws, c, a);
    };
    for (const scan::Height& height : heights) {
      ws.tasks.run(height.blocks, [&](int i) {
        filter(blocks[i], nullptr, static_cast<int>(blocks[i].links.size()));
        ws.runs[blocks[i].node].z = ws.sweeps.z[blocks[i].root()];
      });
      scan_forces(height, ws);
      ws.tasks.run(height.open_blocks, [&](int i) {
        filter(blocks[i], &ws.runs[blocks[i].node].z_in, ws.reach[i].forces);
      });
    }
    for (auto height = heights.rbegin(); height != heights.rend(); ++height) {
      ws.tasks.run(height->blocks, [&](int i) {
        const scan::Block& block = blocks[i];
        auto& run = ws.runs[block.node];
        const bool inmost = !ws.blocks.nodes()[block.node].has_inboard;
        if (inmost) {
          const int root = block.root(), parent = model.parent(root);
          smoother(block, kin.phi[root].motion_from_parent(parent < 0 ? base : ws.sweeps.l[parent]),
                   0);
        } else if (block.open()) {
          smoother(block, Vector6<T>::Zero(), 0);
        }
        if (block.open()) run.l = kin.phi[block.child].motion_from_parent(ws.sweeps.l[block.tip()]);
      });
      scan_motions(*height, ws);
      ws.tasks.run(height->outboard_blocks, [&](int i) {
        smoother(blocks[i], ws.runs[blocks[i].node].l_in, ws.reach[i].motions);
      });
    }
  }

  // (4.2) to (4.6) of the first `count` links of a block, with z_in at its tip if there is one.
  template <class T, class Start, class Add>
  static void filter_forces(const Model<T>& model, const LinkKinematics<T>& kin,
                            const VectorX<T>& tau, const scan::Block& block, const Vector6<T>* z_in,
                            int count, Workspace<T>& ws, const Start& start, const Add& P_plus_c) {
    std::vector<Vector6<T>>& z = ws.sweeps.z;
    for (int i = 0; i < count; ++i) z[block.links[i]] = start(block.links[i]);
    for (const scan::Block::Attached& light : block.attached)
      if (light.position < count)
        z[block.links[light.position]] += kin.phi[light.child].force_to_parent(z[light.child]);
    if (z_in) z[block.tip()] += kin.phi[block.child].force_to_parent(*z_in);
    for (int i = 0; i < count; ++i) {
      const int k = block.links[i];
      filter_joint(model.joint(k), k, ws.factors, tau[k], ws.sweeps, P_plus_c);
      if (i + 1 < count) z[model.parent(k)] += kin.phi[k].force_to_parent(z[k]);
    }
  }

  // (4.9) to (4.11) of a block's links from `first` on, root first.
  template <class T, class C>
  static void smooth_motions(const Model<T>& model, const LinkKinematics<T>& kin,
                             const scan::Block& block, const Vector6<T>& l_in, int first,
                             Workspace<T>& ws, const C& c, VectorX<T>& a) {
    std::vector<Vector6<T>>& l = ws.sweeps.l;
    for (int i = static_cast<int>(block.links.size()) - 1; i >= first; --i) {
      const int k = block.links[i];
      const Joint<T>& joint = model.joint(k);
      l[k] = k == block.root() ? l_in : kin.phi[k].motion_from_parent(l[joint.parent]);
      l[k] += c(k);
      a[k] = smooth(joint, ws.factors.exact_at(joint), ws.factors.g[k], ws.sweeps.e[k], l[k]);
    }
  }

  // (4) of all blocks.
  template <class T>
  static void scan_forces(const scan::Height& height, Workspace<T>& ws) {
    const std::vector<scan::Node>& nodes = ws.blocks.nodes();
    ws.tasks.run_upwards(height.inner_nodes, [&](int i) {
      if (!nodes[i].has_inboard) return;
      const auto &outer = ws.runs[nodes[i].left], &inner = ws.runs[nodes[i].right];
      ws.runs[i].z = inner.z;
      if (!inner.closed) ws.runs[i].z.noalias() += inner.psi * outer.z;
    });
    ws.tasks.run_downwards(height.inner_nodes, [&](int i) {
      auto &outer = ws.runs[nodes[i].left], &inner = ws.runs[nodes[i].right];
      if (nodes[i].has_outboard) outer.z_in = ws.runs[i].z_in;
      inner.z_in = outer.z;
      if (!outer.closed) inner.z_in.noalias() += outer.psi * ws.runs[i].z_in;
    });
  }

  // (5) of all blocks.
  template <class T>
  static void scan_motions(const scan::Height& height, Workspace<T>& ws) {
    const std::vector<scan::Node>& nodes = ws.blocks.nodes();
    ws.tasks.run_upwards(height.inner_nodes, [&](int i) {
      if (!nodes[i].has_outboard) return;
      const auto &outer = ws.runs[nodes[i].left], &inner = ws.runs[nodes[i].right];
      ws.runs[i].l = outer.l;
      if (!outer.closed) ws.runs[i].l.noalias() += outer.psi.transpose() * inner.l;
    });
    ws.tasks.run_downwards(height.inner_nodes, [&](int i) {
      auto &outer = ws.runs[nodes[i].left], &inner = ws.runs[nodes[i].right];
      if (nodes[i].has_inboard) inner.l_in = ws.runs[i].l_in;
      outer.l_in = inner.l;
      if (nodes[i].has_inboard && !inner.closed)
        outer.l_in.noalias() += inner.psi.transpose() * ws.runs[i].l_in;
    });
  }
};

}  // namespace kalmarm

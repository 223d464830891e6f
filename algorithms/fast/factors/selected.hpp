// B'M^-1 B on the fast path, for columns b_j of B that are unit vectors of chosen DoF and the J' of
// chosen sites (model/selection.hpp), from factors and an inward sweep alone:
//
//   M^-1 = (I - L*) D^-1 (I - L)                                           (3.3)
//   X = Y'Y,  y_j = D^(-1/2) (I - L) b_j: whitened innovations             (4.2)
// (I - L) (tau - H phi b) is the filter's e, of forces b on the links, so that
//   a DoF:   tau = its unit vector
//   a site:  z- of its link = -phi(link, site) x, for six unit vectors x
// and in both cases e = 0 but on the way to the base, which is worked out once. Lanes are columns,
// a site's six or up to eight DoF, or states. About 43 flops a link on the way and column, and one
// multiplication and addition for each number of X and link that both its columns pass.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/selection.hpp"

namespace kalmarm {

// T: a scalar, or a pack that has a state in every lane.
template <class T>
class SelectedColumns {
  using S = typename Lanes<T>::Scalar;

 public:
  // Takes its memory. Links and DoF are those of the model.
  void select(const LoweredModel<S>& model, const Selection& selection);

  // X (size x size, column-major), both triangles, symmetric to the last bit. Returns 0 if all
  // of it is finite, else NaN.
  T fill(const LoweredModel<S>& model, const FastFactors<T>& factors, T* X);

 private:
  using Columns = detail::ColumnsOf<T, 8>;
  using Lane = typename Columns::Lane;

  // What a link's columns bring with them.
  struct Entry {
    bool is_there = false;
    Lane tau = Lane(S(0));
    Sixfold<Lane> z = {tau, tau, tau, tau, tau, tau};
  };
  // A link on the way, tips to base.
  struct Step {
    int link;
    bool carried = false;  // z comes from the step before
    int entry = -1;        // of entries
    int sum = -1;          // of sums: what the other children have left there
    int leaves_at = -1;    // the sum that z is left in, where the next step does not carry it on
  };
  struct Chunk {
    int first, count;  // columns
    std::vector<Step> steps = {};
    std::vector<Entry> entries = {};
    std::vector<Sixfold<Lane>> sums = {};
    std::vector<Lane> y = {};  // of every step
  };
  // Two chunks, and the pairs of their steps at the same link.
  struct Meeting {
    int a, b;
    std::vector<std::pair<int, int>> steps = {};
  };

  // Of a site's columns from `first` on.
  static Entry wrenches(const LoweredModel<S>& model, const Site<double>& site, int first) {
    const Transform<Wider<S>> on_link =
        model.phi_on_link(site.link, site.template cast<Wider<S>>().phi());
    MatrixPlacement<S> phi;
    for (int i = 0; i < 3; ++i) {
      phi.p[i] = S(on_link.p[i]);
      for (int j = 0; j < 3; ++j) phi.R.R[i][j] = S(on_link.R(i, j));
    }
    const auto minus_unit = [first](int i) { return -Columns::unit(i - first); };
    Entry entry;
    entry.is_there = true;
    entry.z = {minus_unit(0), minus_unit(1), minus_unit(2),
               minus_unit(3), minus_unit(4), minus_unit(5)};
    detail::force_to_parent(phi, entry.z);
    return entry;
  }

  // The way of a chunk from its entries, one a link, to the base.
  void add_way(const LoweredModel<S>& model, const std::vector<Entry>& entries, Chunk chunk) {
    std::vector<char> visits(model.nv(), 0);
    std::vector<int> step_of(model.nv(), -1);
    for (int k = model.nv() - 1; k >= 0; --k) {
      if (entries[k].is_there) visits[k] = 1;
      if (!visits[k]) continue;
      if (model.link(k).parent >= 0) visits[model.link(k).parent] = 1;
      step_of[k] = static_cast<int>(chunk.steps.size());
      Step step{k};
      if (entries[k].is_there) {
        step.entry = static_cast<int>(chunk.entries.size());
        chunk.entries.push_back(entries[k]);
      }
      chunk.steps.push_back(step);
    }
    for (int i = 0; i < static_cast<int>(chunk.steps.size()); ++i) {
      const int parent = model.link(chunk.steps[i].link).parent;
      if (parent < 0) continue;
      Step& next = chunk.steps[step_of[parent]];
      if (step_of[parent] == i + 1) {
        next.carried = true;
        continue;
      }
      if (next.sum < 0) {
        next.sum = static_cast<int>(chunk.sums.size());
        chunk.sums.emplace_back();
      }
      chunk.steps[i].leaves_at = next.sum;
    }
    chunk.y.resize(chunk.steps.size());
    chunks_.push_back(std::move(chunk));
  }

  void add_meeting(int a, int b) {
    const std::vector<Step>&at = chunks_[a].steps, &bt = chunks_[b].steps;
    Meeting meeting{a, b};
    for (int i = 0, j = 0; i < static_cast<int>(at.size()) && j < static_cast<int>(bt.size());) {
      if (at[i].link == bt[j].link)
        meeting.steps.emplace_back(i++, j++);
      else
        at[i].link > bt[j].link ? ++i : ++j;
    }
    meetings_.push_back(std::move(meeting));
  }

  static void whiten(const LoweredModel<S>& model, const FastFactors<T>& factors, Chunk& chunk);

  // The block of X that two chunks meet in, and its mirror image.
  T multiply(const Meeting& meeting, T* X) const {
    const Chunk &a = chunks_[meeting.a], &b = chunks_[meeting.b];
    Lane columns[Columns::count];
    for (Lane& column : columns) column = Lane(S(0));
    for (const auto& [i, j] : meeting.steps) {
      const Lane ya = a.y[i], yb = b.y[j];
      for (int c = 0; c < Columns::count; ++c) columns[c] += ya * Lane(Columns::column(yb, c));
    }
    T check = T(S(0));
    for (int c = 0; c < b.count; ++c)
      for (int r = meeting.a == meeting.b ? c : 0; r < a.count; ++r) {
        const T x = Columns::column(columns[c], r);
        const int i = a.first + r, j = b.first + c;
        X[i * size_ + j] = X[j * size_ + i] = x;
        check += x * T(S(0));
      }
    return check;
  }

  int size_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Meeting> meetings_;
};

template <class T>
void SelectedColumns<T>::select(const LoweredModel<S>& model, const Selection& selection) {
  chunks_.clear();
  meetings_.clear();
  size_ = selection.size();
  const int dofs = static_cast<int>(selection.dofs.size());
  for (int first = 0; first < dofs; first += Columns::count) {
    Chunk chunk{first, std::min(Columns::count, dofs - first)};
    std::vector<Entry> entries(model.nv());
    for (int i = 0; i < chunk.count; ++i) {
      const int dof = selection.dofs[first + i];
      assert(dof >= 0 && dof < model.nv());
      Entry& entry = entries[dof];
      entry.is_there = true;
      entry.tau += Columns::unit(i);
    }
    add_way(model, entries, chunk);
  }
  for (int i = 0; i < static_cast<int>(selection.frames.size()); ++i) {
    const Frame& frame = selection.frames[i];
    assert(frame.link >= -1 && frame.link < model.nv());
    for (int first = 0; first < 6; first += Columns::count) {
      std::vector<Entry> entries(model.nv());
      if (frame.link >= 0) entries[frame.link] = wrenches(model, site_of(frame), first);
      add_way(model, entries, Chunk{dofs + 6 * i + first, std::min(Columns::count, 6 - first)});
    }
  }
  for (int b = 0; b < static_cast<int>(chunks_.size()); ++b)
    for (int a = b; a < static_cast<int>(chunks_.size()); ++a) add_meeting(a, b);
}

template <class T>
T SelectedColumns<T>::fill(const LoweredModel<S>& model, const FastFactors<T>& factors, T* X) {
  for (Chunk& chunk : chunks_) whiten(model, factors, chunk);
  T check = T(S(0));
  for (const Meeting& meeting : meetings_) check += multiply(meeting, X);
  return check;
}

template <class T>
void SelectedColumns<T>::whiten(const LoweredModel<S>& model, const FastFactors<T>& factors,
                                Chunk& chunk) {
  using std::sqrt;
  for (Sixfold<Lane>& sum : chunk.sums) detail::set_zero(sum);
  Sixfold<Lane> z;
  Lane* y = chunk.y.data();
  for (const Step& step : chunk.steps) {
    const LoweredLink<S>& link = model.link(step.link);
    const auto& at = factors.links[step.link];
    Lane tau = Lane(S(0));
    if (!step.carried) detail::set_zero(z);
    if (step.sum >= 0) add(z, chunk.sums[step.sum]);
    if (step.entry >= 0) {
      tau = chunk.entries[step.entry].tau;
      add(z, chunk.entries[step.entry].z);
    }
    const Lane e = detail::gain(model, step.link, at, tau, z);
    *y++ = e * Lane(sqrt(at.inverse_D));
    if (link.parent >= 0) detail::force_to_parent(model, link, factors, at.d, z);
    if (step.leaves_at >= 0) add(chunk.sums[step.leaves_at], z);
  }
}

}  // namespace kalmarm

// B'M^-1 B on the fast path, for columns b_j of B that are unit vectors of chosen DoF and the J' of
// chosen sites (model/selection.hpp), from factors and an inward sweep alone:
//
//   M^-1 = (I - L*) D^-1 (I - L)                                           (3.3)
//   X = Y'Y,  y_j = D^(-1/2) (I - L) b_j: whitened innovations             (4.2)
// (I - L) (tau - H phi b) is the filter's e, of forces b on the links, so that
//   a DoF:   tau = its unit vector
//   a site:  z- of its link = -phi(link, site) x, for six unit vectors x
// and in both cases e = 0 but on the way to the base, which is worked out once. Of sites on one link the first
// is worked out so, of the others
//   J' of site i = J' of the first phi(first, i),  so that y of i's columns are as many mixtures of the first's
// Lanes are columns, a site's six or up to eight DoF, or states. About 43 flops a link on the way and column, 12 at
// a link's further sites, 2 for the diagonal of X, which needs no more; for the whole of X one
// multiplication and addition for each number and link that both its columns pass.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/selection.hpp"

namespace kalmarm {

// T: a scalar, or a pack that has a state in every lane. S: of the model.
template <class T, class S = typename Lanes<T>::Scalar>
class SelectedColumns {
 public:
  // Takes its memory. Links and DoF are those of the model.
  void select(const LoweredModel<S>& model, const Selection& selection);

  // operational: X (size x size, column-major), both triangles, symmetric to the last bit;
  // operational_diagonal: its diagonal (size), to the same bits but for the order of sums. Returns 0 if all of it is finite, else NaN.
  T answer(Want want, const LoweredModel<S>& model, const FastFactors<T>& factors, T* X);

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
    // Of a link's further sites: the first chunk of its first, and of each column there how much is in ours.
    int first_of_link = -1;
    std::array<Lane, 6> mixture = {};
  };
  // Two chunks, and the pairs of their steps at the same link.
  struct Meeting {
    int a, b;
    std::vector<std::pair<int, int>> steps = {};
  };

  // Unit wrenches, times `size`, of a site's columns from `first` on, moved `by` what leads from the site.
  static Sixfold<Lane> wrenches(const Transform<Wider<S>>& by, int first, S size) {
    MatrixPlacement<S> phi;
    for (int i = 0; i < 3; ++i) {
      phi.p[i] = S(by.p[i]);
      for (int j = 0; j < 3; ++j) phi.R.R[i][j] = S(by.R(i, j));
    }
    const auto unit = [&](int i) { return Lane(size) * Columns::unit(i - first); };
    Sixfold<Lane> z = {unit(0), unit(1), unit(2), unit(3), unit(4), unit(5)};
    detail::force_to_parent(phi, z);
    return z;
  }

  // Of a link's first site. phi: from the site to the link.
  void add_first_site(const LoweredModel<S>& model, int link, const Transform<Wider<S>>& phi,
                      int column) {
    for (int first = 0; first < 6; first += Columns::count) {
      std::vector<Entry> entries(model.nv());
      if (link >= 0) {
        entries[link].is_there = true;
        entries[link].z = wrenches(phi, first, S(-1));
      }
      add_way(model, entries, Chunk{column + first, std::min(Columns::count, 6 - first)});
    }
  }

  // Of a further one. phi: from it to the first, whose chunks start at `chunk`.
  void add_further_site(int chunk, const Transform<Wider<S>>& phi, int column) {
    for (int first = 0; first < 6; first += Columns::count) {
      Chunk further{column + first, std::min(Columns::count, 6 - first), chunks_[chunk].steps};
      further.y.resize(further.steps.size());
      further.first_of_link = chunk;
      const Sixfold<Lane> mixed = wrenches(phi, first, S(1));
      further.mixture = {mixed.x, mixed.y, mixed.z, mixed.u, mixed.v, mixed.w};
      chunks_.push_back(std::move(further));
    }
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
  static void mix(const Chunk* of_first, Chunk& chunk);

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

  // The numbers of X's diagonal that a chunk has.
  static T squares(const Chunk& chunk, T* x) {
    Lane sum = Lane(S(0));
    for (const Lane& y : chunk.y) sum += y * y;
    T check = T(S(0));
    for (int i = 0; i < chunk.count; ++i)
      check += (x[chunk.first + i] = Columns::column(sum, i)) * T(S(0));
    return check;
  }

  int size_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Meeting> meetings_;
};

template <class T, class S>
void SelectedColumns<T, S>::select(const LoweredModel<S>& model, const Selection& selection) {
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
  using Phi = Transform<Wider<S>>;
  struct First {
    Phi phi;
    int chunk;
  };
  std::map<int, First> first_of_link;
  for (int i = 0; i < static_cast<int>(selection.frames.size()); ++i) {
    const Frame& frame = selection.frames[i];
    assert(frame.link >= -1 && frame.link < model.nv());
    const Phi phi = site_of(frame).template cast<Wider<S>>().phi();
    const int column = dofs + 6 * i, chunk = static_cast<int>(chunks_.size());
    const auto [at, is_first] = first_of_link.try_emplace(frame.link, First{phi, chunk});
    const First& first = at->second;
    if (is_first)
      add_first_site(model, frame.link, frame.link < 0 ? phi : model.phi_on_link(frame.link, phi),
                     column);
    else
      add_further_site(
          first.chunk,
          Phi{first.phi.R.transpose() * phi.R, first.phi.R.transpose() * (phi.p - first.phi.p)},
          column);
  }
  for (int b = 0; b < static_cast<int>(chunks_.size()); ++b)
    for (int a = b; a < static_cast<int>(chunks_.size()); ++a) add_meeting(a, b);
}

template <class T, class S>
T SelectedColumns<T, S>::answer(Want want, const LoweredModel<S>& model,
                                const FastFactors<T>& factors, T* X) {
  for (Chunk& chunk : chunks_)
    if (chunk.first_of_link < 0)
      whiten(model, factors, chunk);
    else
      mix(&chunks_[chunk.first_of_link], chunk);
  T check = T(S(0));
  if (want == Want::operational_diagonal)
    for (const Chunk& chunk : chunks_) check += squares(chunk, X);
  else
    for (const Meeting& meeting : meetings_) check += multiply(meeting, X);
  return check;
}

template <class T, class S>
void SelectedColumns<T, S>::mix(const Chunk* of_first, Chunk& chunk) {
  for (std::size_t i = 0; i < chunk.y.size(); ++i) {
    Lane y = Lane(S(0));
    for (int column = 0; column < 6; ++column)
      y += chunk.mixture[column] *
           Lane(Columns::column(of_first[column / Columns::count].y[i], column % Columns::count));
    chunk.y[i] = y;
  }
}

template <class T, class S>
void SelectedColumns<T, S>::whiten(const LoweredModel<S>& model, const FastFactors<T>& factors,
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

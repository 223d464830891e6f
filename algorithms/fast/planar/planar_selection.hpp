// B'M^-1 B of chosen DoF and frames (model/selection.hpp) of a planar mechanism, without M^-1:
//
//   B'M^-1 B = E'D^-1 E,  E = (I - L) B                                        (3.3)
// and what slides along the normal n, which is constant. Seen from the site's axes, with N = n and
// a unit vector x of them that the plane turns, a force along x is (t'x; x) in the plane and N'x
// along n, and a moment N'x about n; all else moves nothing, and is exactly zero.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "algorithms/fast/planar/planar_columns.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/selection.hpp"

namespace kalmarm {

template <class T>
class PlanarSelection {
 public:
  PlanarSelection() = default;

  template <class W>
  PlanarSelection(const PlanarModel<T>& model, const AlongNormal<W>& along,
                  const TranslationalFactors<T>& along_factors, const Plane<W>& plane,
                  const Selection& selection)
      : E_(selection.size(), model.nv()) {
    MatrixX<T> B = MatrixX<T>::Zero(along.slides.size(), selection.size());  // along n
    std::vector<int> link_of(along.moves_with.size(), -1), slide_of = link_of;
    for (int k = 0; k < model.nv(); ++k) link_of[model.link(k).dof] = k;
    for (int i = 0; i < static_cast<int>(along.dofs.size()); ++i) slide_of[along.dofs[i]] = i;
    int column = 0;
    for (const int dof : selection.dofs) {
      links_.push_back(link_of[dof]);
      if (slide_of[dof] >= 0) B(slide_of[dof], column) = T(1);
      ++column;
    }
    for (const Frame& frame : selection.frames) {
      add_site(model, plane, site_of(frame).template cast<W>());
      for (int i = frame.link < 0 ? -1 : along.moves_with[frame.link]; i >= 0;
           i = along.slides[i].parent)
        for (int axis = 0; axis < 3; ++axis)
          B(i, column + 3 + axis) = T(along.slides[i].axis[2]) * sites_.back().n[axis];
      column += 6;
    }
    along_ = B.transpose() * along_factors.inverse() * B;
  }

  // X (size x size, column-major, both triangles), after planar_factor. About 10 flops a column and link inboard of it, and
  // half the square of the columns that a link carries.
  void fill(const PlanarModel<T>& model, const PlanarWorkspace<T>& ws, T* result) {
    const int size = static_cast<int>(E_.rows());
    Eigen::Map<MatrixX<T>> X(result, size, size);
    E_.setZero();
    int column = 0;
    for (const int link : links_) {
      planar_innovations(model, ws, link, T(1), Planar<T>{T(0), T(0), T(0)},
                         [&](int k, const T& e) { E_(column, k) = e; });
      ++column;
    }
    for (const At& site : sites_) {
      set_innovations(model, ws, site, column);
      column += 6;
    }
    X = along_;
    for (int k = 0; k < model.nv(); ++k)
      for (int j = 0; j < size; ++j) {
        const T e = E_(j, k) * ws.links[k].inverse_D;
        if (e == T(0)) continue;
        for (int i = j; i < size; ++i) X(i, j) += E_(i, k) * e;
      }
    mirror(size, X.data());
  }

 private:
  // A site at home: in its axes n and the axes of the plane; t from the link's origin.
  struct At {
    int link;
    std::array<T, 3> n, x, y;
    T tx, ty;
  };
  using Columns = Pack<T, 8>;  // six of a site

  template <class W>
  void add_site(const PlanarModel<T>& model, const Plane<W>& plane, const Site<W>& site) {
    using std::abs;
    const int link = site.link < 0 ? -1 : model.moves_with(site.link);
    At& at = sites_.emplace_back();
    at.link = link;
    const HomeFrame<W> base{plane.axes, Vector3<W>::Zero()};
    const HomeFrame<W>& frame = site.link < 0 ? base : plane.home[site.link];
    const Matrix3<W> R = frame.R * rotation(site.rotation);
    const Vector3<W> from = link < 0 ? Vector3<W>::Zero() : plane.home[model.link(link).dof].o;
    const Vector3<W> p = frame.o + frame.R * site.translation - from;
    const W rounding = W(8) * W(unit_roundoff<T>());
    const auto number = [&](const W& x) { return abs(x) <= rounding ? T(0) : T(x); };
    for (int i = 0; i < 3; ++i) {
      at.x[i] = number(R(0, i));
      at.y[i] = number(R(1, i));
      at.n[i] = number(R(2, i));
    }
    at.tx = T(W(-p[1]));
    at.ty = T(p[0]);
  }

  void set_innovations(const PlanarModel<T>& model, const PlanarWorkspace<T>& ws, const At& site,
                       int column) {
    if (site.link < 0) return;
    using Ws = PlanarWorkspace<T>;
    const T c = ws.table.at(Ws::cosine, site.link), s = ws.table.at(Ws::sine, site.link);
    const T tx = c * site.tx - s * site.ty, ty = s * site.tx + c * site.ty;
    std::array<T, 8> n{}, x{}, y{};
    for (int i = 0; i < 3; ++i) {
      n[i] = -site.n[i];
      x[3 + i] = -(c * site.x[i] - s * site.y[i]);
      y[3 + i] = -(s * site.x[i] + c * site.y[i]);
      n[3 + i] = tx * x[3 + i] + ty * y[3 + i];
    }
    const Planar<Columns> z{Columns::load(n.data()), Columns::load(x.data()),
                            Columns::load(y.data())};
    planar_innovations(model, ws, site.link, Columns(T(0)), z, [&](int k, const Columns& e) {
      for (int i = 0; i < 6; ++i) E_(column + i, k) = e[i];
    });
  }

  std::vector<int> links_;  // of the DoF, -1 of one along n
  std::vector<At> sites_;
  MatrixX<T> E_;      // columns are links
  MatrixX<T> along_;  // the part that does not depend on q
};

}  // namespace kalmarm

#include "accuracy/fits/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "accuracy/fits/prediction.hpp"

namespace kalmarm {

ResidualOptions residual_options(Residual kind, const Mechanics<double>& robot,
                                 const Samples& samples) {
  ResidualOptions out;
  out.kind = kind;
  const int nv = robot.model.nv();
  if (kind == Residual::mass_matrix) {
    out.scale.resize(nv);
    for (int k = 0; k < nv; ++k)
      out.scale[k] = std::sqrt(samples.mass.row(lower_triangle_row(k, k)).mean());
    return out;
  }
  out.scale = row_sizes(kind == Residual::forward_dynamics ? samples.qdd : samples.tau);
  if (kind == Residual::likelihood) {
    LinkKinematics<double> kin(robot.model);
    FitFilter<double> filter(robot.model);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < samples.count(); ++i) {
      set_position(robot.model, samples.q.col(i), kin);
      if (!filter.factor(robot.model, kin)) continue;
      for (const double D : filter.factors.D) least = std::min(least, std::log(D));
    }
    out.log_D_shift = 10 - least;  // far enough from 0 for the fit to move
  }
  return out;
}

}  // namespace kalmarm

#include "accuracy/recommend.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "accuracy/measures.hpp"
#include "accuracy/structured_condition.hpp"
#include "algorithms/inverse_mass/condition.hpp"
#include "algorithms/inverse_mass/factored_bias.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/riccati/array.hpp"
#include "algorithms/solver.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

using Reference = FactoredBias<ArrayGivens>;

constexpr double margin = 16;
constexpr int draws = 6;  // for kS
constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr const char* plain_variant = "Sequential<Conventional>";
constexpr const char* cholesky_variant = "Batch<SparseLTDL>";

void raise(double& to, double loss) {
  if (!(loss <= to)) to = std::isnan(loss) ? infinite : loss;
}

double roundoff(const std::string& precision) {
  return precision == "float32" ? unit_roundoff<float>() : unit_roundoff<double>();
}

double plain_loss(const Loss& loss, const Request& request) {
  if (!request.acceleration) return loss.cancellation;
  return std::max({loss.cancellation, loss.parameters, loss.observed});
}

double recommended_error(const Loss& loss, const Request& request, const std::string& precision) {
  const double parameters = request.acceleration ? loss.parameters : loss.cancellation;
  if (precision == "float32") return margin * unit_roundoff<float>() * parameters;
  const double residual = std::max(parameters, loss.cancellation);
  return margin * (unit_roundoff<double>() + double(unit_roundoff<long double>()) * residual);
}

// Cheapest first.
std::vector<Choice> candidates(const Loss& loss, const Request& request) {
  const std::vector<std::string> precisions = request.precision.empty()
                                                  ? std::vector<std::string>{"float32", "float64"}
                                                  : std::vector{request.precision};
  std::vector<Choice> out;
  if (request.inverse && !request.acceleration)
    for (const std::string& precision : precisions)
      out.push_back({cholesky_variant, precision, margin * roundoff(precision) * loss.cholesky});
  for (const std::string& precision : precisions)
    out.push_back(
        {plain_variant, precision, margin * roundoff(precision) * plain_loss(loss, request)});
  const std::string& widest = precisions.back();
  out.push_back({recommended_variant, widest, recommended_error(loss, request, widest)});
  return out;
}

}  // namespace

void Loss::worsen(const Loss& other) {
  raise(cancellation, other.cancellation);
  raise(parameters, other.parameters);
  raise(observed, other.observed);
  raise(cholesky, other.cholesky);
}

struct LossPredictor::Parts {
  Model<double> model;
  bool with_cholesky;
  RandomModel<double> rm;
  Reference::Workspace<double> reference;
  RoundingScale<double> scale;
  CompositeInertia<double> composite;
  std::unique_ptr<Solver<double>> plain, recommended;

  Parts(const Model<double>& m, bool cholesky)
      : model(m),
        with_cholesky(cholesky),
        rm(model),
        reference(model),
        scale(model),
        composite(model),
        plain(make_solver<double>(plain_variant, model)),
        recommended(make_solver<double>(recommended_variant, model)) {}

  // R, from the reference's factors.
  double cancellation() {
    double out = 1;
    scale.begin(model);
    for (int k = model.nv() - 1; k >= 0; --k) {
      raise(out, scale.scale(model, k) / reference.factors.D[k]);
      if (model.parent(k) >= 0) scale.propagate(model, rm.phi[k], k, reference.factors.g[k]);
    }
    return out;
  }

  double cholesky() {
    MatrixX<double> M(model.nv(), model.nv()), X(model.nv(), model.nv());
    mass_matrix(model, rm, composite, Eigen::Ref<MatrixX<double>>(M));
    Reference::inverse(model, rm, reference, X);
    return scaled_condition_bound(M, X);
  }

  double parameters(const VectorX<double>& q, const Task<double>& task, const VectorX<double>& a) {
    const Solve solve = [&](const VectorX<Real>& r) {
      VectorX<double> da(model.nv());
      Reference::solve(model, rm, VectorX<double>(r.cast<double>()), reference, da);
      return VectorX<Real>(da.cast<Real>());
    };
    return quick_structured_condition(model, q, task, a, solve, draws).relative;
  }

  Loss operator()(const VectorX<double>& q, const Task<double>& task) {
    Loss out;
    set_position(model, q, rm);
    VectorX<double> a(model.nv()), plainly(model.nv());
    if (!Reference::factor(model, rm, reference) ||
        !recommended->acceleration(q, task.qd, task.value, a))
      return {infinite, infinite, infinite, infinite};
    out.cancellation = cancellation();
    if (with_cholesky) raise(out.cholesky, cholesky());
    raise(out.parameters, parameters(q, task, a));
    if (plain->acceleration(q, task.qd, task.value, plainly))
      raise(out.observed, quotient((plainly - a).norm(), a.norm()) / unit_roundoff<double>());
    else
      out.observed = infinite;
    return out;
  }
};

LossPredictor::LossPredictor(const Model<double>& model, bool cholesky)
    : parts_(std::make_unique<Parts>(model, cholesky)) {}

LossPredictor::~LossPredictor() = default;

Loss LossPredictor::operator()(const VectorX<double>& q, const Task<double>& task) {
  return (*parts_)(q, task);
}

Choice recommend(const Loss& loss, const Request& request) {
  const std::vector<Choice> all = candidates(loss, request);
  const double finest = roundoff(all.back().precision);
  if (!(request.tolerance >= finest)) {
    char numbers[80];
    std::snprintf(numbers, sizeof numbers, "tolerance %.3g is below the roundoff %.3g of ",
                  request.tolerance, finest);
    throw InputError(numbers + all.back().precision);
  }
  for (const Choice& choice : all)
    if (choice.predicted <= request.tolerance) return choice;
  return all.back();
}

}  // namespace kalmarm

#include "accuracy/stress/measure_case.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "accuracy/programs/common/csv.hpp"
#include "accuracy/stress/forward_dynamics.hpp"
#include "accuracy/truth/acceleration_truth.hpp"
#include "accuracy/truth/truth_cache.hpp"
#include "algorithms/dynamics/check_model.hpp"

namespace kalmarm::stress {
namespace {

constexpr int draws = 6;             // for kS
constexpr int largest_dense = 1000;  // joints for which a variant may store nv^2 numbers
constexpr int largest_kS = 10000;    // joints for which kS is affordable: 1 GB

using Wide = long double;  // what results are judged in, from truth

std::string short_number(double value) {
  if (std::isnan(value)) return "";
  char text[24];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string warning(const Outcome& outcome) {
  if (!outcome) return "";
  return outcome.near_singular ? "near_singular" : outcome.warns() ? "inaccurate" : "";
}

bool wanted(const std::vector<std::string>& names, const std::string& name) {
  return names.empty() || std::ranges::find(names, name) != names.end();
}

template <class T>
class Measured {
 public:
  Measured(const Case& c, std::uint64_t seed, const Selection& selection)
      : selection_(selection),
        model_(c.model.cast<T>()),
        weightless_(model_),
        q_(c.q.cast<T>()),
        nv_(model_.nv()),
        has_M_(nv_ <= largest_inverse),
        has_inverse_(has_M_ && selection.matrices) {
    weightless_.set_gravity(Vector3<T>::Zero());
    make_tasks(c.qd.cast<T>(), seed);
    std::vector<Task<T>> tasks;
    for (const auto& [name, task] : tasks_) tasks.push_back(task);
    const TruthOptions options{.matrices = has_M_, .draws = nv_ <= largest_kS ? draws : 0};
    truth_ = selection.matrices ? cached_truth(model_, q_, tasks, options)
                                : acceleration_truth(model_, q_, tasks, options);
    if (!truth_.outcome) return;
    for (const Response<T>& response : truth_.responses)
      a_.push_back(response.a.template cast<Wide>());
    if (has_M_) M_ = truth_.M.template cast<Wide>();
    if (!has_inverse_) return;
    condition_ = condition(truth_.M, truth_.X);
    X_ = truth_.X.template cast<Wide>();
    D_ = truth_.D.template cast<Wide>();
    g_ = truth_.g.template cast<Wide>();
  }

  Measurement measurement() const { return {nv_, truth_.outcome, condition_, records()}; }

 private:
  std::vector<Record> records() const {
    std::vector<Record> out;
    for (const RegisteredVariant<T>& variant : all_variants<T>()) {
      if (!wanted(selection_.variants, variant.name) || !variant.takes(model_)) continue;
      if (variant.traits.generated && selection_.variants.empty()) continue;  // has to be named
      const bool stacked = variant.traits.kind == VariantKind::stacked;
      if (variant.traits.dense && nv_ > (stacked ? largest_inverse : largest_dense)) continue;
      add_accelerations(variant, out);
      if (!has_inverse_) continue;
      if (wanted(selection_.tasks, "inverse")) out.push_back(inverse(variant));
      if (wanted(selection_.tasks, "factors")) add_factors(variant, out);
    }
    link_refined(out);
    return out;
  }

  void make_tasks(const VectorX<T>& qd, std::uint64_t seed) {
    boost::random::mt19937_64 random(seed);
    boost::random::normal_distribution<double> normal;
    const auto draw = [&] {
      VectorX<T> x(nv_);
      for (T& entry : x) entry = T(normal(random));
      return x;
    };
    const VectorX<T> zero = VectorX<T>::Zero(nv_);
    const std::pair<std::string, Task<T>> all[] = {
        {"random", {draw(), zero, Drive::torque, false}},
        {"white", {draw(), zero, Drive::innovations, false}},
        {"consistent", {draw(), zero, Drive::acceleration, false}},
        {"free_fall", {zero, zero, Drive::torque, true}},
        {"dynamics", {draw(), qd, Drive::torque, true}},
    };
    const bool falls = !model_.gravity().isZero(T(0));
    for (const auto& task : all)
      if (wanted(selection_.tasks, task.first) && (falls || task.first != "free_fall"))
        tasks_.push_back(task);
  }

  void add_accelerations(const RegisteredVariant<T>& variant, std::vector<Record>& out) const {
    std::optional<ForwardDynamics<T>> heavy, weightless;
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      const auto& [name, task] = tasks_[i];
      Record record{.task = name, .variant = variant.name};
      VectorX<T> a = VectorX<T>::Constant(nv_, std::numeric_limits<T>::quiet_NaN());
      auto& dynamics = task.gravity ? heavy : weightless;
      if (!dynamics) dynamics.emplace(variant, task.gravity ? model_ : weightless_);
      const VectorX<T> tau = truth_.outcome ? truth_.responses[i].tau : task.value;
      record.outcome = dynamics->acceleration(q_, task.qd, tau, a);
      if (truth_.outcome && truth_.responses[i].kS.relative > 0)
        record.kS = truth_.responses[i].kS.relative;
      if (truth_.outcome && record.outcome) judge(i, a, record);
      out.push_back(std::move(record));
    }
  }

  void judge(std::size_t task, const VectorX<T>& a, Record& record) const {
    const VectorX<Wide>& exact = a_[task];
    const Wide error = (a.template cast<Wide>() - exact).norm();
    record.relative = quotient(error, exact.norm());
    if (has_M_) {
      const AccelerationError e = acceleration_error(a, exact, M_);
      record.energy = e.energy;
      if (std::isnan(e.energy))  // drowned in long double
        record.energy = acceleration_error(a, truth_.responses[task].a, truth_.M).energy;
      record.componentwise = e.componentwise;
      const BackwardError b = backward_error(a, exact, M_);
      record.backward = b.normwise;
      record.oettli_prager = b.componentwise;
    }
    const Task<T>& asked = tasks_[task].second;
    Wide brought = asked.qd.template cast<Wide>().squaredNorm();
    if (asked.gravity) brought += Wide(model_.gravity().norm());
    record.told = error_as_told<Wide>(error, exact.norm(), unit_roundoff<T>() * brought);
    if (record.kS > 0) record.eta = eta<T>(record.relative, record.kS);
  }

  Record inverse(const RegisteredVariant<T>& variant) const {
    Record record{.task = "inverse", .variant = variant.name};
    MatrixX<T> X = MatrixX<T>::Constant(nv_, nv_, std::numeric_limits<T>::quiet_NaN());
    record.outcome = variant.make(model_)->inverse(q_, X);
    if (!truth_.outcome || !record.outcome) return record;
    const MatrixError e = matrix_error(X, X_);
    record.relative = e.relative;
    record.componentwise = e.scaled;
    record.backward = inverse_residual(X, M_);
    return record;
  }

  void add_factors(const RegisteredVariant<T>& variant, std::vector<Record>& out) const {
    const auto solver = variant.make(model_);
    if (!solver->has_factors()) return;
    Record record{.task = "factors", .variant = variant.name};
    VectorX<T> D = VectorX<T>::Constant(nv_, std::numeric_limits<T>::quiet_NaN());
    MatrixX<T> g = MatrixX<T>::Constant(6, nv_, std::numeric_limits<T>::quiet_NaN());
    record.outcome = solver->factors(q_, D, g);
    if (record.outcome && truth_.outcome) {
      const FactorError e = factor_error(D, g, D_, g_);
      record.relative = e.D;
      record.componentwise = e.g;
    }
    if (record.outcome) look_at_covariance(*solver, record);
    out.push_back(std::move(record));
  }

  void look_at_covariance(const Solver<T>& solver, Record& record) const {
    record.P_min = record.P_constraint = record.P_asymmetry = 0;
    for (int k = 0; k < nv_; ++k) {
      Matrix6<double> P;
      for (int i = 0; i < 6; ++i)
        P.col(i) = solver.P_plus_times(k, Vector6<T>(Vector6<T>::Unit(i))).template cast<double>();
      const double size = P.norm();
      if (!(size > 0)) continue;
      const Eigen::SelfAdjointEigenSolver<Matrix6<double>> eigen(Matrix6<double>(P + P.transpose()),
                                                                 Eigen::EigenvaluesOnly);
      const double least = eigen.eigenvalues()[0] / eigen.eigenvalues()[5];
      record.P_min = std::min(record.P_min, least);
      record.P_asymmetry = std::max(record.P_asymmetry, (P - P.transpose()).norm() / size);
      const Joint<T>& joint = model_.joint(k);
      if (joint.r == T(0))
        record.P_constraint = std::max(record.P_constraint, P.row(joint.axis()).norm() / size);
    }
  }

  // Refined<V> next to V.
  static void link_refined(std::vector<Record>& records) {
    std::map<std::pair<std::string, std::string>, double> error;
    for (const Record& record : records) error[{record.variant, record.task}] = record.relative;
    for (Record& record : records) {
      const std::size_t begin = record.variant.find("Refined<");  // or WideRefined<
      if (begin == std::string::npos) continue;
      const std::string inner = record.variant.substr(begin + 8, record.variant.size() - begin - 9);
      if (const auto found = error.find({inner, record.task}); found != error.end())
        record.unrefined = found->second;
    }
  }

  Selection selection_;
  Model<T> model_, weightless_;
  VectorX<T> q_;
  int nv_;
  bool has_M_, has_inverse_;
  std::vector<std::pair<std::string, Task<T>>> tasks_;
  Truth<T> truth_;
  MatrixX<Wide> M_, X_, g_;
  VectorX<Wide> D_;
  std::vector<VectorX<Wide>> a_;
  Condition condition_{none, none};
};

}  // namespace

Measurement measure_case(const Case& c, std::uint64_t seed, const std::string& precision,
                         const Selection& selection) {
  if (precision == "float32" && !fits_float(plain(c.model)))
    throw NoTruth(NoTruth::Why::range, "a parameter is beyond the range of its precision");
  return precision == "float32" ? Measured<float>(c, seed, selection).measurement()
                                : Measured<double>(c, seed, selection).measurement();
}

std::string csv_rows(const Family& family, double value, std::uint64_t seed,
                     const std::string& precision, const Measurement& measured) {
  const std::string begin = field(family.name) + ',' + number(value) + ',' +
                            std::to_string(measured.nv) + ',' + std::to_string(seed) + ',' +
                            precision + ',';
  const Condition& c = measured.condition;
  const std::string kappa = short_number(c.kappa) + ',' + short_number(c.kappa_scaled) + ',';
  std::string out;
  for (const Record& r : measured.records) {
    out += begin + r.task + ',' + kappa + short_number(r.outcome ? r.kS : none) + ',' +
           field(r.variant) + ',' + to_string(r.outcome.status) + ',' + warning(r.outcome);
    for (const double x : {r.relative, r.energy, r.componentwise, r.backward, r.oettli_prager,
                           r.eta, r.outcome.error, r.unrefined})
      out += ',' + short_number(x);
    out += std::isnan(r.outcome.error)
               ? ",,"
               : ',' + std::to_string(r.outcome.steps) + (r.outcome.widened ? ",1" : ",0");
    for (const double x : {r.P_min, r.P_constraint, r.P_asymmetry}) out += ',' + short_number(x);
    out += '\n';
  }
  return out;
}

}  // namespace kalmarm::stress

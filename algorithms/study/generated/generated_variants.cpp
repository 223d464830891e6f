#include "algorithms/study/generated/generated_variants.hpp"

#include <array>
#include <cmath>
#include <optional>

#include "algorithms/generate/record_arguments.hpp"
#include "algorithms/study/registry.hpp"

namespace kalmarm {
namespace {

using Recordable =
    VariantList<Sequential<Conventional>, Sequential<Joseph>, Sequential<UD>, Sequential<ArrayMGS>,
                Sequential<ArrayGivens>, Sequential<ArrayHouseholder>, ClosedForm<Conventional>,
                Batch<EigenLLT>, Batch<SparseLTDL>>;

// Entries of the reference state: no two alike, none zero or special to a sine or cosine.
double reference(int i) { return 0.3 + std::fmod(0.618 * (i + 1), 1.0); }

VectorX<Recorded> input(TaskRecord& record, const char* name, int size, int first) {
  const std::vector<Recorded> x =
      add_input(record, name, size, [first](int i) { return reference(first + i); });
  return Eigen::Map<const VectorX<Recorded>>(x.data(), size);
}

// The same rotation up to a roundoff, with entries of -1, 0 and 1 where it turns by right angles: rotation(q) has exact
// zeros of these.
Eigen::Quaternion<double> with_right_angles(const Eigen::Quaternion<double>& q) {
  constexpr double few_roundoffs = 1e-15;
  Eigen::Quaternion<double> out = q;
  out.coeffs() /= q.coeffs().cwiseAbs().maxCoeff();
  for (double& entry : out.coeffs())
    if (std::abs(entry - std::round(entry)) <= few_roundoffs) entry = std::round(entry);
  return out;
}

Model<double> with_right_angles(const Model<double>& model) {
  std::vector<Joint<double>> joints;
  for (int k = 0; k < model.nv(); ++k) {
    joints.push_back(model.joint(k));
    joints[k].rotation = with_right_angles(model.joint(k).rotation);
    joints[k].body.axes = with_right_angles(model.joint(k).body.axes);
  }
  return {std::move(joints), model.names(), model.nq(), model.gravity()};
}

void require(const Outcome& outcome) {
  if (!outcome) throw RefusedRecord(outcome);
}

template <class V>
TaskRecord record_of(GeneratedTask task, const Model<double>& model) {
  TaskRecord out;
  out.task = task;
  const Recording recording(out.graph);
  SolverOf<V, Recorded> solver(with_right_angles(model).cast<Recorded>());
  const int nq = model.nq(), nv = model.nv();
  const VectorX<Recorded> q = input(out, "q", nq, 0);
  switch (task) {
    case GeneratedTask::forward_dynamics: {
      const VectorX<Recorded> qd = input(out, "qd", nv, nq), tau = input(out, "tau", nv, nq + nv);
      VectorX<Recorded> a(nv);
      require(solver.acceleration(q, qd, tau, a));
      add_output(out, "a", a);
      break;
    }
    case GeneratedTask::inverse_mass: {
      MatrixX<Recorded> X(nv, nv);
      require(solver.inverse(q, X));
      add_output(out, "X", X.reshaped());
      break;
    }
    case GeneratedTask::solve: {
      const VectorX<Recorded> tau = input(out, "tau", nv, nq);
      VectorX<Recorded> x(nv);
      require(solver.factor(q));
      solver.solve(tau, x);
      add_output(out, "x", x);
      break;
    }
    default:
      throw std::invalid_argument("variants of the study have no code for " + to_string(task));
  }
  return out;
}

template <class T>
class EvaluatedSolver final : public Solver<T> {
 public:
  EvaluatedSolver(const GeneratedVariant& variant, const Model<T>& model)
      : variant_(variant), model_(model.template cast<double>()) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    return evaluate(0, {&q, &qd, &tau}, a);
  }
  Outcome factor(const VectorX<T>& q) override {
    q_ = q;
    VectorX<T> x(model_.nv());
    return evaluate(1, {&q, &x.setZero()}, x);
  }
  void solve(const VectorX<T>& tau, VectorX<T>& x) override { (void)evaluate(1, {&q_, &tau}, x); }
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override { return evaluate(2, {&q}, X); }
  void mass(const VectorX<T>&, MatrixX<T>& M) override {
    M.setConstant(std::numeric_limits<T>::quiet_NaN());
  }

 private:
  static constexpr std::array tasks = {GeneratedTask::forward_dynamics, GeneratedTask::solve,
                                       GeneratedTask::inverse_mass};

  template <class Result>
  Outcome evaluate(int task, const std::vector<const VectorX<T>*>& inputs, Result& out) {
    std::optional<TaskRecord>& record = records_[task];
    try {
      if (!record) record = variant_.record(tasks[task], model_);
    } catch (const RefusedRecord& refused) {
      out.setConstant(std::numeric_limits<T>::quiet_NaN());
      return refused.outcome;
    }
    std::vector<T> given;
    for (const VectorX<T>* input : inputs) given.insert(given.end(), input->begin(), input->end());
    const std::vector<T> x = record->graph.template evaluate<T>(record->results, given);
    std::copy(x.begin(), x.end(), out.data());
    return out.allFinite() ? Outcome{} : Outcome{.status = Outcome::Status::not_finite};
  }

  GeneratedVariant variant_;
  Model<double> model_;
  VectorX<T> q_;
  std::array<std::optional<TaskRecord>, tasks.size()> records_;  // of what was asked for
};

}  // namespace

const std::vector<GeneratedVariant>& generated_variants() {
  static const std::vector<GeneratedVariant> all = [] {
    std::vector<GeneratedVariant> out;
    Recordable::for_each([&]<class V>() {
      VariantTraits traits = traits_of<V>(false);
      traits.generated = true;
      out.push_back({"Generated<" + V::name() + ">", V::equation, traits, record_of<V>});
    });
    return out;
  }();
  return all;
}

template <class T>
std::vector<RegisteredVariant<T>> evaluated_variants() {
  std::vector<RegisteredVariant<T>> out;
  for (const GeneratedVariant& variant : generated_variants())
    out.push_back({variant.name, variant.equation, variant.traits,
                   [variant](const Model<T>& model) {
                     return std::unique_ptr<Solver<T>>(
                         std::make_unique<EvaluatedSolver<T>>(variant, model));
                   },
                   [](const Model<T>& model) { return model.nv() <= most_recorded_dofs; }});
  return out;
}

template std::vector<RegisteredVariant<float>> evaluated_variants<float>();
template std::vector<RegisteredVariant<double>> evaluated_variants<double>();

}  // namespace kalmarm

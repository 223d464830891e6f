// An engine in double: what a robot gives once (ModelsInDouble), lanes for rows of states
// (rows_in_lanes.hpp), and the memory of every worker for one state after another, which answers the rows
// that lanes leave over too. A call of one state is worker 0's.
#pragma once

#include <algorithm>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/rows_in_lanes.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

struct ModelsInDouble {
  RobotModel robot;
  EngineOptions options;
  bool refined;  // every answer is
  Model<double> model;
  LoweredModel<double> lowered;
  Acceptance<double> acceptance;

  ModelsInDouble(const RobotModel& of_robot, const EngineOptions& of_engine)
      : robot(of_robot),
        options(of_engine),
        refined(options.tolerance < least_tolerance_of_double),
        model(model_of(robot)),
        lowered(model, options.zeros, accepted_error(tolerance_of_sweeps()), options.frames),
        acceptance(robot, lowered, tolerance_of_sweeps()) {}
  ModelsInDouble(const ModelsInDouble&) = delete;

  // What refines, made by the first that asks.
  const std::shared_ptr<const CertifiedModels>& certified() {
    if (!certified_) certified_ = make_certified_models(lowered, robot, options);
    return certified_;
  }

  // Of what wants `want` alone.
  EngineOptions options_for(std::set<Want> want) const {
    EngineOptions out = options;
    out.want = std::move(want);
    if (std::none_of(out.want.begin(), out.want.end(), is_of_frames)) out.selection = {};
    return out;
  }

 private:
  // What is refined in any case starts from a sweep like any other.
  double tolerance_of_sweeps() const {
    return refined ? default_tolerance<double> : options.tolerance;
  }

  std::shared_ptr<const CertifiedModels> certified_;
};

// A call of one state, by the memory of a worker.
template <class State>
Outcome answer_by(State& state, const Call<double>& call) {
  switch (call.want) {
    case Want::acceleration:
      return call.B ? state.with_columns(call) : state.acceleration(call);
    case Want::inverse_dynamics:
      return state.inverse_dynamics(call);
    case Want::mass:
      return state.mass(call);
    case Want::derivatives:
      return state.differentiate(call);
    case Want::solve: {
      const Outcome of_D = state.factor(call);
      return of_D ? state.solve(1, call.tau, call.out) : of_D;
    }
    default:
      return state.by_factors(call);
  }
}

// State: what answer_by and Engine ask, made by State(ModelsInDouble&, const EngineOptions&);
// takes_lanes(want): whether rows are answered in lanes, by the sweep of F;
// answer_rows(count, call, outcomes, left_over) answers those that are left over, in memory that
// reserve_rows(want) has taken.
template <class State, class F>
class EngineInDouble final : public Engine<double> {
 public:
  EngineInDouble(const RobotModel& robot, const EngineOptions& options)
      : models_(robot, options),
        lanes_(models_.lowered, models_.acceptance, options.selection, options.wants(Want::solve)) {
    workers_.emplace_back(models_, options);
  }

  bool answers_in_part() const override { return true; }

  Outcome answer(const Call<double>& call) override { return answer_by(workers_[0].state, call); }
  Outcome factor(const Call<double>& call) override { return workers_[0].state.factor(call); }
  Outcome solve(int columns, const double* taus, double* X) override {
    return workers_[0].state.solve(columns, taus, X);
  }

  void reserve_workers(Want want, int count) override {
    if (workers_[0].state.takes_lanes(want)) lanes_.reserve(want, count);
    workers_[0].state.reserve_rows(want);
    for (int i = 1; i < count; ++i) {
      std::set<Want> wanted = {want};
      if (want == Want::acceleration && models_.options.wants(Want::solve))
        wanted.insert(Want::solve);  // of columns beside accelerations
      if (i < static_cast<int>(workers_.size())) {
        if (workers_[i].wanted.contains(want)) continue;
        wanted.merge(workers_[i].wanted);
        workers_[i] = Worker(models_, models_.options_for(wanted));
      } else {
        workers_.emplace_back(models_, models_.options_for(wanted));
      }
      for (const Want one : workers_[i].wanted) workers_[i].state.reserve_rows(one);
    }
  }

  void answer_rows(int worker, int count, const Call<double>& call, Outcome* outcomes) override {
    Worker& w = workers_[worker];
    w.left_over.resize(count);
    lanes_.answer(worker, count, call, outcomes, w.left_over.data());
    w.state.answer_rows(count, call, outcomes, w.left_over.data());
  }

 private:
  struct Worker {
    std::set<Want> wanted;
    State state;
    std::vector<char> left_over;

    Worker(ModelsInDouble& models, const EngineOptions& options)
        : wanted(options.want), state(models, options) {}
  };

  ModelsInDouble models_;
  RowsInLanes<double, F> lanes_;
  std::vector<Worker> workers_;
};

}  // namespace kalmarm

#include <vector>

#include "algorithms/fast/check/lane_check.hpp"
#include "algorithms/fast/engines/engines.hpp"

namespace kalmarm {
namespace {

class EngineOfChecks final : public CheckEngine {
 public:
  EngineOfChecks(const RobotModel& robot, const AnswerCheckOptions& options)
      : models_(robot, options) {
    reserve_workers(1);
  }

  void reserve_workers(int count) override {
    while (static_cast<int>(workers_.size()) < count)
      workers_.push_back(std::make_unique<LaneCheck>(models_));
  }

  void answer_rows(int worker, int count, const CheckCall& call, AnswerError* errors) override {
    workers_[worker]->answer(count, call, errors);
  }

 private:
  CheckModels models_;
  std::vector<std::unique_ptr<LaneCheck>> workers_;
};

}  // namespace

std::unique_ptr<CheckEngine> make_check_engine(const RobotModel& robot,
                                               const AnswerCheckOptions& options) {
  return std::make_unique<EngineOfChecks>(robot, options);
}

}  // namespace kalmarm

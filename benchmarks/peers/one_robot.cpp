// The code that `generate` makes for the mechanism at hand, compiled as C by gcc and by clang, in both precisions. A
// task's code is made when the task is asked for the first time; what a compiler made of it stays in the build folder
// and is taken again by the next run.
//
//   Generated          a task by itself
//   Generated<judged>  accelerations with their estimated error and margin, as every call of the library has them
#include <ctime>
#include <exception>
#include <iostream>
#include <optional>
#include <type_traits>

#include "algorithms/generate/c_library.hpp"
#include "algorithms/generate/package.hpp"
#include "benchmarks/peers/peer.hpp"

namespace kalmarm {
namespace {

constexpr int tasks = 4;  // the first of Task, up to mass

const std::vector<std::string> flags = {"-O3", "-march=native", "-ffp-contract=fast",
                                        "-fno-math-errno"};

template <class T>
class OneRobot final : public Peer {
 public:
  OneRobot(const Mechanism& mechanism, std::string compiler_name, CCompiler compiler, bool judged)
      : mechanism_(mechanism),
        compiler_name_(std::move(compiler_name)),
        compiler_(std::move(compiler)),
        judged_(judged) {}

  std::string name() const override {
    return (judged_ ? "Generated<judged>@" : "Generated@") + compiler_name_;
  }
  std::string version() const override { return ""; }
  bool is_float32() const override { return std::is_same_v<T, float>; }
  bool can(Task task) const override {
    return judged_ ? task == Task::acceleration : is_common(task);
  }
  bool has_batch(Task) const override { return true; }
  double flops(Task task, bool) const override { return codes_[static_cast<int>(task)].flops; }
  double seconds_to_generate(Task task) const override {
    return can(task) ? codes_[static_cast<int>(task)].seconds : 0;
  }

  void add_state(const double* q, const double* qd, const double* tau) override {
    q_.insert(q_.end(), q, q + mechanism_.nq);
    qd_.insert(qd_.end(), qd, qd + mechanism_.nv);
    tau_.insert(tau_.end(), tau, tau + mechanism_.nv);
    const std::size_t n = static_cast<std::size_t>(mechanism_.nv);
    out_.resize((states_ + 1) * n * n);
    error_.resize(states_ + 1);
    margin_.resize(states_ + 1);
    ++states_;
  }

  bool acceleration(int i) override { return one(Task::acceleration, i); }
  bool inverse_dynamics(int i) override { return one(Task::inverse_dynamics, i); }
  bool inverse(int i) override { return one(Task::inverse, i); }
  bool mass(int i) override { return one(Task::mass, i); }
  bool batch(Task task) override {
    const Code& code = made(task);
    if (!code.rows) return false;
    call(task, code.rows, 0, static_cast<std::size_t>(states_));
    return true;
  }

  void get_acceleration(int i, double* a) const override { put(mechanism_.nv, i, a); }
  void get_torque(int i, double* tau) const override { put(mechanism_.nv, i, tau); }
  void get_matrix(int i, double* out) const override { put(mechanism_.nv * mechanism_.nv, i, out); }

 private:
  struct Code {
    std::optional<CLibrary> library = {};
    void (*one)() = nullptr, (*rows)() = nullptr;
    double seconds = 0, flops = 0;
    bool asked = false;
  };

  int states() const override { return states_; }

  void put(int size, int i, double* out) const {
    const T* const from = &out_[static_cast<std::size_t>(i) * size];
    std::copy(from, from + size, out);
  }

  bool one(Task task, int i) {
    const Code& code = made(task);
    if (!code.one) return false;
    call(task, code.one, i);
    return true;
  }

  // Of state i, or of so many rows.
  template <class... Rows>
  void call(Task task, void (*function)(), int i, Rows... rows) {
    const int nq = mechanism_.nq, nv = mechanism_.nv;
    const T *q = &q_[i * nq], *qd = &qd_[i * nv], *tau = &tau_[i * nv];
    T* const out = &out_[static_cast<std::size_t>(i) *
                         (task == Task::inverse || task == Task::mass ? nv * nv : nv)];
    if (task == Task::inverse || task == Task::mass) {
      reinterpret_cast<void (*)(Rows..., const T*, T*)>(function)(rows..., q, out);
    } else if (judged_) {
      using Function = void(Rows..., const T*, const T*, const T*, T*, T*, T*);
      reinterpret_cast<Function*>(function)(rows..., q, qd, tau, out, &error_[i], &margin_[i]);
    } else {
      using Function = void(Rows..., const T*, const T*, const T*, T*);
      reinterpret_cast<Function*>(function)(rows..., q, qd, tau, out);
    }
  }

  GeneratedTask generated(Task task) const {
    switch (task) {
      case Task::inverse_dynamics:
        return GeneratedTask::inverse_dynamics;
      case Task::inverse:
        return GeneratedTask::inverse_mass;
      case Task::mass:
        return GeneratedTask::mass;
      default:
        return judged_ ? GeneratedTask::judged_forward_dynamics : GeneratedTask::forward_dynamics;
    }
  }

  // Without functions where no code came about, after saying why.
  const Code& made(Task task) {
    Code& code = codes_[static_cast<int>(task)];
    if (code.asked) return code;
    code.asked = true;
    try {
      const std::clock_t start = std::clock();
      const Package<T> package(*mechanism_.model, std::vector<double>(mechanism_.nq, 0.0),
                               {"robot", {generated(task)}, true});
      std::map<std::string, std::string> files = package.files({});
      files.erase("robot.md");
      files.erase("robot_test.c");
      const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      const CLibrary library = make_library(files, compiler_, KALMARM_GENERATED_FOLDER);
      const TaskRecord& record = package.records()[0];
      const std::string name = "robot_" + to_string(record.task);
      code.flops = record.graph.count(record.results).flops();
      code.library = library;
      code.seconds = seconds + library.made().seconds;
      code.one = library.function<void()>(name);
      code.rows = library.function<void()>(name + "_rows");
    } catch (const std::exception& e) {
      std::cerr << name() << ": " << e.what() << '\n';
    }
    return code;
  }

  const Mechanism& mechanism_;
  std::string compiler_name_;
  CCompiler compiler_;
  bool judged_;
  int states_ = 0;
  Code codes_[tasks];
  std::vector<T> q_, qd_, tau_, out_, error_, margin_;
};

}  // namespace
}  // namespace kalmarm

void kalmarm_peers(const kalmarm::Mechanism& mechanism, kalmarm::Peers& peers) {
  using namespace kalmarm;
  if (mechanism.nv > most_generated_dofs) return;
  const auto add = [&](const char* name, const char* path) {
    if (!*path) return;
    const CCompiler compiler{{path}, flags};
    for (const bool judged : {false, true}) {
      peers.push_back(std::make_unique<OneRobot<double>>(mechanism, name, compiler, judged));
      peers.push_back(std::make_unique<OneRobot<float>>(mechanism, name, compiler, judged));
    }
  };
  add("gcc", KALMARM_GCC);
  add("clang", KALMARM_CLANG);
}

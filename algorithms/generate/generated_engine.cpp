#include "algorithms/generate/generated_engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <type_traits>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/generate/compiled_task.hpp"
#include "algorithms/generate/trial_states.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {
namespace {

// What a call writes, so many numbers a row; null where it is not wanted.
template <class T>
struct Result {
  T* at;
  std::ptrdiff_t numbers;
};
template <class T>
std::array<Result<T>, 4> results(const Call<T>& call, const Widths& width) {
  const auto& [dq, dqd, dtau] = call.derivatives;
  const std::ptrdiff_t square = width.n * width.n;
  return {{{call.out, width.out(call.want)}, {dq, square}, {dqd, square}, {dtau, square}}};
}
// With results one after another from `first` on, `apart` numbers between those of so many rows.
template <class T>
Call<T> writing_to(T* first, Call<T> call, const Widths& width, std::ptrdiff_t rows,
                   std::ptrdiff_t apart = 0) {
  const auto place = [&](T*& result, std::ptrdiff_t numbers) {
    if (!result) return;
    result = first;
    first += rows * numbers + apart;
  };
  place(call.out, width.out(call.want));
  for (T*& X : call.derivatives) place(X, width.n * width.n);
  return call;
}
template <class T>
std::ptrdiff_t numbers_of_row(const Call<T>& call, const Widths& width) {
  std::ptrdiff_t sum = 0;
  for (const Result<T>& result : results(call, width)) sum += result.at ? result.numbers : 0;
  return sum;
}

// Whether rows of all that are given and those of the results share memory.
template <class T>
bool overlap(const Call<T>& call, std::ptrdiff_t rows, const Widths& width) {
  const std::less<const T*> before;
  const auto written = results(call, width);
  const auto meets = [&](const T* in, std::ptrdiff_t numbers) {
    return in && std::any_of(written.begin(), written.end(), [&](const Result<T>& result) {
             return result.at && before(in, result.at + rows * result.numbers) &&
                    before(result.at, in + rows * numbers);
           });
  };
  return meets(call.q, width.nq) || meets(call.qd, width.nv) ||
         meets(call.tau, width.tau(call.want)) || meets(call.loads, width.l);
}

template <class T>
bool all_finite(std::ptrdiff_t count, const T* x) {
  constexpr std::ptrdiff_t sums = 32;  // that do not wait for each other
  T check[sums] = {}, rest = 0;
  std::ptrdiff_t i = 0;
  for (; i + sums <= count; i += sums)
    for (std::ptrdiff_t j = 0; j < sums; ++j) check[j] += x[i + j] * 0;
  for (; i < count; ++i) rest += x[i] * 0;
  for (const T& one : check) rest += one;
  return rest == 0;
}

// What functions depend on, but for their task: equal texts are the same robot, whatever its names are.
std::string numbers_of(const RobotModel& robot, double tolerance,
                       const std::vector<Frame>& loaded) {
  std::string out;
  const auto add = [&out](const auto&... x) {
    (out.append(reinterpret_cast<const char*>(&x), sizeof x), ...);
  };
  add(tolerance, robot.nq, robot.gravity);
  for (const LinkParameters& link : robot.links)
    add(link.parent, link.coordinate, link.slides, link.q_index, link.reference, link.rotation,
        link.translation, link.armature, link.mass, link.center_of_mass, link.inertia_axes,
        link.principal_moments);
  for (const Frame& frame : loaded) add(frame.link, frame.rotation, frame.translation);
  return out;
}

// Functions that this process has in use, by what they were made from: objects of the same robot share them.
template <class T>
class InUse {
 public:
  using Task = std::shared_ptr<const CompiledTask<T>>;

  Task find(const std::string& key) {
    const std::lock_guard lock(mutex_);
    return tasks_[key].lock();
  }
  void keep(const std::string& key, const Task& task) {
    const std::lock_guard lock(mutex_);
    std::erase_if(tasks_, [](const auto& one) { return one.second.expired(); });
    tasks_[key] = task;
  }

  static InUse& all() {
    static InUse in_use;
    return in_use;
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::weak_ptr<const CompiledTask<T>>> tasks_;
};

template <class T>
class GeneratedEngine final : public Engine<T> {
 public:
  GeneratedEngine(std::unique_ptr<Engine<T>> loops, const RobotModel& robot,
                  const EngineOptions& options, const CodeOptions& code,
                  std::vector<std::string>& notes)
      : loops_(std::move(loops)),
        width_(robot.nq, robot.nv(), robot.nv(), options.selection.size(), options.frames) {
    try {
      compile(robot, options, code, notes);
    } catch (const std::exception& e) {
      notes.push_back("the library's loops answer: " + std::string(e.what()));
    }
  }

  bool answers_in_part() const override { return loops_->answers_in_part(); }

  Outcome answer(const Call<T>& call) override {
    const CompiledTask<T>* const code = code_of(call, 1);
    if (!code || !code->has_one()) return loops_->answer(call);
    if (!code->judged()) {
      if (!is_near(1, call)) return loops_->answer(call);
      code->one(call, nullptr, nullptr);
      return {};
    }
    T error = 0, margin = 0;
    code->one(call, &error, &margin);
    if (!(margin > 0)) return loops_->answer(call);
    return call.want == Want::acceleration ? Outcome{.error = error} : Outcome{};
  }

  void reserve_workers(Want want, int count) override {
    loops_->reserve_workers(want, count);
    while (static_cast<int>(workers_.size()) < count) workers_.emplace_back();
  }

  void answer_rows(int worker, int count, const Call<T>& call, Outcome* outcomes) override {
    const CompiledTask<T>* const code = code_of(call, count);
    if (!code || !code->has_rows()) return loops_->answer_rows(worker, count, call, outcomes);
    for (int first = 0; first < count; first += rows_at_once)
      block(worker, *code, std::min(rows_at_once, count - first), call.from(first, width_),
            outcomes ? outcomes + first : nullptr);
  }

  Outcome factor(const Call<T>& call) override { return loops_->factor(call); }
  Outcome solve(int columns, const T* taus, T* X) override {
    return loops_->solve(columns, taus, X);
  }

 private:
  static constexpr int rows_at_once = 64;  // whose results stay in the first cache

  struct Worker {
    std::array<T, rows_at_once> error, margin;
    // Of the rows that climb, side by side.
    std::vector<int> chosen;
    std::vector<T> q, qd, tau, loads, out;
    std::vector<Outcome> outcomes;
  };

  const CompiledTask<T>* code_of(const Call<T>& call, std::ptrdiff_t rows) const {
    const CompiledTask<T>* const code = tasks_[static_cast<int>(call.want)].get();
    if (!code || call.forces || call.contacts || code->loaded() != bool(call.loads) ||
        call.gravity || call.r || call.B || overlap(call, rows, width_))
      return nullptr;
    const auto& [dq, dqd, dtau] = call.derivatives;
    return call.want != Want::derivatives || (dq && dqd && dtau) ? code : nullptr;
  }

  // Whether generated code reduces all angles of so many rows; what else is beyond is left to the loops too.
  bool is_near(int rows, const Call<T>& call) const {
    bool out = true;
    for (std::ptrdiff_t i = 0; i < rows * width_.nq; ++i)
      out &= std::abs(call.q[i]) <= detail::SinCosConstants<T>::farthest;
    return out;
  }
  // Whether the results of so many rows, that are not judged, can be used.
  bool is_sound(int rows, const Call<T>& call, const Outcome* outcomes) const {
    return is_near(rows, call) && (!outcomes || all_finite(rows * width_.out(call.want), call.out));
  }

  void block(int worker, const CompiledTask<T>& code, int count, const Call<T>& call,
             Outcome* outcomes) {
    Worker& w = workers_[worker];
    code.rows(count, call, w.error.data(), w.margin.data());
    if (outcomes) std::fill_n(outcomes, count, answered_in_lanes<T>());
    w.chosen.clear();
    if (code.judged()) {
      for (int i = 0; i < count; ++i) {
        if (call.want == Want::acceleration) outcomes[i].error = w.error[i];
        if (!(w.margin[i] > 0)) w.chosen.push_back(i);
      }
    } else if (!is_sound(count, call, outcomes)) {
      for (int i = 0; i < count; ++i)
        if (!is_sound(1, call.from(i, width_), outcomes)) w.chosen.push_back(i);
    }
    if (!w.chosen.empty()) climb(worker, call, outcomes);
  }

  // The rows that are chosen, to the loops.
  void climb(int worker, const Call<T>& call, Outcome* outcomes) {
    Worker& w = workers_[worker];
    const std::size_t count = w.chosen.size();
    const auto gather = [&](const T* from, std::ptrdiff_t numbers, std::vector<T>& to) -> const T* {
      if (!from) return nullptr;
      to.clear();
      for (const int i : w.chosen)
        to.insert(to.end(), from + i * numbers, from + (i + 1) * numbers);
      return to.data();
    };
    w.out.resize(count * numbers_of_row(call, width_));
    w.outcomes.resize(count);
    Call<T> rows = writing_to(w.out.data(), call, width_, count);
    rows.q = gather(call.q, width_.nq, w.q);
    rows.qd = gather(call.qd, width_.nv, w.qd);
    rows.tau = gather(call.tau, width_.tau(call.want), w.tau);
    rows.loads = gather(call.loads, width_.l, w.loads);
    loops_->answer_rows(worker, static_cast<int>(count), rows, w.outcomes.data());
    const auto from = results(rows, width_), to = results(call, width_);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < to.size(); ++j)
        if (to[j].at)
          std::copy_n(from[j].at + i * to[j].numbers, to[j].numbers,
                      to[j].at + w.chosen[i] * to[j].numbers);
      if (outcomes) outcomes[w.chosen[i]] = w.outcomes[i];
    }
  }

  // --- when it is made

  void compile(const RobotModel& robot, const EngineOptions& options, const CodeOptions& code,
               std::vector<std::string>& notes) {
    if (options.kernel == Kernel::translational || robot.nv() == 0)
      throw std::runtime_error("a mechanism of slides alone has sweeps of its own");
    const CCompiler compiler = compiler_of(code);
    const std::filesystem::path folder = folder_of(code);
    std::string key = numbers_of(robot, options.tolerance, options.frames.loaded) +
                      folder.string() + (code.rows ? " rows" : "");
    for (const std::string& word : compiler.command) key += ' ' + word;
    for (const CodeFor& of : code_for) {
      if (!options.wants(of.want) || (!code.tasks.empty() && !code.tasks.contains(of.want)))
        continue;
      std::string note = to_string(of.want), name = note;
      name += ' ';
      name += key;
      try {
        check(of, options, code.rows);
        auto task = InUse<T>::all().find(name);
        if (!task) {
          // The library answers one state of float in double.
          task = std::make_shared<CompiledTask<T>>(of, model_of(robot), options.frames.loaded,
                                                   options.tolerance, std::is_same_v<T, double>,
                                                   code.rows, compiler, folder);
          test(*task, robot, options);
          InUse<T>::all().keep(name, task);
        }
        note += ": generated code, ";
        note += note_of(task->library().made(), compiler);
        tasks_[static_cast<int>(of.want)] = task;
      } catch (const std::exception& e) {
        note += ": the library's loops answer: ";
        note += e.what();
      }
      notes.push_back(note);
    }
  }

  static void check(const CodeFor& of, const EngineOptions& options, bool rows) {
    if (std::is_same_v<T, float> && !rows)
      throw std::runtime_error("one state of float is answered in double");
    if (!of.judged) return;
    if (of.want == Want::acceleration && options.kernel == Kernel::spatial_at_rest)
      throw std::runtime_error("accelerations at rest have sweeps of their own");
    if (options.tolerance <
        (std::is_same_v<T, float> ? least_tolerance_of_float : least_tolerance_of_double))
      throw std::runtime_error("the tolerance asks for refined answers");
  }

  static std::string note_of(const CLibrary::Made& made, const CCompiler& compiler) {
    std::ostringstream out;
    out.precision(2);
    out << "compiled by " << compiler.command[0] << ' ' << made.version << " in " << made.seconds
        << " s" << (made.was_there ? " before" : "") << ": " << made.path.string();
    return out.str();
  }

  // Against the loops, in states of all kinds of joints; what they do not accept says nothing.
  void test(const CompiledTask<T>& code, const RobotModel& robot, const EngineOptions& options) {
    constexpr int count = 37;  // more than two registers hold, and no multiple
    constexpr std::ptrdiff_t apart = 64;
    const TrialStates<T> states(robot, count, options.frames.loaded.size());
    constexpr T unset = std::numeric_limits<T>::quiet_NaN(), untouched = -77;
    T wanted = 0;
    Call<T> call{.want = code.want(),
                 .q = states.q.data(),
                 .qd = states.qd.data(),
                 .tau = states.tau.data(),
                 .out = &wanted,
                 .loads = code.loaded() ? states.loads.data() : nullptr};
    if (code.want() == Want::derivatives) call.derivatives = {&wanted, &wanted, &wanted};
    const std::ptrdiff_t size =
        count * numbers_of_row(call, width_) + apart * std::ssize(results(call, width_));
    std::vector<T> of_one(size, unset), of_rows(size, untouched), of_loops(size, unset),
        error(2 * count, unset), margin(error);
    const auto with = [&](std::vector<T>& out) {
      return writing_to(out.data(), call, width_, count, apart);
    };
    const Call<T> one = with(of_one), rows = with(of_rows), truth = with(of_loops);
    if (code.has_rows()) code.rows(count, rows, error.data(), margin.data());
    for (const Result<T>& result : results(rows, width_)) {
      if (!result.at) continue;
      const T* const end = result.at + count * result.numbers;
      if (std::any_of(end, end + apart, [&](T x) { return x != untouched; }))
        throw std::runtime_error("rows are written beyond their end");
    }
    bool any = false;
    for (int i = 0; i < count; ++i) {
      if (code.has_one()) code.one(one.from(i, width_), &error[count + i], &margin[count + i]);
      const Outcome outcome = loops_->answer(truth.from(i, width_));
      const auto agrees = [&](bool there, const Call<T>& by, T margin_there) {
        if (!there || !outcome || (code.judged() && !(margin_there > 0))) return true;
        any = true;
        const auto x = results(by.from(i, width_), width_),
                   y = results(truth.from(i, width_), width_);
        for (std::size_t j = 0; j < x.size(); ++j)
          if (x[j].at && !agree(x[j].at, y[j].at, x[j].numbers, bound(code, robot, options)))
            return false;
        return true;
      };
      if (!agrees(code.has_rows(), rows, margin[i]) ||
          !agrees(code.has_one(), one, margin[count + i]))
        throw std::runtime_error("its results are wrong");
    }
    if (!any) throw std::runtime_error("none of its results is accepted");
  }

  struct Bound {
    T relative, least;
  };
  // What is judged by what both may be wrong (entries of M^-1 beside its diagonal's, derivatives, whose error neither
  // tells, likewise); of sums of products alone no more than their rounding, with room.
  static Bound bound(const CompiledTask<T>& code, const RobotModel& robot,
                     const EngineOptions& options) {
    constexpr T roundings = 4096;
    if (!code.judged()) return {roundings * std::numeric_limits<T>::epsilon(), 0};
    if (code.want() != Want::acceleration)
      return {T(2 * options.tolerance * std::sqrt(double(robot.nv()))), 0};
    const auto& g = robot.gravity;
    return {T(2 * options.tolerance), T(least_beside_gravity * std::hypot(g[0], g[1], g[2]))};
  }
  static bool agree(const T* x, const T* truth, std::ptrdiff_t size, const Bound& bound) {
    T largest = 0, squares = 0, apart = 0;
    for (std::ptrdiff_t k = 0; k < size; ++k) largest = std::max(largest, std::abs(truth[k]));
    if (largest == 0) largest = 1;
    for (std::ptrdiff_t k = 0; k < size; ++k) {
      squares += (truth[k] / largest) * (truth[k] / largest);
      const T off = x[k] / largest - truth[k] / largest;
      apart += off * off;
    }
    return std::sqrt(apart) <= bound.relative * std::max(std::sqrt(squares), bound.least / largest);
  }

  std::unique_ptr<Engine<T>> loops_;
  Widths width_;
  std::array<typename InUse<T>::Task, static_cast<int>(Want::derivatives) + 1> tasks_ = {};
  std::vector<Worker> workers_;
};

}  // namespace

template <class T>
std::unique_ptr<Engine<T>> with_generated_code(std::unique_ptr<Engine<T>> loops,
                                               const RobotModel& robot,
                                               const EngineOptions& options,
                                               const CodeOptions& code,
                                               std::vector<std::string>& notes) {
  return std::make_unique<GeneratedEngine<T>>(std::move(loops), robot, options, code, notes);
}

template std::unique_ptr<Engine<float>> with_generated_code(std::unique_ptr<Engine<float>>,
                                                            const RobotModel&, const EngineOptions&,
                                                            const CodeOptions&,
                                                            std::vector<std::string>&);
template std::unique_ptr<Engine<double>> with_generated_code(std::unique_ptr<Engine<double>>,
                                                             const RobotModel&,
                                                             const EngineOptions&,
                                                             const CodeOptions&,
                                                             std::vector<std::string>&);

}  // namespace kalmarm

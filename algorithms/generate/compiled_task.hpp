// The functions of one task of one robot: recorded, printed, compiled, loaded.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/generate/c_library.hpp"
#include "algorithms/generate/package.hpp"
#include "algorithms/generate/task.hpp"
#include "kalmarm/call.hpp"
#include "kalmarm/kernels.hpp"

namespace kalmarm {

// What a call is answered by. judged: its error (of derivatives none) and margin come with the result, and what is not
// accepted by them has to be asked elsewhere; the others are right wherever they are finite. Derivatives of one state,
// and solves, by factors that they keep, the loops answer faster.
struct CodeFor {
  Want want;
  GeneratedTask task;
  bool judged;
  bool of_one_state = true;
};
inline constexpr CodeFor code_for[] = {
    {Want::acceleration, GeneratedTask::judged_forward_dynamics, true},
    {Want::inverse_dynamics, GeneratedTask::inverse_dynamics, false},
    {Want::mass, GeneratedTask::mass, false},
    {Want::inverse, GeneratedTask::judged_inverse_mass, true},
    {Want::diagonal, GeneratedTask::judged_diagonal, true},
    {Want::solve, GeneratedTask::judged_solve, true, false},
    {Want::derivatives, GeneratedTask::judged_derivatives, true, false}};

template <class T>
class CompiledTask {
 public:
  // Throws std::runtime_error, in one line, where there is no such code: a function longer than compilers take, a
  // compiler that fails. loaded: frames of which every call has loads. one_state: a function of one state too, where the
  // loops are not faster.
  CompiledTask(const CodeFor& of, const Model<double>& model, const std::vector<Frame>& loaded,
               double tolerance, bool one_state, bool rows, const CCompiler& compiler,
               const std::filesystem::path& folder);

  Want want() const { return of_.want; }
  bool judged() const { return of_.judged; }
  bool loaded() const { return loaded_; }
  bool has_one() const { return one_; }
  bool has_rows() const { return rows_; }
  const CLibrary& library() const { return library_; }

  // One state; error and margin are written where it is judged. out overlaps nothing.
  void one(const Call<T>& call, T* error, T* margin) const { run(one_, call, error, margin); }
  // So many row-major rows.
  void rows(std::size_t count, const Call<T>& call, T* error, T* margin) const {
    run(rows_, call, error, margin, count);
  }

 private:
  CompiledTask(const CodeFor& of, const Package<T>& package, bool one_state, bool rows,
               const CCompiler& compiler, const std::filesystem::path& folder);

  // The arguments of a task's function are those of its record (task.cpp): inputs, result, error and margin.
  template <class... Rows>
  void run(void (*code)(), const Call<T>& call, T* error, T* margin, Rows... rows) const {
    const auto of = [&](auto... x) {
      reinterpret_cast<void (*)(Rows..., decltype(x)...)>(code)(rows..., x...);
    };
    const auto answer = [&](auto... in) {
      const auto& [dq, dqd, dtau] = call.derivatives;
      if (call.want == Want::derivatives)
        of(in..., call.out, dq, dqd, dtau, margin);
      else if (judged())
        of(in..., call.out, error, margin);
      else
        of(in..., call.out);
    };
    const auto with = [&](auto... in) { loaded_ ? answer(in..., call.loads) : answer(in...); };
    switch (call.want) {
      case Want::derivatives:
      case Want::acceleration:
      case Want::inverse_dynamics:
        return with(call.q, call.qd, call.tau);
      case Want::solve:
        return with(call.q, call.tau);
      default:
        return with(call.q);
    }
  }

  CodeFor of_;
  bool loaded_;
  CLibrary library_;
  void (*one_)() = nullptr;
  void (*rows_)() = nullptr;
};

// What the options name, or is found. Throws std::runtime_error where there is none.
CCompiler compiler_of(const CodeOptions& options);

// The folder of what was compiled, made where it is not there. Throws std::runtime_error where it is not this user's
// alone.
std::filesystem::path folder_of(const CodeOptions& options);

}  // namespace kalmarm

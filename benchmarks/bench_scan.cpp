// bench_scan: time of forward dynamics by the filter as a scan, on one thread and on several, beside the
// same filter in sequence and the fast path, against N on one family of chains or trees.
//
// Names are acceleration/variant/family:N/float64; a scan's variant ends in its threads, as in
// "Scan<Conventional>@2". Wall time is real_time, cpu_time that of all threads together. Everything is
// verified before it is timed, against Sequential<Conventional>. The counter `bytes` is the memory
// taken for a call before it, of which a scan reads or writes nearly all; bandwidth/copy@THREADS is
// what the machine moves in a copy of arrays larger than its caches (bandwidth.hpp);
// kinematics/all/family:N is the part of a call that a scan has in sequence.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/scan/scan.hpp"
#include "algorithms/study/scan/square_root_element.hpp"
#include "benchmarks/bandwidth.hpp"
#include "benchmarks/run.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/scene/families.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "One random state, from q, qd and tau to the acceleration: kinematics (which is not parallel), "
    "velocity and bias terms, gravity, the test for singularity. Memory is taken before.";

constexpr int longest = 1'000'000;
constexpr double rounding = 1e-6;  // to catch what is wrong, not what is inexact

struct Options {
  std::string family = "chain";
  int largest = 100'000, links = 0;
  std::vector<int> threads = {1, 2};
  std::uint64_t seed = 1;
};

// A variant of the study on one model, with what its workspace is made of besides.
template <class V>
class Filter {
 public:
  template <class... More>
  explicit Filter(const Model<double>& model, const More&... more)
      : model_(model), kin_(model_), ws_(model_, more...) {}

  Outcome operator()(const State& state, VectorX<double>& a) {
    set_position(model_, state.q, kin_);
    set_velocity(model_, state.qd, kin_);
    const Outcome outcome = V::factor(model_, kin_, ws_);
    if (outcome) V::acceleration(model_, kin_, state.tau, ws_, a);
    return outcome;
  }

 private:
  Model<double> model_;
  LinkKinematics<double> kin_;
  typename V::template Workspace<double> ws_;
};

class FastPath {
 public:
  explicit FastPath(const Model<double>& model)
      : dynamics_(plain(model), {.question = {.want = {Want::acceleration}}}) {}

  Outcome operator()(const State& state, VectorX<double>& a) {
    return dynamics_.forward_dynamics(state.q, state.qd, state.tau, a);
  }

 private:
  Dynamics<double> dynamics_;
};

struct Case {
  Scene scene;
  State state;
  VectorX<double> a;  // by the filter in sequence
  std::string flaw;

  Case(const Family& family, int links, std::uint64_t seed)
      : scene(generated_scene(family.name + ":" + std::to_string(links), family.make(links))),
        state(random_states(scene, 1, seed).front()),
        a(links) {
    if (!Filter<Sequential<Conventional>>(scene.model)(state, a)) flaw = "singular";
  }
};

// What this process has of the heap [bytes].
double heap() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// A call is made where it is timed: of a million links each takes gigabytes.
template <class Make>
void add(const std::string& variant, const std::shared_ptr<const Case>& c, const Make& make) {
  benchmark::RegisterBenchmark(
      ("acceleration/" + variant + "/" + c->scene.name + "/float64").c_str(),
      [=](benchmark::State& run) {
        const double before = heap();
        const auto call = make(c->scene.model);
        const double bytes = heap() - before;
        VectorX<double> a =
            VectorX<double>::Constant(c->a.size(), std::numeric_limits<double>::quiet_NaN());
        std::string flaw = c->flaw;
        if (flaw.empty() && !(*call)(c->state, a)) flaw = "singular";
        if (flaw.empty() && !((a - c->a).norm() <= rounding * c->a.norm()))
          flaw = "wrong acceleration";
        if (!flaw.empty()) return run.SkipWithError(flaw.c_str());
        for (auto _ : run) {
          benchmark::DoNotOptimize((*call)(c->state, a));
          benchmark::DoNotOptimize(a.data());
        }
        using benchmark::Counter;
        run.counters["bytes"] = bytes;
        run.counters["s/link"] = Counter(static_cast<double>(c->a.size()),
                                         Counter::kIsIterationInvariantRate | Counter::kInvert);
      })
      ->Unit(benchmark::kMicrosecond)
      ->MeasureProcessCPUTime()
      ->UseRealTime();
}

template <class V>
void add_sequential(const std::shared_ptr<const Case>& c) {
  add(V::name(), c, [](const Model<double>& model) { return std::make_unique<Filter<V>>(model); });
}

template <class V>
void add_scan(const std::shared_ptr<const Case>& c, const Options& options) {
  for (const int threads : options.threads) {
    const scan::Options how{.links_of_block = options.links, .threads = threads};
    add(V::name() + "@" + std::to_string(threads), c,
        [how](const Model<double>& model) { return std::make_unique<Filter<V>>(model, how); });
  }
}

void add_kinematics(const std::shared_ptr<const Case>& c) {
  benchmark::RegisterBenchmark(("kinematics/all/" + c->scene.name + "/float64").c_str(),
                               [c](benchmark::State& run) {
                                 LinkKinematics<double> kin(c->scene.model);
                                 for (auto _ : run) {
                                   set_position(c->scene.model, c->state.q, kin);
                                   set_velocity(c->scene.model, c->state.qd, kin);
                                   benchmark::ClobberMemory();
                                 }
                               })
      ->Unit(benchmark::kMicrosecond)
      ->UseRealTime();
}

void add_all(const Options& options) {
  for (const int threads : options.threads)
    register_bandwidth(threads, beyond_caches)->MeasureProcessCPUTime()->UseRealTime();
  const Family& family = *std::ranges::find(families(), options.family, &Family::name);
  for (int links = 100; links <= options.largest; links *= 10) {
    const auto c = std::make_shared<const Case>(family, links, options.seed);
    add_kinematics(c);
    add("Ladder<default>", c,
        [](const Model<double>& model) { return std::make_unique<FastPath>(model); });
    add_sequential<Sequential<Conventional>>(c);
    add_scan<Scan<scan::Conventional>>(c, options);
    add_sequential<Sequential<ArrayGivens>>(c);
    add_scan<Scan<scan::SquareRoot>>(c, options);
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  Benchmarks benchmarks(argc, argv,
                        "Usage: bench_scan [--family NAME] [--largest N] [--links N] [--threads "
                        "N,…] [--seed S] [flags of Google Benchmark]\n\n");
  CLI::App app("Time of forward dynamics by the filter as a scan.", "bench_scan");
  Options options;
  std::vector<std::string> names;
  for (const Family& family : families()) names.push_back(family.name);
  app.add_option("--family", options.family, "of mechanisms, in random states")
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  app.add_option("--largest", options.largest,
                 "number of links that is timed, 100 times a power of 10")
      ->check(between(100, longest))
      ->capture_default_str();
  app.add_option("--links", options.links, "of a block; 0: by the number of links")
      ->check(between(0, longest))
      ->capture_default_str();
  app.add_option("--threads", options.threads, "of scans")
      ->delimiter(',')
      ->check(between(1, 1024))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the state")->check(any_seed())->capture_default_str();
  return run_program(app, argc, argv, [&] {
    add_all(options);
    benchmarks.run(timed_call);
    return 0;
  });
}

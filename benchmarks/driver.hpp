// What the benchmark programs share: the command line, and running what `add` registers.
#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "benchmarks/context.hpp"
#include "robots/program.hpp"

namespace kalmarm {

struct Driver {
  std::string name, about;               // of the program
  const char* timed_call;                // what a timed call includes
  std::string flags = "";                // of its own, as the usage line shows them
  std::vector<std::string> scenes = {};  // taken where none is given; empty: one has to be

  // main(): add(scenes, seed) registers the benchmarks. `configure` may add flags to the command
  // line, which Google Benchmark's have been taken out of by then.
  template <class Add, class Configure>
  int run(int argc, char** argv, const Add& add, const Configure& configure) {
    choose_openblas_kernels(argv);  // before Initialize takes its flags out of argv
    static std::string usage;       // Google Benchmark takes a function without arguments
    usage = "Usage: " + name + " SCENE... [--seed S] " + flags +
            "[flags of Google Benchmark]\n\n  SCENE: " + scene_help + "\n\n";
    benchmark::Initialize(&argc, argv, [] {
      std::fputs(usage.c_str(), stdout);
      benchmark::PrintDefaultHelp();
    });
    CLI::App app(about, name);
    std::uint64_t seed = 1;
    CLI::Option* const option = app.add_option("SCENE", scenes, scene_help);
    if (scenes.empty())
      option->required();
    else
      option->capture_default_str();
    app.add_option("--seed", seed, "of the random states")->capture_default_str();
    configure(app);
    return run_program(app, argc, argv, [&] {
      add(scenes, seed);
      add_context(timed_call);
      benchmark::RunSpecifiedBenchmarks();
      benchmark::Shutdown();
      return 0;
    });
  }

  template <class Add>
  int run(int argc, char** argv, const Add& add) {
    return run(argc, argv, add, [](CLI::App&) {});
  }
};

}  // namespace kalmarm

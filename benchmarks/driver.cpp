#include "benchmarks/driver.hpp"

#include <benchmark/benchmark.h>

#include <cstdio>

#include "accuracy/programs/open_scene.hpp"
#include "benchmarks/context.hpp"

namespace kalmarm {

int Driver::run(int argc, char** argv, const Add& add,
                const std::function<void(CLI::App&)>& configure) {
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
  LoadOptions read;
  CLI::Option* const option = add_scene(app, scenes, read);
  if (scenes.empty())
    option->required();
  else
    option->capture_default_str();
  app.add_option("--seed", seed, "of the random states")->capture_default_str();
  configure(app);
  return run_program(app, argc, argv, [&] {
    std::vector<Scene> opened;
    for (const std::string& what : scenes) opened.push_back(open_scene(what, read));
    add(opened, seed);
    add_context(timed_call);
    benchmark::RunSpecifiedBenchmarks();
    benchmark::Shutdown();
    return 0;
  });
}

}  // namespace kalmarm

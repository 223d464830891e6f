#include "benchmarks/driver.hpp"

#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "benchmarks/run.hpp"

namespace kalmarm {

int Driver::run(int argc, char** argv, const Add& add,
                const std::function<void(CLI::App&)>& configure) {
  Benchmarks benchmarks(argc, argv,
                        "Usage: " + name + " SCENE... [--seed S] " + flags +
                            "[flags of Google Benchmark]\n\n  SCENE: " + scene_help + "\n\n");
  CLI::App app(about, name);
  std::uint64_t seed = 1;
  LoadOptions read;
  CLI::Option* const option = add_scene(app, scenes, read);
  if (scenes.empty())
    option->required();
  else
    option->capture_default_str();
  app.add_option("--seed", seed, "of the random states")->check(any_seed())->capture_default_str();
  configure(app);
  return run_program(app, argc, argv, [&] {
    std::vector<Scene> opened;
    for (const std::string& what : scenes) opened.push_back(open_scene(what, read));
    add(opened, seed);
    benchmarks.run(timed_call);
    return 0;
  });
}

}  // namespace kalmarm

// contacts: errors of H^-1 b, H = M + J'DJ, of a robot that stands on points
// (contacts/contact_errors.hpp) -> one CSV.
#include "accuracy/contacts/contact_errors.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"

namespace kalmarm {
namespace {

struct Options {
  std::string scene;
  LoadOptions read;
  std::vector<std::string> feet, precisions = {"float32", "float64"};
  std::vector<double> stiffness = {1e2, 1e4, 1e6, 1e8, 1e10, 1e12};
  int points = 1, states = 10;
  std::uint64_t seed = 1;
  std::string out;
};

int run(const Options& options) {
  const Scene scene = open_scene(options.scene, options.read);
  const Standing standing{standing_links(scene, options.feet), options.points};
  OutputFile file(options.out);
  std::string text = contact_errors::csv_header;
  const std::vector<State> states = random_states(scene, options.states, options.seed);
  Progress progress(options.states);
  for (int i = 0; i < options.states; ++i) {
    progress.step("state " + std::to_string(i));
    for (const std::string& precision : options.precisions)
      text += contact_errors::rows(scene, states[i], i, standing, options.stiffness,
                                   options.seed + i, precision);
  }
  file.write(text);
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Errors of (M + J'DJ)^-1 b of a robot that stands on points, against truth, as CSV",
               "contacts");
  Options options;
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--feet", options.feet,
                 "joints, or patterns of them, whose links stand; all tips where none is named")
      ->delimiter(',');
  app.add_option("--points", options.points, "points of each, three rows of J a point")
      ->check(between(1, 100))
      ->capture_default_str();
  app.add_option("--stiffness", options.stiffness, "d along a contact's normal [kg]")
      ->delimiter(',')
      ->check(positive());
  app.add_option("--random", options.states, "N random states")
      ->check(number_of_states())
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of states, points and b")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--precision", options.precisions, "float32, float64 or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--out", options.out, "CSV file to write")->required();
  return run_program(app, argc, argv, [&] { return run(options); });
}

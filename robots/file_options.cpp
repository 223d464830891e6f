#include "robots/file_options.hpp"

#include <CLI/CLI.hpp>

namespace kalmarm {

void add_file_options(CLI::App& app, LoadOptions& read) {
  constexpr const char* group = "How the scene's file is read";
  app.add_option_function<std::string>(
         "--floating", [&](const std::string& link) { read.floating = link; },
         "the root link gets a free joint; its name where there are several")
      ->type_name("[LINK]")
      ->expected(0, 1)
      ->group(group);
}

}  // namespace kalmarm

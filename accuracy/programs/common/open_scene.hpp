// The scenes that a program is asked about.
#pragma once

#include <string>

#include "accuracy/programs/common/command_line.hpp"
#include "robots/scene/file_options.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

// Adds the argument SCENE, one name or a vector of several, and how their files are read.
template <class Names>
CLI::Option* add_scene(CLI::App& app, Names& names, LoadOptions& read) {
  add_file_options(app, read);
  return app.add_option("SCENE", names, scene_help);
}

// load_scene(what, read), with the notes of its file, which no output may replace, nor what it
// includes.
Scene open_scene(const std::string& what, const LoadOptions& read);

}  // namespace kalmarm

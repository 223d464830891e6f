// The scene that a program is asked about.
#pragma once

#include <string>

#include "accuracy/programs/command_line.hpp"
#include "robots/scene.hpp"

namespace kalmarm {

// Adds the argument SCENE: one name, or a vector of names for several.
template <class Names>
CLI::Option* add_scene(CLI::App& app, Names& names) {
  return app.add_option("SCENE", names, scene_help);
}

// load_scene(what), with the notes of its file.
inline Scene open_scene(const std::string& what) {
  Scene scene = load_scene(what);
  if (scene.mujoco)
    for (const std::string& note : scene.mujoco->notes()) add_note(what + ": " + note);
  return scene;
}

}  // namespace kalmarm

#include "robots/file_options.hpp"

#include <CLI/CLI.hpp>
#include <map>

#include "robots/files/packages.hpp"

namespace kalmarm {

void add_file_options(CLI::App& app, LoadOptions& read) {
  constexpr const char* group = "How the scene's file is read";
  app.add_option_function<std::string>(
         "--floating", [&](const std::string& link) { read.floating = link; },
         "the root link gets a free joint; its name where there are several")
      ->type_name("[LINK]")
      ->expected(0, 1)
      ->group(group);
  app.add_option("--urdf-inertia", read.urdf_inertia,
                 "mass of links without <inertial>: none, or that of their geometry at 1000 kg/m^3 "
                 "(default, none where a mesh file is missing)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, UrdfInertia>{
          {"none", UrdfInertia::none}, {"geometry", UrdfInertia::geometry}}))
      ->type_name("none|geometry")
      ->group(group);
  app.add_option_function<std::string>(
         "--package-path", [&](const std::string& path) { read.package_path = folders_of(path); },
         "folders that hold the ROS packages of meshes, before ROS_PACKAGE_PATH and "
         "AMENT_PREFIX_PATH")
      ->type_name("DIR[:DIR]")
      ->group(group);
}

}  // namespace kalmarm

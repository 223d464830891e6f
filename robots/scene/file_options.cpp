#include "robots/scene/file_options.hpp"

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>

#include "robots/loader/files/packages.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/json_file.hpp"

namespace kalmarm {

std::map<std::string, double> read_numbers(const std::string& path) {
  const nlohmann::json document = read_json(path);
  if (!document.is_object()) throw InputError(path + ": is no JSON object of names and numbers");
  std::map<std::string, double> out;
  for (const auto& [joint, value] : document.items())
    out[joint] = finite_number(value, path + ": '" + joint + "'");
  return out;
}

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
  app.add_option(
         "--inertia", read.inertia,
         "moments of inertia that no solid body has: taken as given and refused where one is "
         "negative, or balanced, those of the nearest solid body")
      ->transform(CLI::CheckedTransformer(std::map<std::string, InertiaPolicy>{
          {"given", InertiaPolicy::given}, {"balanced", InertiaPolicy::balanced}}))
      ->type_name("given|balanced")
      ->default_str("given")
      ->group(group);
  app.add_option(
         "--key", read.key,
         "keyframe that the robot stands in where no other state is asked for; locked joints "
         "stand as in it")
      ->type_name("NAME")
      ->group(group);
  app.add_option_function<std::string>(
         "--armature", [&](const std::string& path) { read.armature = read_numbers(path); },
         "JSON file of joints and the inertia that rotor and gear add to each, {\"JOINT\": KG_M2}")
      ->type_name("FILE")
      ->group(group);
  app.add_option_function<std::string>(
         "--controls", [&](const std::string& path) { read.controls = read_numbers(path); },
         "JSON file of actuators and their controls in implicit steps, {\"ACTUATOR\": NUMBER}; "
         "others "
         "have the keyframe's, or zero")
      ->type_name("FILE")
      ->group(group);
  app.add_option_function<std::string>(
         "--package-path", [&](const std::string& path) { read.package_path = folders_of(path); },
         "folders that hold the ROS packages of meshes, before ROS_PACKAGE_PATH and "
         "AMENT_PREFIX_PATH")
      ->type_name("DIR[:DIR]")
      ->group(group);
}

std::string initializer_of(const LoadOptions& read) {
  const auto quoted = [](const std::string& text) { return nlohmann::json(text).dump(); };
  std::string out;
  const auto add = [&](const char* member, const std::string& value) {
    out += std::string(out.empty() ? "{." : ", .") + member + " = " + value;
  };
  if (read.floating) add("floating", quoted(*read.floating));
  if (read.urdf_inertia != UrdfInertia::where_found)
    add("urdf_inertia", read.urdf_inertia == UrdfInertia::none ? "kalmarm::UrdfInertia::none"
                                                               : "kalmarm::UrdfInertia::geometry");
  if (read.inertia == InertiaPolicy::balanced) add("inertia", "kalmarm::InertiaPolicy::balanced");
  std::string folders;
  for (const std::string& folder : read.package_path)
    folders += (folders.empty() ? "" : ", ") + quoted(folder);
  if (!folders.empty()) add("package_path", "{" + folders + "}");
  if (!read.key.empty()) add("key", quoted(read.key));
  const auto add_numbers = [&](const char* member, const std::map<std::string, double>& numbers) {
    std::string all;
    for (const auto& [name, number] : numbers)
      all +=
          (all.empty() ? "{" : ", {") + quoted(name) + ", " + nlohmann::json(number).dump() + "}";
    if (!all.empty()) add(member, "{" + all + "}");
  };
  add_numbers("controls", read.controls);
  add_numbers("armature", read.armature);
  return out.empty() ? out : out + "}";
}

}  // namespace kalmarm

#include "robots/loader/files/packages.hpp"

#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> folders_of_variable(const char* name) {
  const char* value = std::getenv(name);
  return folders_of(value ? value : "");
}

// Where a package may be: folders that hold it, and folders that may be it.
struct Places {
  std::vector<fs::path> parents, packages;

  // Empty where it is nowhere.
  fs::path find(const std::string& package, const std::string& path) const {
    for (const fs::path& folder : packages)
      if (folder.filename() == package && is_file(folder / path)) return folder / path;
    for (const fs::path& folder : parents)
      if (is_file(folder / package / path)) return folder / package / path;
    return {};
  }
};

Places places_for(const std::string& robot_file, const std::vector<std::string>& package_path) {
  Places out;
  const auto add = [&](const std::vector<std::string>& folders) {
    for (const std::string& folder : folders) {
      const fs::path place = fs::absolute(folder).lexically_normal();
      out.parents.push_back(place);
      out.packages.push_back(place.has_filename() ? place : place.parent_path());
    }
  };
  add(package_path);
  add(folders_of_variable("ROS_PACKAGE_PATH"));
  for (const std::string& prefix : folders_of_variable("AMENT_PREFIX_PATH"))
    out.parents.push_back(fs::absolute(prefix) / "share");
  fs::path above = fs::absolute(robot_file).parent_path();
  for (; above.has_relative_path(); above = above.parent_path())
    out.parents.push_back(above.parent_path());
  return out;
}

}  // namespace

std::vector<std::string> folders_of(const std::string& path) {
  std::vector<std::string> out;
  std::istringstream words(path);
  for (std::string folder; std::getline(words, folder, ':');)
    if (!folder.empty()) out.push_back(folder);
  return out;
}

void find_packages(mjSpec* spec, const std::string& robot_file,
                   const std::vector<std::string>& package_path) {
  for (const std::string& folder : package_path)
    if (!is_folder(folder)) throw InputError("package path '" + folder + "': no such folder");
  const Places places = places_for(robot_file, package_path);
  const std::string by_package = "package://", by_file = "file://";
  for (mjsElement* e : elements(spec, mjOBJ_MESH)) {
    mjString* file = mjs_asMesh(e)->file;
    std::string name = mjs_getString(file);
    if (name.starts_with(by_file)) mjs_setString(file, name.substr(by_file.size()).c_str());
    if (!name.starts_with(by_package)) continue;
    name.erase(0, by_package.size());
    const std::size_t slash = name.find('/');
    if (slash == std::string::npos) continue;
    const fs::path found = places.find(name.substr(0, slash), name.substr(slash + 1));
    if (!found.empty()) mjs_setString(file, found.string().c_str());
  }
}

}  // namespace kalmarm

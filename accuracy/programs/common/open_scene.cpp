#include "accuracy/programs/common/open_scene.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

#include "accuracy/programs/common/output_file.hpp"
#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// The file and those that it names, such as includes and meshes, as far as they exist.
void add_robot_files(const std::string& robot) {
  std::vector<fs::path> left{robot};
  std::set<fs::path> folders{fs::path(robot).parent_path()}, seen;
  while (!left.empty()) {
    const fs::path path = left.back().lexically_normal();
    left.pop_back();
    std::error_code error;
    if (!fs::is_regular_file(path, error) || !seen.insert(path).second) continue;
    add_input(path.string());
    if (path.extension() != ".xml" && path.extension() != ".urdf") continue;
    std::ifstream file(path, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    const std::vector<XmlTag> tags = xml_tags(text);
    for (const XmlTag& tag : tags)
      for (const char* key : {"meshdir", "assetdir"})
        if (const std::string folder = tag.attribute(key); !folder.empty())
          folders.insert(fs::path(robot).parent_path() / folder);
    for (const XmlTag& tag : tags)
      for (const char* key : {"file", "filename"})
        if (const std::string name = tag.attribute(key); !name.empty())
          for (const fs::path& folder : folders) left.push_back(folder / name);
  }
}

}  // namespace

Scene open_scene(const std::string& what, const LoadOptions& read) {
  Scene scene = load_scene(what, read);
  if (scene.mujoco)
    for (const std::string& note : scene.mujoco->notes()) add_note(what + ": " + note);
  if (!scene.file.empty()) add_robot_files(scene.file);
  return scene;
}

}  // namespace kalmarm

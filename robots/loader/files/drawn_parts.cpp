#include "robots/loader/files/drawn_parts.hpp"

#include <optional>
#include <set>
#include <vector>

#include "robots/loader/files/file_kind.hpp"
#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {
namespace {

const std::set<std::string> drawn_in_urdf = {"visual", "material", "gazebo", "transmission"};
const std::set<std::string> drawn_in_mjcf = {"visual", "material", "texture", "light", "camera"};

bool has_only_a_root(const std::string& text) { return xml_tags(text).size() < 2; }

}  // namespace

std::string without_drawn_parts(std::string text) {
  const auto& drawn = is_urdf(xml_tags(text)) ? drawn_in_urdf : drawn_in_mjcf;
  return without_elements(std::move(text),
                          [&](const XmlTag& tag) { return drawn.contains(tag.name); });
}

std::vector<ModelFile> without_drawn_parts(std::vector<ModelFile> files) {
  std::set<std::string> empty;
  const auto includes_nothing = [&](const ModelFile& file, const XmlTag& tag) {
    const std::optional<std::string> path = file.included(tag);
    return path && empty.contains(*path);
  };
  for (auto file = files.rbegin(); file != files.rend(); ++file) {  // from what is included
    file->text = without_elements(without_drawn_parts(std::move(file->text)),
                                  [&](const XmlTag& tag) { return includes_nothing(*file, tag); });
    if (has_only_a_root(file->text)) empty.insert(file->path);
  }
  return files;
}

}  // namespace kalmarm

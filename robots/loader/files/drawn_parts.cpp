#include "robots/loader/files/drawn_parts.hpp"

#include <optional>
#include <set>
#include <vector>

#include "robots/loader/files/file_kind.hpp"
#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {
namespace {

const std::set<std::string> drawn_in_urdf = {"visual", "material", "gazebo", "transmission",
                                             "sensor"};
const std::set<std::string> drawn_in_mjcf = {"visual", "material", "texture", "light", "camera"};

// Where a URDF's collisions begin that weigh nothing, since their link has an inertia of its own.
std::set<std::size_t> weightless_collisions(const std::vector<XmlTag>& tags) {
  std::set<std::size_t> out, of_link;
  bool has_inertia = false;
  for (const XmlTag& tag : tags) {
    const bool closes = tag.kind == XmlTag::Kind::closing;
    if (tag.attribute("inertiafromgeom") == "true") return {};
    if (tag.name == "link") {
      if (closes && has_inertia) out.merge(of_link);
      of_link.clear();
      has_inertia = false;
    }
    if (tag.name == "inertial") has_inertia = true;
    if (tag.name == "collision" && !closes) of_link.insert(tag.begin);
  }
  return out;
}

bool has_only_a_root(const std::string& text) { return xml_tags(text).size() < 2; }

}  // namespace

std::string without_drawn_parts(std::string text) {
  const bool in_urdf = is_urdf(xml_tags(text));
  const auto& drawn = in_urdf ? drawn_in_urdf : drawn_in_mjcf;
  text = without_elements(std::move(text),
                          [&](const XmlTag& tag) { return drawn.contains(tag.name); });
  if (!in_urdf) return text;
  const std::set<std::size_t> weightless = weightless_collisions(all_xml_tags(text));
  return without_elements(std::move(text),
                          [&](const XmlTag& tag) { return weightless.contains(tag.begin); });
}

std::vector<ModelFile> without_drawn_parts(std::vector<ModelFile> files) {
  std::set<std::string> empty;
  const auto includes_nothing = [&](const ModelFile& file, const XmlTag& tag) {
    const std::optional<std::string> path = file.included(tag);
    return path && empty.contains(*path);
  };
  for (auto file = files.rbegin(); file != files.rend(); ++file) {  // from what is included
    const bool was_empty = has_only_a_root(file->text);  // that is the reader's to refuse
    file->text = without_elements(without_drawn_parts(std::move(file->text)),
                                  [&](const XmlTag& tag) { return includes_nothing(*file, tag); });
    if (!was_empty && has_only_a_root(file->text)) empty.insert(file->path);
  }
  return files;
}

}  // namespace kalmarm

#include "robots/loader/files/file_kind.hpp"

#include <algorithm>

#include "robots/loader/files/drawn_parts.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

bool is_usd(const std::string& path, const std::string& text) {
  const bool archive = text.starts_with("PK\x03\x04") && path.ends_with(".usdz");
  return text.starts_with("#usda") || text.starts_with("PXR-USDC") || archive;
}

}  // namespace

void refuse_other_kinds(const std::string& path, const std::string& text,
                        const std::vector<XmlTag>& tags) {
  const auto refuse = [&](const std::string& what) { throw InputError(path + ": " + what); };
  if (is_usd(path, text))
    refuse("USD is not read, convert it to URDF: usd_to_urdf -o robot.urdf " + path);
  if (tags.empty()) return;
  // MuJoCo's reader would load a part of the robot without a word. What is left over in what only draws
  // builds nothing.
  const auto is_macro = [](const XmlTag& tag) { return tag.name.starts_with("xacro:"); };
  const auto any_macro = [&](const std::vector<XmlTag>& in) {
    return std::any_of(in.begin(), in.end(), is_macro);
  };
  if (any_macro(tags) && any_macro(xml_tags(without_drawn_parts(text))))
    refuse("has macros, expand them first: xacro " + path + " > robot.urdf");
  if (tags[0].name == "sdf")
    refuse("SDF is not read, convert it to MJCF: sdf2mjcf " + path + " robot.xml");
  if (tags[0].name == "mujocoinclude")
    refuse("a fragment that another file includes: give the file with <include file=\"...\"/>");
  // Of a model to attach that has no file MuJoCo's reader makes an exception that nothing can catch.
  for (const XmlTag& tag : tags)
    if (tag.name == "model" && tag.attribute("file").empty())
      refuse("<model name=\"" + tag.attribute("name") + "\"> has no file");
}

bool is_urdf(const std::vector<XmlTag>& tags) { return !tags.empty() && tags[0].name == "robot"; }

}  // namespace kalmarm

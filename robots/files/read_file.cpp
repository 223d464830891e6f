#include "robots/files/read_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "robots/files/armature.hpp"
#include "robots/files/file_kind.hpp"
#include "robots/files/floating.hpp"
#include "robots/files/given_inertia.hpp"
#include "robots/files/ignored.hpp"
#include "robots/files/packages.hpp"
#include "robots/files/urdf.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

std::vector<XmlTag> checked_tags(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) throw InputError(path + ": no such file");
  std::ifstream file(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::vector<XmlTag> tags = xml_tags(text);
  refuse_other_kinds(path, text, tags);
  return tags;
}

SpecPtr parse(const std::string& path) {
  char error[1024] = "";
  SpecPtr spec(mj_parseXML(path.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  if (!spec) throw InputError(path + ": " + error);
  return spec;
}

}  // namespace

ReadFile read_file(const std::string& path, const LoadOptions& options) {
  const std::vector<XmlTag> tags = checked_tags(path);
  ReadFile out{parse(path), {}, {}, {}};
  mjSpec* spec = out.spec.get();
  const auto note = [&](const std::string& text) {
    if (!text.empty()) out.notes.push_back(one_line(text));
  };
  try {
    if (is_urdf(tags)) refuse_several_roots(tags);
    if (options.floating) free_root(spec, *options.floating);
    note(note_of_welded_base(spec));
    find_packages(spec, path, options.package_path);
    if (is_urdf(tags)) {
      out.weights = weigh_links(spec, path, options.urdf_inertia);
      note(out.weights);
      note(ignored_transmissions(tags));
    }
    if (options.inertia == InertiaPolicy::balanced) note(balance_inertias(spec));
    set_armature(spec, options.armature);
    if (!options.key.empty()) out.key = keyframe_called(spec, options.key);
    const std::string parts = ignored_parts(spec, options.imposes_couplings);
    note(parts.empty() ? "" : "ignored: " + parts);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
  return out;
}

}  // namespace kalmarm

#include "robots/loader/files/read_file.hpp"

#include <filesystem>

#include "robots/loader/files/armature.hpp"
#include "robots/loader/files/drawn_parts.hpp"
#include "robots/loader/files/file_kind.hpp"
#include "robots/loader/files/floating.hpp"
#include "robots/loader/files/given_inertia.hpp"
#include "robots/loader/files/ignored.hpp"
#include "robots/loader/files/model_files.hpp"
#include "robots/loader/files/packages.hpp"
#include "robots/loader/files/sizes.hpp"
#include "robots/loader/files/text_file.hpp"
#include "robots/loader/files/urdf.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

std::vector<XmlTag> checked_tags(const std::string& path) {
  const std::string text = read_text(path);
  std::vector<XmlTag> tags = xml_tags(text);
  refuse_other_kinds(path, text, tags);
  return tags;
}

// Files that stand in for those on the disk.
class StandIns {
 public:
  StandIns() { mj_defaultVFS(&vfs_); }
  StandIns(const StandIns&) = delete;
  StandIns& operator=(const StandIns&) = delete;
  ~StandIns() { mj_deleteVFS(&vfs_); }

  void add(const std::string& path, const std::string& text) {
    mj_addBufferVFS(&vfs_, path.c_str(), text.data(), static_cast<int>(text.size()));
  }
  const mjVFS* get() const { return &vfs_; }

 private:
  mjVFS vfs_;
};

// Null, and the reason, where MuJoCo's reader refuses it.
SpecPtr parse(const std::string& path, const StandIns& files, std::string& reason) {
  char error[1024] = "";
  SpecPtr spec(mj_parseXML(path.c_str(), files.get(), error, sizeof error), mj_deleteSpec);
  if (!spec) reason = error;
  return spec;
}

// MuJoCo's reader refuses a file also for what it does not need here, such as a link that is
// painted twice: then that is left out, and `note` says so.
SpecPtr parse(const std::string& path, std::string& note) {
  const std::vector<ModelFile> files =
      model_files(path);  // these refuse what the reader cannot bear
  refuse_huge_sizes(files);
  std::string reason;
  if (SpecPtr spec = parse(path, {}, reason)) return spec;
  note = "read without what only draws or collides, which MuJoCo refuses: " + reason;
  StandIns plain;
  for (const ModelFile& file : without_drawn_parts(files)) plain.add(file.path, file.text);
  SpecPtr spec = parse(path, plain, reason);
  if (!spec) throw InputError(path + ": " + reason);
  return spec;
}

// MuJoCo's compiler reads meshes, and would wait for one that is a pipe.
void refuse_meshes_that_are_no_files(mjSpec* spec, const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).parent_path() / mjs_getString(spec->compiler.meshdir);
  for (mjsElement* e : elements(spec, mjOBJ_MESH)) {
    const fs::path file = folder / mjs_getString(mjs_asMesh(e)->file);
    if (is_there(file) && !is_file(file) && !is_folder(file))
      throw InputError("mesh '" + name_of(e) + "': " + file.string() + " is not a file");
  }
}

// What says of a robot's parts would be no text where their names are none.
void refuse_names_that_are_no_text(mjSpec* spec) {
  for (const mjtObj type :
       {mjOBJ_BODY, mjOBJ_JOINT, mjOBJ_SITE, mjOBJ_ACTUATOR, mjOBJ_TENDON, mjOBJ_KEY})
    for (mjsElement* e : elements(spec, type))
      if (const std::string name = name_of(e); !is_utf8(name))
        throw InputError(mju_type2Str(type) + std::string(" '") + name +
                         "': the name is not UTF-8");
}

// What MuJoCo's reader refuses without the names, or takes in part.
void refuse_bad_tree(const std::string& path, const std::vector<XmlTag>& tags) {
  try {
    refuse_bad_names(tags);
    refuse_several_roots(tags);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
}

}  // namespace

ReadFile read_file(const std::string& path, const LoadOptions& options) {
  const std::vector<XmlTag> tags = checked_tags(path);
  if (is_urdf(tags)) refuse_bad_tree(path, tags);
  std::string left_out;
  ReadFile out{parse(path, left_out), {}, {}, {}};
  mjSpec* spec = out.spec.get();
  const auto note = [&](const std::string& text) {
    if (!text.empty()) out.notes.push_back(one_line(text));
  };
  note(left_out);
  try {
    refuse_names_that_are_no_text(spec);
    if (options.floating) free_root(spec, *options.floating);
    note(note_of_welded_base(spec));
    find_packages(spec, path, options.package_path);
    refuse_meshes_that_are_no_files(spec, path);
    if (is_urdf(tags)) {
      note(weigh_links(spec, path, options.urdf_inertia));
      note(ignored_transmissions(tags));
      note(lost_mimics(tags));
    }
    if (options.inertia == InertiaPolicy::balanced) note(balance_inertias(spec));
    set_armature(spec, options.armature);
    if (!options.key.empty()) out.key = keyframe_called(spec, options.key);
    out.controls = controls_of(spec, options);
    note(note_of_loose_couplings(spec));
    const std::string parts = ignored_parts(parts_of(spec), options);
    note(parts.empty() ? "" : "ignored: " + parts);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
  return out;
}

}  // namespace kalmarm

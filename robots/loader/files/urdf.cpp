#include "robots/loader/files/urdf.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <limits>
#include <set>
#include <utility>

#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

void add_quoted(std::string& list, const std::string& name) {
  list += (list.empty() ? "'" : ", '") + name + "'";
}

std::vector<mjsGeom*> geoms_of(mjsBody* body) {
  std::vector<mjsGeom*> out;
  for (mjsElement* e = mjs_firstChild(body, mjOBJ_GEOM, 0); e; e = mjs_nextChild(body, e, 0))
    out.push_back(mjs_asGeom(e));
  return out;
}

// The first mesh of a link that MuJoCo could not read; "" where all are there.
std::string missing_mesh(mjSpec* spec, mjsBody* body, const fs::path& folder) {
  for (mjsGeom* geom : geoms_of(body)) {
    mjsElement* e = mjs_findElement(spec, mjOBJ_MESH, mjs_getString(geom->meshname));
    if (geom->type != mjGEOM_MESH || !e) continue;
    const fs::path file = mjs_getString(mjs_asMesh(e)->file);
    std::string ending = file.extension().string();
    for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    const bool is_read = ending == ".stl" || ending == ".obj" || ending == ".msh";
    if (!is_read || !is_file(folder / file)) return file.string();
  }
  return "";
}

void make_massless(mjsBody* body) {
  body->explicitinertial = 1;
  body->mass = 0;
  std::fill(body->ipos, body->ipos + 3, 0.0);
  std::fill(body->inertia, body->inertia + 3, 0.0);
  body->fullinertia[0] = std::numeric_limits<double>::quiet_NaN();  // not given
}

// Such as a box of size 0 0 0, which stands for no collision.
bool has_no_volume(const mjsGeom* geom) {
  const double* size = geom->size;
  switch (geom->type) {
    case mjGEOM_BOX:
      return size[0] * size[1] * size[2] == 0;
    case mjGEOM_CYLINDER:
      return size[0] * size[1] == 0;
    case mjGEOM_SPHERE:
      return size[0] == 0;
    default:
      return false;
  }
}

}  // namespace

void refuse_several_roots(const std::vector<XmlTag>& tags) {
  std::set<std::string> children;
  for (const XmlTag& tag : tags)
    if (tag.name == "child") children.insert(tag.attribute("link"));
  std::string roots;
  int count = 0;
  for (const XmlTag& tag : tags)
    if (tag.name == "link" && tag.attributes.contains("name") &&
        !children.contains(tag.attribute("name"))) {
      add_quoted(roots, tag.attribute("name"));
      ++count;
    }
  if (count > 1) throw InputError("several links have no parent, a URDF is one tree: " + roots);
}

void refuse_bad_names(const std::vector<XmlTag>& tags) {
  std::set<std::pair<std::string, std::string>> seen;
  for (const XmlTag& tag : tags) {
    // Transmissions, and controllers, name joints too, without a type.
    const bool is_joint = tag.name == "joint" && tag.attributes.contains("type");
    if (!is_joint && !(tag.name == "link" && tag.attributes.contains("name"))) continue;
    if (!seen.emplace(tag.name, tag.attribute("name")).second)
      throw InputError("two " + tag.name + "s are called '" + tag.attribute("name") + "'");
  }
  std::string joint;
  for (const XmlTag& tag : tags) {
    if (tag.name == "joint") joint = tag.attribute("name");
    if ((tag.name != "parent" && tag.name != "child") || !tag.attributes.contains("link")) continue;
    const std::string link = tag.attribute("link");
    if (link != "world" && !seen.contains({"link", link}))
      throw InputError("joint '" + joint + "': its " + tag.name + " link '" + link +
                       "' is not in the file");
  }
}

std::string lost_mimics(const std::vector<XmlTag>& tags) {
  std::set<std::string> joints;
  for (const XmlTag& tag : tags)
    if (tag.name == "joint" && tag.attribute("type") != "fixed")
      joints.insert(tag.attribute("name"));
  std::string out;
  for (const XmlTag& tag : tags)
    if (tag.name == "mimic" && !joints.contains(tag.attribute("joint")))
      add_quoted(out, tag.attribute("joint"));
  return out.empty() ? "" : "ignored: <mimic> of joints that are not there or fixed: " + out;
}

std::string ignored_transmissions(const std::vector<XmlTag>& tags) {
  Counts counts;
  for (const XmlTag& tag : tags) {
    const std::string name = tag.name.substr(tag.name.find(':') + 1);  // drake:rotor_inertia
    if (name == "transmission") counts.add("transmission");
    if (name == "rotor_inertia") counts.add("rotor inertia");
    if (name == "gear_ratio" || name == "mechanicalReduction") counts.add("gear ratio");
  }
  std::string out;
  for (const auto& [kind, count] : counts.all())
    out += (out.empty() ? "ignored: " : ", ") + counted(count, kind);
  return out.empty() ? "" : out + "; option armature gives joints what they add to M";
}

std::string weigh_links(mjSpec* spec, const std::string& path, UrdfInertia policy) {
  for (mjsElement* e : elements(spec, mjOBJ_GEOM))
    if (has_no_volume(mjs_asGeom(e))) mjs_delete(spec, e);
  if (spec->compiler.inertiafromgeom != mjINERTIAFROMGEOM_AUTO) return "";  // the file's own policy
  const fs::path folder = fs::path(path).parent_path() / mjs_getString(spec->compiler.meshdir);
  std::string geometry, none, missing;
  for (mjsElement* e : elements(spec, mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    if (body->explicitinertial || !moves(body) || geoms_of(body).empty()) continue;
    const std::string mesh = missing_mesh(spec, body, folder);
    if (policy == UrdfInertia::geometry && !mesh.empty())
      throw InputError(
          "link '" + name_of(e) + "' has no <inertial>, and its mesh " + mesh +
          " is not found or not STL, OBJ or MSH (options package_path, urdf_inertia=none)");
    if (policy != UrdfInertia::none && mesh.empty()) {
      add_quoted(geometry, name_of(e));
      continue;
    }
    make_massless(body);
    add_quoted(mesh.empty() ? none : missing, name_of(e));
  }
  std::string out;
  const auto add = [&](const char* what, const std::string& links) {
    if (!links.empty()) out += (out.empty() ? "" : "; ") + std::string(what) + ": " + links;
  };
  add("weighed by geometry at 1000 kg/m^3", geometry);
  add("massless", none);
  add("massless, as a mesh is not found or not STL, OBJ or MSH", missing);
  return out.empty() ? "" : "without <inertial>: " + out;
}

}  // namespace kalmarm

#include "robots/loader/files/floating.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

constexpr int several = 3;  // limbs that hang on one base: two arms may hang on a welded torso

bool is_world(const mjsBody* body) { return mjs_getParent(body->element) == nullptr; }

bool carries_joints(mjsBody* body) { return mjs_firstChild(body, mjOBJ_JOINT, 1) != nullptr; }

std::vector<mjsBody*> roots_of(mjSpec* spec) {
  std::vector<mjsBody*> out;
  for (mjsElement* e : elements(spec, mjOBJ_BODY))
    if (mjsBody* body = mjs_asBody(e); !is_world(body) && is_world(mjs_getParent(e)))
      out.push_back(body);
  return out;
}

std::string quoted(const std::vector<mjsBody*>& bodies) {
  std::string out;
  for (const mjsBody* body : bodies)
    out += (out.empty() ? "'" : ", '") + name_of(body->element) + "'";
  return out;
}

mjsBody* root_called(mjSpec* spec, const std::vector<mjsBody*>& roots, const std::string& link) {
  std::vector<std::string> names;
  for (mjsBody* root : roots) {
    names.push_back(name_of(root->element));
    if (names.back() == link) return root;
  }
  if (mjs_findBody(spec, link.c_str()) == nullptr)
    throw InputError(unknown_name("floating link", link, names));
  throw InputError("floating link '" + link + "' is no root, which is " + quoted(roots));
}

mjsBody* only_root(const std::vector<mjsBody*>& roots) {
  std::vector<mjsBody*> welded;
  std::copy_if(roots.begin(), roots.end(), std::back_inserter(welded),
               [](mjsBody* root) { return !has_joint(root); });
  if (std::any_of(welded.begin(), welded.end(), carries_joints))
    std::erase_if(welded, [](mjsBody* root) { return !carries_joints(root); });
  if (welded.empty()) throw InputError("floating: no link is welded to the world");
  if (welded.size() > 1)
    throw InputError("floating: several links are welded to the world, name one of " +
                     quoted(welded));
  return welded[0];
}

// The root that a limb hangs on, which begins at this body; null where it begins nearer to the root
// or has none.
mjsBody* base_of_limb(mjsBody* body) {
  if (is_world(body) || !has_joint(body)) return nullptr;
  mjsBody* at = mjs_getParent(body->element);
  if (is_world(at)) return nullptr;
  for (;; at = mjs_getParent(at->element)) {
    if (has_joint(at)) return nullptr;
    if (is_world(mjs_getParent(at->element))) return at;
  }
}

}  // namespace

void free_root(mjSpec* spec, const std::string& link) {
  const std::vector<mjsBody*> roots = roots_of(spec);
  mjsBody* root = link.empty() ? only_root(roots) : root_called(spec, roots, link);
  if (has_joint(root))
    throw InputError("floating link '" + name_of(root->element) + "' has a joint already");
  mjs_setName(mjs_addFreeJoint(root)->element, "floating_base");
}

std::string note_of_welded_base(mjSpec* spec) {
  for (mjsElement* e : elements(spec, mjOBJ_JOINT))
    if (mjs_asJoint(e)->type == mjJNT_FREE) return "";
  std::map<mjsBody*, int> limbs;
  for (mjsElement* e : elements(spec, mjOBJ_BODY))
    if (mjsBody* base = base_of_limb(mjs_asBody(e))) ++limbs[base];
  for (const auto& [base, count] : limbs)
    if (count >= several)
      return std::to_string(count) + " limbs hang on '" + name_of(base->element) +
             "', which is welded to the world: option floating frees it";
  return "";
}

}  // namespace kalmarm

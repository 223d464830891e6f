#include "robots/scene/state_file.hpp"

#include <cmath>

#include "robots/loader/input_error.hpp"
#include "robots/scene/json_file.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

VectorX<double> read_vector(const json& state, const char* key, int size,
                            const std::string& where) {
  const auto found = state.find(key);
  if (found == state.end() || !found->is_array())
    throw InputError(where + ": no array '" + key + "'");
  if (static_cast<int>(found->size()) != size)
    throw InputError(where + ": '" + key + "' has " + std::to_string(found->size()) +
                     " values, the robot has " + std::to_string(size));
  VectorX<double> out(size);
  for (int i = 0; i < size; ++i)
    out[i] = finite_number((*found)[i], where + ": " + key + "[" + std::to_string(i) + "]");
  return out;
}

// True if the quaternion was not of unit length and had to be normalised.
bool normalize(VectorX<double>& q, int index, const std::string& where) {
  auto quaternion = q.segment<4>(index);
  const double norm = quaternion.norm();
  if (!(norm > 1e-10 && std::isfinite(norm)))
    throw InputError(where + ": the quaternion at qpos[" + std::to_string(index) + "] has length " +
                     std::to_string(norm));
  if (std::abs(norm - 1) <= 1e-9) return false;  // digits of the file; no algorithm here minds
  quaternion /= norm;
  return true;
}

}  // namespace

StateFile read_states(const Scene& scene, const std::string& path) {
  const json document = read_json(path);
  if (!document.is_object() || !document.contains("states") || !document["states"].is_array())
    throw InputError(path + ": no array 'states'");

  StateFile out;
  const Model<double>& model = scene.model;
  for (const json& entry : document["states"]) {
    const std::string where = path + ": state " + std::to_string(out.states.size());
    if (!entry.is_object()) throw InputError(where + " is not an object");
    State state;
    state.q = read_vector(entry, "qpos", model.nq(), where);
    state.qd = read_vector(entry, "qvel", model.nv(), where);
    state.tau = read_vector(entry, "tau", model.nv(), where);
    for (int k = 0; k < model.nv(); ++k)
      if (model.joint(k).coordinate == Coordinate::quaternion)
        out.normalized += normalize(state.q, model.joint(k).q_index, where);
    out.states.push_back(std::move(state));
  }
  if (out.states.empty()) throw InputError(path + ": no states");
  return out;
}

}  // namespace kalmarm

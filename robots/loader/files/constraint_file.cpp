#include "robots/loader/files/constraint_file.hpp"

#include <algorithm>
#include <array>
#include <set>

#include "algorithms/model/plain.hpp"
#include "robots/loader/files/json.hpp"
#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_model.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

using Kind = Json::Kind;

const std::vector<std::string> kinds = {"point", "pose", "coupling"};
const std::vector<std::string> fields = {
    "name",      "kind",       "first",     "second",  "turning",        "joints",     "other",
    "reference", "polynomial", "stiffness", "damping", "velocity_terms", "compliance", "impedance"};
const std::vector<std::string> fields_of_place = {"frame", "translation", "rotation"};

class ConstraintReader {
 public:
  ConstraintReader(const RobotModel& model, const std::vector<NamedFrame>& frames)
      : model_(model), frames_(frames) {}

  Constraint read(const Json& given) const {
    Constraint out;
    out.name = text("name", *given.find("name"));
    for (const auto& [field, value] : given.members) set(field, value, out);
    if (out.kind == Constraint::Kind::coupling && out.jacobian.empty())
      throw InputError("a coupling needs joints");
    return out;
  }

 private:
  void set(const std::string& field, const Json& value, Constraint& out) const {
    if (field == "kind")
      out.kind = kind(text(field, value));
    else if (field == "first")
      out.first = place(field, value);
    else if (field == "second")
      out.second = place(field, value);
    else if (field == "turning")
      out.turning = number(field, value);
    else if (field == "joints")
      out.jacobian = lengths(field, value);
    else if (field == "other")
      out.other = lengths(field, value);
    else if (field == "reference")
      out.reference = number(field, value);
    else if (field == "polynomial")
      out.polynomial = numbers<5>(field, value, 1);
    else if (field == "stiffness")
      out.stiffness = number(field, value);
    else if (field == "damping")
      out.damping = number(field, value);
    else if (field == "velocity_terms")
      out.velocity_terms = yes_or_no(field, value);
    else if (field == "compliance")
      out.compliance = numbers<2>(field, value);
    else if (field == "impedance") {
      const auto [least, most, width, midpoint, power] = numbers<5>(field, value);
      out.impedance = Impedance{least, most, width, midpoint, power};
    } else if (field != "name")
      throw InputError(unknown_name("field", field, fields));
  }

  static std::string text(const std::string& field, const Json& value) {
    if (value.kind != Kind::text) throw InputError(field + " is no text");
    return value.text;
  }
  static double number(const std::string& field, const Json& value) {
    if (value.kind != Kind::number) throw InputError(field + " is no number");
    return value.number;
  }
  static bool yes_or_no(const std::string& field, const Json& value) {
    if (value.kind != Kind::boolean) throw InputError(field + " is neither true nor false");
    return value.number != 0;
  }
  // n of them, or at least `least`: the others are zero.
  template <std::size_t n>
  static std::array<double, n> numbers(const std::string& field, const Json& value,
                                       std::size_t least = n) {
    if (value.kind != Kind::list) throw InputError(field + " is no list");
    const std::size_t count = value.list.size();
    if (count < least || count > n)
      throw InputError(field + " has " + std::to_string(count) + " numbers, " +
                       (least < n ? std::to_string(least) + " to " : "") + std::to_string(n) +
                       " are needed");
    std::array<double, n> out{};
    for (std::size_t i = 0; i < count; ++i) out[i] = number(field, value.list[i]);
    return out;
  }

  static Constraint::Kind kind(const std::string& name) {
    const auto found = std::find(kinds.begin(), kinds.end(), name);
    if (found == kinds.end()) throw InputError(unknown_name("kind", name, kinds));
    return static_cast<Constraint::Kind>(found - kinds.begin());
  }

  Frame place(const std::string& field, const Json& value) const {
    if (value.kind == Kind::text) return frame(value.text);
    if (value.kind != Kind::object || !value.find("frame"))
      throw InputError(field + " is neither a frame's name nor an object with its \"frame\"");
    Vector3<double> translation = Vector3<double>::Zero();
    Eigen::Quaternion<double> rotation = Eigen::Quaternion<double>::Identity();
    for (const auto& [of_place, given] : value.members) {
      if (of_place == "translation")
        translation = Vector3<double>(numbers<3>(of_place, given).data());
      else if (of_place == "rotation")
        rotation = quaternion_of(numbers<4>(of_place, given));
      else if (of_place != "frame")
        throw InputError(unknown_name("field", of_place, fields_of_place));
    }
    if (!is_turn(rotation)) throw InputError("rotation has no length");
    const Frame at = frame(text("frame", *value.find("frame")));
    const LinkFrame out = LinkFrame{at.link, quaternion_of(at.rotation).normalized(),
                                    Vector3<double>(at.translation.data())}
                              .then(translation, rotation.normalized());
    return {out.link, plain(out.R), plain(out.p)};
  }
  Frame frame(const std::string& name) const {
    std::vector<std::string> names;
    for (const NamedFrame& one : frames_) {
      if (one.name == name) return one.frame;
      names.push_back(one.name);
    }
    throw InputError(unknown_name("frame", name, names));
  }

  std::vector<double> lengths(const std::string& field, const Json& value) const {
    const auto nv = static_cast<std::size_t>(model_.nv());
    std::vector<double> out(nv, 0);
    if (value.kind == Kind::list) {
      if (value.list.size() != nv)
        throw InputError(field + " has " + std::to_string(value.list.size()) + " numbers, " +
                         std::to_string(nv) + " are needed");
      std::transform(value.list.begin(), value.list.end(), out.begin(),
                     [&](const Json& one) { return number(field, one); });
      return out;
    }
    if (value.kind != Kind::object)
      throw InputError(field + " is neither an object of joints nor a list of numbers");
    for (const auto& [joint, coefficient] : value.members) {
      bool found = false;
      for (std::size_t k = 0; k < nv; ++k) {
        if (!matches(joint, model_.names[k]) && !model_.names[k].starts_with(joint + ":")) continue;
        out[k] = number(field, coefficient);
        found = true;
      }
      if (!found) throw InputError(unknown_name("joint", joint, model_.names));
    }
    return out;
  }

  const RobotModel& model_;
  const std::vector<NamedFrame>& frames_;
};

std::vector<Constraint> constraints_of(const std::string& text, const RobotModel& model,
                                       const std::vector<NamedFrame>& frames) {
  const Json file = json_of(text);
  const Json* const given = file.find("constraints");
  if (!given || given->kind != Kind::list) throw InputError("has no list \"constraints\"");
  const ConstraintReader reader(model, frames);
  std::vector<Constraint> out;
  std::set<std::string> names;
  for (const Json& one : given->list) {
    const Json* const name = one.find("name");
    const bool is_named = name && name->kind == Kind::text;
    const std::string what =
        "constraint " + (is_named ? "'" + name->text + "'" : std::to_string(out.size()));
    if (!name) throw InputError(what + " has no name");
    try {
      out.push_back(reader.read(one));
    } catch (const InputError& e) {
      throw InputError(what + ": " + e.what());
    }
    if (!names.insert(out.back().name).second) throw InputError(what + " is there twice");
  }
  return out;
}

}  // namespace

std::vector<Constraint> read_constraints(const std::string& path, const RobotModel& model,
                                         const std::vector<NamedFrame>& frames) {
  const std::string text = read_text(path);
  try {
    return constraints_of(text, model, frames);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
}

}  // namespace kalmarm

// The module kalmarm._files: robots from files and from MuJoCo's models, by the loader of robots/.
//
// Apart from _core, since it needs libmujoco.so of the release that it was compiled against: whoever
// imports it has imported the package `mujoco`, which has loaded that.
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <kalmarm/load.hpp>
#include <new>
#include <optional>

#include "lock.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/robot_of.hpp"

namespace kalmarm::python {
namespace {

namespace nb = nanobind;
using namespace nb::literals;

// As os.fsdecode has it: names of files, and in files, need not be UTF-8.
nb::object text(const std::string& bytes) {
  return nb::steal(
      PyUnicode_DecodeFSDefaultAndSize(bytes.data(), static_cast<Py_ssize_t>(bytes.size())));
}

std::string bytes_of(const nb::bytes& given) { return {given.c_str(), given.size()}; }

// f(), without Python's global lock: a file may be large. What it throws is a ValueError of one line.
template <class F>
LoadedRobot without_lock(const F& f) {
  std::string why;
  try {
    const WithoutLock released;
    return f();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    why = one_line(e.what());
  }
  PyErr_SetObject(PyExc_ValueError, text(why).ptr());
  throw nb::python_error();
}

template <class Range, class F>
nb::list list_of(const Range& range, const F& f) {
  nb::list out;
  for (const auto& one : range) out.append(f(one));
  return out;
}

// The arguments of Python's Description, Terms, Actuator and CoupledRow.
nb::dict described(const LoadedRobot& robot) {
  nb::dict frames, out;
  for (const auto& [name, frame] : robot.frames)
    if (const nb::object key = text(name); !frames.contains(key)) frames[key] = frame;
  out["name"] = text(robot.name);
  out["model"] = robot.model;
  out["q0"] = robot.home;
  out["q_range"] = list_of(robot.range, [](const std::array<double, 2>& range) {
    return nb::make_tuple(range[0], range[1]);
  });
  out["frames"] = frames;
  out["notes"] = nb::tuple(list_of(robot.notes, text));
  out["damping"] = robot.terms.damping;
  out["stiffness"] = robot.terms.stiffness;
  out["reference"] = robot.terms.reference;
  out["torque"] = robot.torque;
  out["actuators"] = list_of(robot.actuators, [](const Actuator& a) {
    return nb::make_tuple(text(a.name), a.dof, a.control, a.gain, a.constant, a.stiffness,
                          a.damping, a.row, a.stiffness_by_control, a.damping_by_control,
                          a.control_range, a.force_range);
  });
  out["force_range"] = robot.force_range;
  out["rows"] = list_of(robot.terms.rows, [](const CoupledRow& row) {
    return nb::make_tuple(row.jacobian, row.armature, row.damping, row.stiffness, row.reference,
                          row.imposed);
  });
  out["constraints"] = list_of(robot.constraints, [](const Constraint& c) {
    nb::object impedance = nb::none();
    if (const auto& d = c.impedance)
      impedance = nb::make_tuple(d->least, d->most, d->width, d->midpoint, d->power);
    return nb::make_tuple(text(c.name), static_cast<int>(c.kind), c.first, c.second, c.turning,
                          c.jacobian, c.other, c.reference, nb::tuple(nb::cast(c.polynomial)),
                          c.stiffness, c.damping, c.velocity_terms,
                          nb::tuple(nb::cast(c.compliance)), impedance);
  });
  out["compensated"] = robot.compensated;
  return out;
}

NB_MODULE(_files, m) {
  m.doc() = "The loader of robots' files.";
  m.def(
      "load",
      [](const nb::bytes& path, const std::optional<std::string>& floating, const std::string& key,
         const std::map<std::string, double>& armature, const std::string& inertia,
         const std::optional<std::string>& urdf_inertia, const std::vector<nb::bytes>& package_path,
         const std::map<std::string, double>& controls, bool imposes_couplings, bool takes_steps,
         bool takes_constraints, const nb::bytes& constraints) {
        LoadOptions options = {
            .floating = floating,
            .inertia = inertia == "given" ? InertiaPolicy::given : InertiaPolicy::balanced,
            .key = key,
            .controls = controls,
            .armature = armature,
            .imposes_couplings = imposes_couplings,
            .takes_steps = takes_steps,
            .limits_forces = takes_steps,
            .takes_constraints = takes_constraints,
            .constraints = bytes_of(constraints)};
        if (urdf_inertia)
          options.urdf_inertia =
              *urdf_inertia == "geometry" ? UrdfInertia::geometry : UrdfInertia::none;
        for (const nb::bytes& folder : package_path)
          options.package_path.push_back(bytes_of(folder));
        const std::string file = bytes_of(path);
        return described(without_lock([&] { return load_robot(file, options); }));
      },
      "path"_a, nb::kw_only(), "floating"_a.none(), "key"_a, "armature"_a, "inertia"_a,
      "urdf_inertia"_a.none(), "package_path"_a, "controls"_a, "imposes_couplings"_a,
      "takes_steps"_a, "takes_constraints"_a, "constraints"_a);
  m.def(
      "from_model",
      [](std::uintptr_t address, const std::string& name, const std::vector<double>& controls,
         bool takes_steps, bool takes_constraints, const nb::bytes& constraints) {
        const auto* const model = reinterpret_cast<const mjModel*>(address);
        const LoadOptions options = {.takes_steps = takes_steps,
                                     .limits_forces = takes_steps,
                                     .takes_constraints = takes_constraints,
                                     .constraints = bytes_of(constraints)};
        return described(without_lock([&] { return robot_of(model, name, controls, options); }));
      },
      "address"_a, nb::kw_only(), "name"_a, "controls"_a, "takes_steps"_a, "takes_constraints"_a,
      "constraints"_a);
}

}  // namespace
}  // namespace kalmarm::python

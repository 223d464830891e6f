// The module kalmarm._core: what the package's Python files build on.
#define KALMARM_IMPORTS_NUMPY
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/set.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <kalmarm/model_builder.hpp>
#include <kalmarm/version.hpp>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "arrays.hpp"
#include "check.hpp"
#include "configuration.hpp"
#include "constrained.hpp"
#include "jax.hpp"
#include "kinematics.hpp"
#include "outcomes.hpp"
#include "robot.hpp"
#include "step.hpp"

namespace kalmarm::python {
namespace {

using namespace nb::literals;

// The value of a name, as the header of the library spells it.
template <class E>
E named(const char* what, const std::string& name, std::initializer_list<E> values) {
  std::string known;
  for (const E value : values) {
    if (name == to_string(value)) return value;
    known += (known.empty() ? "" : ", ") + std::string(to_string(value));
  }
  throw nb::value_error((std::string(what) + " '" + name + "' is unknown: " + known).c_str());
}

Want want_of(const std::string& name) {
  return named("question: want", name,
               {Want::acceleration, Want::inverse, Want::diagonal, Want::log_det, Want::mass,
                Want::operational, Want::operational_diagonal, Want::solve, Want::inverse_dynamics,
                Want::derivatives});
}

Rule rule_of(const std::string& name) {
  for (const Rule rule : all_rules())
    if (name == to_string(rule)) return rule;
  throw nb::value_error(("rule '" + name + "' is unknown").c_str());
}

JointType joint_of(const std::string& name) {
  const std::map<std::string, JointType> types = {{"fixed", JointType::fixed},
                                                  {"hinge", JointType::hinge},
                                                  {"slide", JointType::slide},
                                                  {"ball", JointType::ball},
                                                  {"free", JointType::free}};
  if (const auto found = types.find(name); found != types.end()) return found->second;
  throw nb::value_error(
      ("joint '" + name + "' is unknown: fixed, hinge, slide, ball, free").c_str());
}

const char* name_of(Coordinate coordinate) {
  switch (coordinate) {
    case Coordinate::angle:
      return "angle";
    case Coordinate::distance:
      return "distance";
    case Coordinate::quaternion:
      return "quaternion";
    case Coordinate::position:
      return "position";
    case Coordinate::follower:
      return "follower";
  }
  return "?";
}

std::set<std::string> names_of(const std::set<Rule>& rules) {
  std::set<std::string> out;
  for (const Rule rule : rules) out.insert(to_string(rule));
  return out;
}

using FrameState = std::tuple<int, std::array<double, 4>, std::array<double, 3>>;

// A link's numbers in the order of LinkParameters, its coordinate as a number.
using LinkState =
    std::tuple<int, int, bool, int, double, std::array<double, 4>, std::array<double, 3>, double,
               double, std::array<double, 3>, std::array<double, 4>, std::array<double, 3>>;
using ModelState =
    std::tuple<std::vector<LinkState>, std::vector<std::string>, int, std::array<double, 3>>;

ModelState state_of(const RobotModel& model) {
  std::vector<LinkState> links;
  for (const LinkParameters& link : model.links) {
    const auto& [parent, coordinate, slides, q_index, reference, rotation, translation, armature,
                 mass, center_of_mass, inertia_axes, principal_moments] = link;
    links.emplace_back(parent, static_cast<int>(coordinate), slides, q_index, reference, rotation,
                       translation, armature, mass, center_of_mass, inertia_axes,
                       principal_moments);
  }
  return {std::move(links), model.names, model.nq, model.gravity};
}

RobotModel model_of(const ModelState& state) {
  const auto& [links, names, nq, gravity] = state;
  RobotModel out{.names = names, .nq = nq, .gravity = gravity};
  for (const LinkState& link : links)
    std::apply(
        [&](int parent, int coordinate, const auto&... rest) {
          out.links.push_back({parent, static_cast<Coordinate>(coordinate), rest...});
        },
        link);
  return out;
}

// The model with DoF k that was DoF order[k], its entries of q in the order of its DoF; and which entry
// of q each was. Joints of several DoF stay together.
std::pair<RobotModel, std::vector<int>> reordered(const RobotModel& model,
                                                  const std::vector<int>& order) {
  const int nv = model.nv();
  std::vector<int> place(nv, -1), entries;
  for (int k = 0; k < static_cast<int>(order.size()); ++k) place.at(order[k]) = k;
  if (static_cast<int>(order.size()) != nv || std::ranges::find(place, -1) != place.end())
    throw nb::value_error("order: each DoF has to be there once");
  RobotModel out{.nq = model.nq, .gravity = model.gravity};
  std::map<int, int> first;  // entry of q, by what it was
  for (const int old : order) {
    LinkParameters link = model.links[old];
    link.parent = link.parent < 0 ? -1 : place[link.parent];
    if (const int count = q_entries(link.coordinate)) {
      first[link.q_index] = static_cast<int>(entries.size());
      for (int i = 0; i < count; ++i) entries.push_back(link.q_index + i);
    }
    if (const auto found = first.find(link.q_index); found != first.end())
      link.q_index = found->second;
    out.links.push_back(link);
    out.names.push_back(model.names[old]);
  }
  return {std::move(out), std::move(entries)};
}

void bind_model(nb::module_& m) {
  nb::class_<Frame>(m, "Frame",
                    "A frame on a link: its axes, a quaternion (w, x, y, z), and its origin [m] in "
                    "the link's frame; link -1 is the fixed base.")
      .def(
          "__init__",
          [](Frame* self, int link, std::array<double, 4> rotation,
             std::array<double, 3> translation) {
            new (self) Frame{link, rotation, translation};
          },
          "link"_a, "rotation"_a = std::array<double, 4>{1, 0, 0, 0},
          "translation"_a = std::array<double, 3>{0, 0, 0})
      .def_ro("link", &Frame::link)
      .def_ro("rotation", &Frame::rotation)
      .def_ro("translation", &Frame::translation)
      .def("__getstate__",
           [](const Frame& self) { return FrameState(self.link, self.rotation, self.translation); })
      .def("__setstate__",
           [](Frame& self, const FrameState& state) {
             const auto& [link, rotation, translation] = state;
             new (&self) Frame{link, rotation, translation};
           })
      .def("__repr__", [](const Frame& self) {
        return nb::str("Frame(link={}, rotation={}, translation={})")
            .format(self.link, self.rotation, self.translation);
      });

  nb::class_<RobotModel>(m, "Model", "A robot as numbers: what a Robot is made from.")
      .def("__getstate__", &state_of)
      .def("__setstate__", [](RobotModel& self,
                              const ModelState& state) { new (&self) RobotModel(model_of(state)); })
      .def("__repr__",
           [](const RobotModel& self) {
             return "<kalmarm.Model of " + std::to_string(self.nv()) + " DoF>";
           })
      .def("_reordered", &reordered, "order"_a)
      .def_ro("nq", &RobotModel::nq)
      .def_prop_ro("nv", &RobotModel::nv)
      .def_ro("dofs", &RobotModel::names, "Names of the DoF, in the order of qd.")
      .def_ro("gravity", &RobotModel::gravity, "[m/s^2]")
      .def_prop_ro(
          "coordinates",
          [](const RobotModel& self) {
            std::vector<std::string> out;
            for (const LinkParameters& link : self.links) out.push_back(name_of(link.coordinate));
            return out;
          },
          "What q holds of every DoF: 'angle' [rad], 'distance' [m], of a ball joint 'quaternion', "
          "of "
          "a free one 'position' and 'quaternion', and 'follower' of the DoF after these.")
      .def_prop_ro(
          "q_index",
          [](const RobotModel& self) {
            std::vector<int> out;
            for (const LinkParameters& link : self.links) out.push_back(link.q_index);
            return out;
          },
          "The first entry of q that every DoF reads.")
      .def_prop_ro(
          "quaternions",
          [](const RobotModel& self) {
            std::vector<int> out;
            for (const LinkParameters& link : self.links)
              if (link.coordinate == Coordinate::quaternion) out.push_back(link.q_index);
            return out;
          },
          "Where in q a quaternion (w, x, y, z) begins.")
      .def_prop_ro(
          "single",
          [](const RobotModel& self) {
            std::vector<bool> out;
            for (const LinkParameters& link : self.links) out.push_back(takes_spring(link));
            return out;
          },
          "Of every DoF, whether it is a hinge or a slide.");

  nb::class_<ModelBuilder>(m, "ModelBuilder")
      .def(nb::init<>())
      .def(
          "add_body",
          [](ModelBuilder& self, const std::string& name, int parent, const std::string& joint,
             std::array<double, 3> axis, std::array<double, 3> position,
             std::array<double, 4> rotation, double reference, double armature, double mass,
             std::array<double, 3> center_of_mass, std::array<double, 6> inertia, bool solid) {
            return self.add_body({.name = name,
                                  .parent = parent,
                                  .joint = joint_of(joint),
                                  .axis = axis,
                                  .position = position,
                                  .rotation = rotation,
                                  .reference = reference,
                                  .armature = armature,
                                  .mass = mass,
                                  .center_of_mass = center_of_mass,
                                  .inertia = inertia,
                                  .solid = solid});
          },
          "name"_a, "parent"_a, "joint"_a, "axis"_a, "position"_a, "rotation"_a, "reference"_a,
          "armature"_a, "mass"_a, "center_of_mass"_a, "inertia"_a, "solid"_a)
      .def("set_gravity", &ModelBuilder::set_gravity, "gravity"_a)
      .def_prop_ro("nq", &ModelBuilder::nq)
      .def_prop_ro("nv", &ModelBuilder::nv)
      .def("first_dof", &ModelBuilder::first_dof, "body"_a)
      .def("first_q", &ModelBuilder::first_q, "body"_a)
      .def("frame", &ModelBuilder::frame, "body"_a)
      .def(
          "build",
          [](const ModelBuilder& self, const std::optional<std::vector<std::string>>& dofs,
             const std::optional<std::vector<double>>& armature) {
            RobotModel model = self.build();
            if ((dofs && dofs->size() != model.names.size()) ||
                (armature && armature->size() != model.links.size()))
              throw nb::value_error("names and armature are one for each DoF");
            if (dofs) model.names = *dofs;
            for (int k = 0; armature && k < model.nv(); ++k)
              model.links[k].armature = (*armature)[k];
            return model;
          },
          "dofs"_a = nb::none(), "armature"_a = nb::none(),
          "dofs, armature: by DoF, in the place of what the bodies say.");
}

void bind_answers(nb::module_& m) {
  nb::class_<Recommendation>(m, "Recommendation", "Which tolerance and which precision are enough.")
      .def_ro("tolerance", &Recommendation::tolerance, "Of `Robot`.")
      .def_prop_ro(
          "precision", [](const Recommendation& self) { return to_string(self.precision); },
          "'float32' or 'float64': the dtype to give.")
      .def_ro("worst", &Recommendation::worst,
              "Largest error in these states; infinite where one has no answer or a warning.")
      .def_ro("predicted", &Recommendation::predicted, "Error to expect in states like these.")
      .def_ro("nanoseconds", &Recommendation::nanoseconds,
              "A call on this machine, for all that is wanted.")
      .def_ro("enough", &Recommendation::enough,
              "Predicted within the tolerance; else the most accurate is given.")
      .def_ro("reason", &Recommendation::reason)
      .def("__repr__", [](const Recommendation& self) {
        return nb::str("<{}, {}: {}>")
            .format(self.tolerance, to_string(self.precision), self.reason);
      });

  nb::class_<PlanSummary>(m, "Plan", "What the robot's question needs, and what is left out.")
      .def_ro("asked", &PlanSummary::asked, "DoF of the results, in their order.")
      .def_ro("singular", &PlanSummary::singular,
              "DoF that are asked about and move no inertia: M has no inverse.")
      .def_prop_ro(
          "parts",
          [](const PlanSummary& self) {
            nb::list out;
            for (const PlanSummary::Part& part : self.parts)
              out.append(nb::make_tuple(part.kernel, part.dofs));
            return out;
          },
          nb::sig("def parts(self) -> list[tuple[str, list[int]]]"),
          "(kernel, DoF) of the parts that are solved apart.")
      .def_prop_ro(
          "rules",
          [](const PlanSummary& self) {
            nb::dict out;
            for (const PlanSummary::Acted& acted : self.acted)
              out[to_string(acted.rule)] = nb::cast(acted.dofs);
            return out;
          },
          nb::sig("def rules(self) -> dict[str, list[int]]"),
          "Rules that left something out, and the DoF that each is about.")
      .def("__repr__", [](const PlanSummary& self) {
        std::string rules;
        for (const PlanSummary::Acted& acted : self.acted)
          rules += (rules.empty() ? "" : ", ") + std::string(to_string(acted.rule));
        return nb::str(
                   "<Plan: {} DoF asked about in {} part(s); rules that left something out: {}>")
            .format(self.asked.size(), self.parts.size(), rules.empty() ? "none" : rules);
      });
}

#define KALMARM_ARRAY "numpy.typing.ArrayLike"
#define KALMARM_OPTIONS "out: typing.Any = None, *, status: bool = False, threads: int = 1"
#define KALMARM_RESULT " -> typing.Any"
#define KALMARM_CALL_OF_Q(name, more)                                 \
  nb::sig("def " name "(self, q: " KALMARM_ARRAY ", " KALMARM_OPTIONS \
          ", loads: typing.Any = None" more ")" KALMARM_RESULT)
#define KALMARM_CONTACTS \
  KALMARM_OPTIONS ", contacts: typing.Any = None, axes: str = 'aligned', loads: typing.Any = None"
#define KALMARM_CALL_WITH_CONTACTS(name, more) \
  nb::sig("def " name "(self, q: " KALMARM_ARRAY more ", " KALMARM_CONTACTS ")" KALMARM_RESULT)
#define KALMARM_FORCES                                                                      \
  KALMARM_OPTIONS                                                                           \
  ", forces: typing.Any = None, axes: str = 'aligned', loads: typing.Any = None, gravity: " \
  "typing.Any = None"
#define KALMARM_CALL_WITH_FORCES(name, more)                                                     \
  nb::sig("def " name "(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY more ", " KALMARM_FORCES \
          ")" KALMARM_RESULT)
#define KALMARM_CALL_OF_STATE(name, third) \
  KALMARM_CALL_WITH_FORCES(name, ", " third ": " KALMARM_ARRAY)

// Of products with vectors: arguments after the arrays.
#define KALMARM_OF_JVP "status"_a = false, "threads"_a = 1
#define KALMARM_OF_VJP "inertias"_a = false, "armature"_a = false, KALMARM_OF_JVP
#define KALMARM_OF_FORCES "forces"_a = nb::none(), "loads"_a = nb::none(), "gravity"_a = nb::none()
#define KALMARM_JVP ", *, status: bool = False, threads: int = 1"
#define KALMARM_VJP \
  ", *, inertias: bool = False, armature: bool = False, status: bool = False, threads: int = 1"
#define KALMARM_TURNING \
  ", forces: typing.Any = None, loads: typing.Any = None, gravity: typing.Any = None"

void bind_robot(nb::module_& m) {
  nb::class_<Factors>(m, "Factors",
                      "Factors of M in one state, for any number of solves; one thread at a time "
                      "solves, others wait.")
      .def("solve", &Factors::solve, "tau"_a, "out"_a = nb::none(),
           nb::sig("def solve(self, tau: " KALMARM_ARRAY
                   ", out: typing.Any = None) -> numpy.ndarray"),
           "x = M^-1 tau, of one vector (n,) or of one a row, (..., n). One that is not finite is "
           "raised, of several its row is NaN.")
      .def("__repr__",
           [](const Factors& self) {
             return "<kalmarm.Factors of M in one state, " + std::to_string(self.asked()) + " DoF>";
           })
      .def("__reduce__", [](const Factors&) -> nb::object {
        throw nb::type_error(
            "Factors are neither pickled nor copied: robot.factor(q) makes them again");
      });

  const nb::kw_only options;
  nb::class_<Robot> robot(m, "Robot");
  robot
      .def(
          "__init__",
          [](Robot* self, const RobotModel& model, std::optional<double> tolerance,
             const std::vector<std::string>& wants, std::vector<int> asked,
             std::vector<Frame> frames, std::vector<Frame> acted_on, std::vector<Frame> contacts,
             std::vector<Frame> loaded, std::vector<int> locked, std::vector<double> q,
             bool at_rest, const std::optional<std::vector<std::string>>& rules,
             const std::vector<std::string>& dtypes, const std::vector<std::string>& tasks,
             bool rows, std::vector<std::string> compiler, std::string folder, double limit) {
            DynamicsOptions options{.tolerance = tolerance};
            for (const std::string& want : wants) options.question.want.insert(want_of(want));
            options.question.dofs = std::move(asked);
            options.question.frames = std::move(frames);
            options.question.acted_on = std::move(acted_on);
            options.question.contacts = std::move(contacts);
            options.question.loaded = std::move(loaded);
            options.question.locked = std::move(locked);
            options.question.q = std::move(q);
            options.question.at_rest = at_rest;
            if (rules) {
              options.rules.clear();
              for (const std::string& rule : *rules) options.rules.insert(rule_of(rule));
            }
            options.code = {.rows = rows,
                            .compiler = std::move(compiler),
                            .folder = std::move(folder),
                            .limit = limit};
            for (const std::string& task : tasks) options.code.tasks.insert(want_of(task));
            const auto compiled = [&](const char* dtype) {
              return std::find(dtypes.begin(), dtypes.end(), dtype) != dtypes.end();
            };
            new (self) Robot(model, std::move(options), compiled("float32"), compiled("float64"));
          },
          "model"_a, "tolerance"_a.none(), "wants"_a, "asked"_a, "frames"_a, "acted_on"_a,
          "contacts"_a, "loaded"_a, "locked"_a, "q"_a, "at_rest"_a, "rules"_a = nb::none(),
          "dtypes"_a = std::vector<std::string>(), "tasks"_a = std::vector<std::string>(),
          "rows"_a = true, "compiler"_a = std::vector<std::string>(), "folder"_a = "",
          "limit"_a = CodeOptions().limit)
      .def_prop_ro(
          "nq", [](const Robot& self) { return self.model().nq; }, "Entries of q.")
      .def_prop_ro(
          "nv", [](const Robot& self) { return self.model().nv(); }, "Degrees of freedom.")
      .def_prop_ro("n", &Robot::asked, "DoF that results are about: nv, or as many as are asked.")
      .def_prop_ro(
          "tolerance", [](const Robot& self) { return self.options().tolerance; },
          "That was asked for; None: the default one of an answer's dtype.")
      .def_prop_ro(
          "rules", [](const Robot& self) { return names_of(self.options().rules); },
          "By which work may be left out.")
      .def_prop_ro(
          "compiled", [](Robot& self) { return nb::tuple(nb::cast(self.compiled())); },
          nb::sig("def compiled(self) -> tuple[str, ...]"),
          "Of every dtype and task of `compile`, a line: which compiler took how long and where "
          "its "
          "code is, or why the library's loops answer. Empty for a robot that was not compiled.")
      .def("plan", &Robot::plan, "What is left out, and by which rule.")
      .def("forward_dynamics", &Robot::forward_dynamics, "q"_a, "qd"_a, "tau"_a,
           "out"_a = nb::none(), options, "status"_a = false, "threads"_a = 1,
           "forces"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           "gravity"_a = nb::none(), KALMARM_CALL_OF_STATE("forward_dynamics", "tau"),
           R"(a = M(q)^-1 (tau + J' forces - bias(q, qd)), gravity and armature included.

q (..., nq), qd and tau (..., nv) -> a (..., n). Hinges: rad, rad/s, Nm, rad/s^2; slides: m, m/s,
N, m/s^2. forces (..., 6 f): of every frame of `acted_on` the moment about the origin of `axes` and the
force [Nm, N], with the axes of `Kinematics`. loads (..., 10 l), here and below: bodies that hang on the frames of
`loaded`, of each m, m c (3), Ixx, Iyy, Izz, Ixy, Ixz, Iyz about the frame's origin in its axes [kg, kg m, kg m^2], which
`kalmarm.load_of` makes of a mass, a centre and moments: they change M, bias and all that is made of them. gravity (..., 3): in the base's axes [m/s^2], in the place of the
model's.)")
      .def("inverse_dynamics", &Robot::inverse_dynamics, "q"_a, "qd"_a, "qdd"_a,
           "out"_a = nb::none(), options, "status"_a = false, "threads"_a = 1,
           "forces"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           "gravity"_a = nb::none(), KALMARM_CALL_OF_STATE("inverse_dynamics", "qdd"),
           R"(tau = M(q) qdd + bias(q, qd) - J' forces, gravity and armature included.

q (..., nq), qd and qdd (..., nv) -> tau (..., n) [Nm or N]. forces, loads and gravity: as of `forward_dynamics`.)")
      .def("bias", &Robot::bias, "q"_a, "qd"_a, "out"_a = nb::none(), options, "status"_a = false,
           "threads"_a = 1, "forces"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           "gravity"_a = nb::none(), KALMARM_CALL_WITH_FORCES("bias", ""),
           R"(Velocity terms and gravity, less J' forces: the torques of qdd = 0.

q (..., nq), qd (..., nv) -> (..., n) [Nm or N]. forces, loads and gravity: as of `forward_dynamics`.)")
      .def("gravity", &Robot::gravity, "q"_a, "out"_a = nb::none(), options, "status"_a = false,
           "threads"_a = 1, "loads"_a = nb::none(), "gravity"_a = nb::none(),
           KALMARM_CALL_OF_Q("gravity", ", gravity: typing.Any = None"),
           R"(The torques that hold the robot against gravity.

q (..., nq) -> (..., n) [Nm or N].)")
      .def("mass_matrix", &Robot::mass_matrix, "q"_a, "out"_a = nb::none(), options,
           "status"_a = false, "threads"_a = 1, "loads"_a = nb::none(),
           KALMARM_CALL_OF_Q("mass_matrix", ""),
           R"(M, armature included, both triangles.

q (..., nq) -> (..., n, n) [kg m^2, kg m or kg].)")
      .def("inverse_mass_matrix", &Robot::inverse_mass_matrix, "q"_a, "out"_a = nb::none(), options,
           "status"_a = false, "threads"_a = 1, "contacts"_a = nb::none(), "axes"_a = "aligned",
           "loads"_a = nb::none(), KALMARM_CALL_WITH_CONTACTS("inverse_mass_matrix", ""),
           R"(M^-1, both triangles; M is not formed.

q (..., nq) -> (..., n, n). contacts: as of `solve`, H^-1.)")
      .def("diagonal", &Robot::diagonal, "q"_a, "out"_a = nb::none(), options, "status"_a = false,
           "threads"_a = 1, "contacts"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           KALMARM_CALL_WITH_CONTACTS("diagonal", ""),
           "The diagonal of M^-1.\n\nq (..., nq) -> (..., n). contacts: as of `solve`, of H^-1.")
      .def("log_det", &Robot::log_det, "q"_a, "out"_a = nb::none(), options, "status"_a = false,
           "threads"_a = 1, "contacts"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           KALMARM_CALL_WITH_CONTACTS("log_det", ""),
           "log det M of the joints that are free.\n\nq (..., nq) -> (...). contacts: as of "
           "`solve`, "
           "log det H.")
      .def("operational", &Robot::operational, "q"_a, "out"_a = nb::none(), options,
           "status"_a = false, "threads"_a = 1, "contacts"_a = nb::none(), "axes"_a = "aligned",
           "loads"_a = nb::none(), KALMARM_CALL_WITH_CONTACTS("operational", ""),
           R"(J M^-1 J' of the frames that are asked about: what forces there accelerate them by.

q (..., nq) -> (..., 6 f, 6 f) of f frames, six rows each: angular, then linear, in its axes. contacts: as of
`solve`, J H^-1 J'.)")
      .def("operational_diagonal", &Robot::operational_diagonal, "q"_a, "out"_a = nb::none(),
           options, "status"_a = false, "threads"_a = 1, "contacts"_a = nb::none(),
           "axes"_a = "aligned", "loads"_a = nb::none(),
           KALMARM_CALL_WITH_CONTACTS("operational_diagonal", ""),
           R"(The diagonal of J M^-1 J', without the rest of it.

q (..., nq) -> (..., 6 f), rows and contacts as of `operational`.)")
      .def(
          "_operational_space",
          [](Robot& self, nb::handle q, nb::handle J, int k, int alike, double damping,
             double clamp, bool status, int threads) {
            return self.operational_space(q, J, k, alike, {damping, clamp}, status, threads);
          },
          "q"_a, "J"_a, "k"_a, "alike"_a, "damping"_a, "clamp"_a, "status"_a, "threads"_a)
      .def(
          "operational_inertia",
          [](Robot& self, nb::handle q, nb::handle out, double damping, double clamp, bool status,
             int threads) {
            return self.operational_inertia(q, out, {damping, clamp}, status, threads);
          },
          "q"_a, "out"_a = nb::none(), options, "damping"_a = 0.0,
          "clamp"_a = std::numeric_limits<double>::infinity(), "status"_a = false, "threads"_a = 1,
          nb::sig("def operational_inertia(self, q: " KALMARM_ARRAY
                  ", out: typing.Any = None, *, damping: float = 0.0, clamp: float = float('inf'), "
                  "status: "
                  "bool = False, threads: int = 1)" KALMARM_RESULT),
          R"((J M^-1 J')^-1 of the frames that are asked about: the inertia that forces there meet.

q (..., nq) -> (..., 6 f, 6 f), rows as of `operational`. Of J M^-1 J', with turning and moving of each frame scaled to
a mean of 1 on the diagonal, `clamp` is the largest condition number that is let pass, smaller eigenvalues are raised, and
`damping` is added to all: forces stay bounded where the robot cannot move its frames. Outcomes: D and scale are the
least and the largest eigenvalue, error is that of the inertia, and joint nv + i where no joint moves row i.)")
      .def("solve", &Robot::solve, "q"_a, "tau"_a, "out"_a = nb::none(), options,
           "status"_a = false, "threads"_a = 1, "contacts"_a = nb::none(), "axes"_a = "aligned",
           "loads"_a = nb::none(), KALMARM_CALL_WITH_CONTACTS("solve", ", tau: " KALMARM_ARRAY),
           R"(x = M(q)^-1 tau, without bias, or with contacts x = H^-1 tau.

q (..., nq), tau (..., n) -> (..., n). For many tau in one state: factor(q).solve(tau). contacts (..., 6 c): of every
frame of the robot's `contacts` a row w = sqrt(d) (p x f; f) in `axes`, f the direction in which it resists at p and d
its stiffness [kg], so that H = M + sum of (w'J)'(w'J), what contact simulators factor.)")
      .def("forward_dynamics_derivatives", &Robot::derivatives, "q"_a, "qd"_a, "tau"_a,
           "out"_a = nb::none(), options, "status"_a = false, "threads"_a = 1,
           "forces"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           "gravity"_a = nb::none(), KALMARM_CALL_OF_STATE("forward_dynamics_derivatives", "tau"),
           R"(Derivatives of forward dynamics, analytically, and a itself.

q (..., nq), qd and tau (..., nv) -> Derivatives(dq, dqd, dtau, a): three (..., n, n) and (..., n).
Column j of dq is for a change of q along DoF j's velocity, so that joints with quaternions have as
many columns as DoF. out: what an earlier call of the same shape returned. forces turn with their frames:
axes "local" is needed.)")
      .def(
          "forward_dynamics_vjp",
          [](Robot& self, nb::handle q, nb::handle qd, nb::handle tau, nb::handle w, bool inertias,
             bool armature, bool status, int threads, nb::handle forces, nb::handle loads,
             nb::handle gravity) {
            return self.vector_jacobian(Want::acceleration, q, qd, tau, w, inertias, armature,
                                        status, threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "tau"_a, "w"_a, options, KALMARM_OF_VJP, KALMARM_OF_FORCES,
          nb::sig("def forward_dynamics_vjp(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                  ", tau: " KALMARM_ARRAY ", w: " KALMARM_ARRAY KALMARM_VJP KALMARM_TURNING
                  ")" KALMARM_RESULT),
          R"(Derivatives of w'a, a = M^-1 (tau - bias), by all that a depends on, in O(n): no matrix is formed.

q (..., nq), qd, tau and w (..., nv) -> `Gradients`. About 2.5 times the time of a. inertias, armature: those by
these are worked out too. forces, loads and gravity: as of `forward_dynamics`, forces in the axes of their frames, with
which they turn; those by them are returned. Outcomes: of a and M^-1 w, the worse of both. Not of a robot that
leaves joints out (asked, locked) or is at rest.)")
      .def(
          "forward_dynamics_jvp",
          [](Robot& self, nb::handle q, nb::handle qd, nb::handle tau, nb::handle dq,
             nb::handle dqd, nb::handle dtau, bool status, int threads, nb::handle forces,
             nb::handle loads, nb::handle gravity) {
            return self.jacobian_vector(Want::acceleration, q, qd, tau, dq, dqd, dtau, status,
                                        threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "tau"_a, "dq"_a, "dqd"_a, "dtau"_a, options, KALMARM_OF_JVP,
          KALMARM_OF_FORCES,
          nb::sig("def forward_dynamics_jvp(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                  ", tau: " KALMARM_ARRAY ", dq: " KALMARM_ARRAY ", dqd: " KALMARM_ARRAY
                  ", dtau: " KALMARM_ARRAY KALMARM_JVP KALMARM_TURNING ")" KALMARM_RESULT),
          R"(How a changes along dq, dqd and dtau (..., nv), dq along the velocities of the joints: da (..., nv), in O(n).

q (..., nq), qd and tau (..., nv). Forces, which turn with their frames, loads and gravity stay as they are.)")
      .def(
          "inverse_dynamics_vjp",
          [](Robot& self, nb::handle q, nb::handle qd, nb::handle qdd, nb::handle w, bool inertias,
             bool armature, bool status, int threads, nb::handle forces, nb::handle loads,
             nb::handle gravity) {
            return self.vector_jacobian(Want::inverse_dynamics, q, qd, qdd, w, inertias, armature,
                                        status, threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "qdd"_a, "w"_a, options, KALMARM_OF_VJP, KALMARM_OF_FORCES,
          nb::sig("def inverse_dynamics_vjp(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                  ", qdd: " KALMARM_ARRAY ", w: " KALMARM_ARRAY KALMARM_VJP KALMARM_TURNING
                  ")" KALMARM_RESULT),
          R"(Derivatives of w'tau, tau = M qdd + bias, by all that tau depends on, in O(n).

q (..., nq), qd, qdd and w (..., nv) -> `Gradients`, of which dqdd is M w. Else as `forward_dynamics_vjp`.)")
      .def(
          "inverse_dynamics_jvp",
          [](Robot& self, nb::handle q, nb::handle qd, nb::handle qdd, nb::handle dq,
             nb::handle dqd, nb::handle dqdd, bool status, int threads, nb::handle forces,
             nb::handle loads, nb::handle gravity) {
            return self.jacobian_vector(Want::inverse_dynamics, q, qd, qdd, dq, dqd, dqdd, status,
                                        threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "qdd"_a, "dq"_a, "dqd"_a, "dqdd"_a, options, KALMARM_OF_JVP,
          KALMARM_OF_FORCES,
          nb::sig("def inverse_dynamics_jvp(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                  ", qdd: " KALMARM_ARRAY ", dq: " KALMARM_ARRAY ", dqd: " KALMARM_ARRAY
                  ", dqdd: " KALMARM_ARRAY KALMARM_JVP KALMARM_TURNING ")" KALMARM_RESULT),
          R"(How tau changes along dq, dqd and dqdd (..., nv): dtau (..., nv), in O(n).

q (..., nq), qd and qdd (..., nv). Forces, loads and gravity as of `forward_dynamics_jvp`.)")
      .def(
          "solve_vjp",
          [](Robot& self, nb::handle q, nb::handle tau, nb::handle w, bool inertias, bool armature,
             bool status, int threads, nb::handle loads) {
            return self.vector_jacobian(Want::solve, q, nb::none(), tau, w, inertias, armature,
                                        status, threads, nb::none(), loads, nb::none());
          },
          "q"_a, "tau"_a, "w"_a, options, KALMARM_OF_VJP, "loads"_a = nb::none(),
          nb::sig("def solve_vjp(self, q: " KALMARM_ARRAY ", tau: " KALMARM_ARRAY
                  ", w: " KALMARM_ARRAY KALMARM_VJP ", loads: typing.Any = None)" KALMARM_RESULT),
          R"(Derivatives of w'x, x = M^-1 tau, by q, tau and what M depends on, in O(n).

q (..., nq), tau and w (..., nv) -> `Gradients`, of which dtau is M^-1 w. Else as `forward_dynamics_vjp`.)")
      .def("_operational_vjp", &Robot::operational_vjp, "q"_a, "W"_a, "inertias"_a, "armature"_a,
           "status"_a, "threads"_a, "loads"_a.none())
      .def(
          "solve_jvp",
          [](Robot& self, nb::handle q, nb::handle tau, nb::handle dq, nb::handle dtau, bool status,
             int threads, nb::handle loads) {
            return self.jacobian_vector(Want::solve, q, nb::none(), tau, dq, nb::none(), dtau,
                                        status, threads, nb::none(), loads, nb::none());
          },
          "q"_a, "tau"_a, "dq"_a, "dtau"_a, options, KALMARM_OF_JVP, "loads"_a = nb::none(),
          nb::sig("def solve_jvp(self, q: " KALMARM_ARRAY ", tau: " KALMARM_ARRAY
                  ", dq: " KALMARM_ARRAY ", dtau: " KALMARM_ARRAY KALMARM_JVP
                  ", loads: typing.Any = None)" KALMARM_RESULT),
          R"(How x = M^-1 tau changes along dq and dtau (..., nv): dx (..., nv), in O(n).

q (..., nq), tau (..., nv). Loads as of `forward_dynamics_jvp`.)")
      .def("factor", &Robot::factor, nb::keep_alive<0, 1>(), "q"_a, options,
           "contacts"_a = nb::none(), "axes"_a = "aligned", "loads"_a = nb::none(),
           nb::sig("def factor(self, q: " KALMARM_ARRAY
                   ", *, contacts: typing.Any = None, axes: str = 'aligned', loads: typing.Any = "
                   "None) -> Factors"),
           "Factors of M in one state q (nq,), for any number of solves, or of H: contacts (6 c,) "
           "as of "
           "`solve`.")
      .def("_recommend", &Robot::recommend, "tolerance"_a, "q"_a, "qd"_a, "tau"_a,
           nb::sig("def _recommend(self, tolerance: float, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                   ", tau: " KALMARM_ARRAY ") -> Recommendation"))
      .def("_time_forward_dynamics", &Robot::time_forward_dynamics, "q"_a, "qd"_a, "tau"_a, "out"_a,
           "calls"_a, options, "singly"_a = false, "threads"_a = 1,
           nb::sig("def _time_forward_dynamics(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                   ", tau: " KALMARM_ARRAY
                   ", out: typing.Any, calls: int, *, singly: bool = False, threads: int = 1) -> "
                   "float"),
           "Seconds of C++ calls, of all rows or of one after another: for python/benchmarks.");
  bind_configuration(robot);
}

void bind_kinematics(nb::module_& m) {
  nb::class_<KinematicsOfRobot>(m, "Kinematics")
      .def(nb::init<RobotModel, std::vector<Frame>, std::vector<int>>(), "model"_a, "frames"_a,
           "bodies"_a)
      .def_prop_ro("mass", &KinematicsOfRobot::mass, "Of all bodies [kg].")
      .def("_compute", &KinematicsOfRobot::compute, "results"_a, "q"_a, "qd"_a.none(),
           "qdd"_a.none(), "axes"_a, "threads"_a,
           nb::sig("def _compute(self, results: list[int], q: typing.Any, qd: typing.Any, qdd: "
                   "typing.Any, axes: str, threads: int) -> list[numpy.ndarray]"),
           "An array a result, whose last dimension has all numbers of a state.");
}

void bind_check(nb::module_& m) {
  nb::class_<CheckOfRobot>(m, "AnswerCheck")
      .def(nb::init<RobotModel, double, double>(), "model"_a, "tolerance"_a, "resolution"_a)
      .def("_answer", &CheckOfRobot::answer, "what"_a, "q"_a, "qd"_a.none(), "tau"_a.none(), "x"_a,
           "threads"_a,
           nb::sig("def _answer(self, what: str, q: typing.Any, qd: typing.Any, tau: typing.Any, "
                   "x: typing.Any, threads: int) -> tuple[numpy.ndarray, numpy.ndarray]"),
           "error, euclid, uncertainty and the number of the verdict; outcomes.");
}

int import_numpy() {
  import_array1(-1);
  return 0;
}

NB_MODULE(_core, m) {
#ifdef __x86_64__
  // NumPy, which is compiled for x86-64-v2, would end the process by an illegal instruction.
  if (!__builtin_cpu_supports("sse4.2"))
    throw nb::import_error(
        "kalmarm: this processor has no SSE4.2, without which NumPy does not run; a virtual "
        "machine may show its host's instead");
#endif
  if (import_numpy() < 0) throw nb::python_error();
  m.doc() = "The compiled part of kalmarm.";
  m.attr("__version__") = KALMARM_VERSION;
  m.attr("mujoco_version") = KALMARM_MUJOCO_VERSION;  // of _files; "" where that is not built
  m.attr("last_bits") = last_bits;
  m.def("instruction_set", &instruction_set,
        "What the kernels in use were compiled for: x86-64-v3 or -v4, the best that the "
        "processor has unless the environment variable KALMARM_INSTRUCTION_SET names a lower one; "
        "'native' where they were compiled for this machine alone.");
  m.def(
      "_add_to_type_of",
      [](nb::handle one, const char* name, nb::handle value) {
        // The stable interface reaches a type's dictionary through what shows it alone.
        PyTypeObject* const type = Py_TYPE(one.ptr());
        const nb::object shown = nb::handle(reinterpret_cast<PyObject*>(type)).attr("__dict__");
        const nb::object in = nb::module_::import_("gc").attr("get_referents")(shown)[0];
        if (PyDict_SetItemString(in.ptr(), name, value.ptr()) < 0) throw nb::python_error();
        PyType_Modified(type);
      },
      "one"_a, "name"_a, "value"_a,
      "An attribute of nanobind's types of functions, which Python may not change; those of this "
      "package are its own (NB_DOMAIN).");
  bind_outcomes(m);
  bind_model(m);
  bind_answers(m);
  bind_robot(m);
  bind_kinematics(m);
  bind_check(m);
  bind_step(m);
  bind_constrained(m);
  bind_jax(m);
}

}  // namespace
}  // namespace kalmarm::python

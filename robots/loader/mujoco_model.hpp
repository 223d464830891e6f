// Robots from MJCF and URDF files, through MuJoCo's compiler.
//
// What dynamics and implicit steps do not ask for is taken out before compiling (mjSpec): sensors,
// actuators whose force is not that of a spring, a damper and a torque (actuators.hpp), tendons that are
// no rows (tendons.hpp), contacts, equalities, keyframes, cameras, lights, sites, materials, textures,
// skins, the inertias of bodies that cannot move (but their mass where settotalmass counts it), and every
// geom and mesh that no inertia comes from. So a robot whose mesh files are missing still loads; where an inertia has to
// come from a geom, the geom stays. Armature stays wherever MuJoCo adds it to M: on joints, and on
// actuators that drive a single hinge or slide; armature on tendons or on other transmissions
// couples joints, and such a file is refused, but that of fixed tendons where steps are taken.
//
// Lowering, body by body, to one-DoF joints (algorithms/model/model.hpp). DoF k of MuJoCo is DoF k
// here:
//   hinge, slide   one DoF; the link's z axis is the joint's axis, its origin the hinge's anchor
//   ball           three turning DoF about the body's x, y, z
//   free           three sliding DoF along the world's x, y, z, then a ball
//   no joint       the body's inertia goes to the link that it is welded to; on the world it is
//                  dropped
#pragma once

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/model/model.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/actuators.hpp"
#include "robots/loader/files/keyframe.hpp"
#include "robots/loader/imposed_rows.hpp"
#include "robots/loader/mujoco_strip.hpp"

namespace kalmarm {

// Where a frame stands in the axes of a lowered link.
struct LinkFrame {
  int link = -1;  // -1: the world
  Eigen::Quaternion<double> R = Eigen::Quaternion<double>::Identity();
  Vector3<double> p = Vector3<double>::Zero();  // [m]

  LinkFrame then(const Vector3<double>& translation,
                 const Eigen::Quaternion<double>& rotation) const {
    return {link, R * rotation, p + R * translation};
  }
};

// A compiled model in one-DoF joints. Throws InputError.
Model<double> lowered(const mjModel* model);

struct NamedLinkFrame {
  std::string name;
  LinkFrame at;
};

// The diagonal of M where a compiled model starts (nv).
VectorX<double> diagonal_at_start(const mjModel* model);

class MujocoModel {
 public:
  // From an MJCF or URDF file. Throws InputError with file, element and MuJoCo's reason. Notes say
  // what was ignored and changed (files/read_file.hpp), and which inertias no solid body has
  // (files/given_inertia.hpp).
  static std::shared_ptr<const MujocoModel> load(const std::string& path,
                                                 const LoadOptions& options = {},
                                                 Frames frames = Frames::stripped);

  // A copy of a compiled model, as it is now, with what of it has terms; controls: MuJoCo's ctrl (nu).
  // Notes say what is ignored, by the same rules. Throws InputError.
  static std::shared_ptr<const MujocoModel> copy_of(const mjModel* model,
                                                    const VectorX<double>& controls,
                                                    const LoadOptions& options);

  // From a model of one-DoF joints that all carry mass, numbered depth first; for families. Throws
  // InputError.
  static std::shared_ptr<const MujocoModel> from(const Model<double>& model,
                                                 const std::string& name);

  // Takes the compiled model. Throws InputError where the keyframe is not the model's.
  // controls: one an actuator; none: all zero. imposed: rows of joint_terms(), after those of tendons.
  explicit MujocoModel(mjModel* model, std::vector<std::string> notes = {}, Keyframe key = {},
                       VectorX<double> controls = {},
                       const std::vector<NamedCoupling>& imposed = {});

  const mjModel* get() const { return model_.get(); }
  const std::vector<std::string>& notes() const { return notes_; }  // of load(), each a line
  const Keyframe& home() const { return home_; }  // as the file or its keyframe starts
  Model<double> lower() const { return lowered(get()); }

  // Of every entry of q: a joint's limits, else +-pi of hinges and +-0.5 m of slides; +-1 of others.
  // Throws InputError where one is wider than the largest number.
  std::vector<std::array<double, 2>> ranges() const;

  // As LoadedRobot has them, and the joints' own terms apart.
  JointTerms joint_terms() const;
  std::vector<Actuator> actuators() const { return actuators_of(get(), controls_); }
  Driven driven() const { return kalmarm::driven(joint_terms(), actuators()); }
  std::optional<Model<double>> compensated() const;

  const VectorX<double>& controls() const { return controls_; }  // MuJoCo's ctrl
  std::vector<LinkFrame> body_frames() const;                    // of MuJoCo's bodies, in its order
  std::vector<NamedLinkFrame> frames() const;   // those with a name: sites, then bodies
  std::vector<Constraint> constraints() const;  // constraints.hpp

 private:
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::vector<std::string> notes_;
  Keyframe home_;
  VectorX<double> controls_;
  std::vector<CoupledRow> imposed_;
};

}  // namespace kalmarm

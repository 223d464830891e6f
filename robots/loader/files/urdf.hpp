// What is particular to URDF, beyond what MuJoCo's reader does.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "kalmarm/load.hpp"
#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {

// Throws InputError where several links have no parent: the format is one tree, but MuJoCo's reader
// takes a forest.
void refuse_several_roots(const std::vector<XmlTag>& tags);

// Throws InputError where two joints or two links have one name, or a joint's link has none.
void refuse_bad_names(const std::vector<XmlTag>& tags);

// Names of joints that a <mimic> follows and that are fixed or not in the file, which MuJoCo's reader
// passes over; "" where there is none.
std::string lost_mimics(const std::vector<XmlTag>& tags);

// "ignored: 7 transmissions, 2 rotor inertias; option armature gives joints what they add to M", of what
// ROS and Drake put into a URDF; "" where there is none.
std::string ignored_transmissions(const std::vector<XmlTag>& tags);

// Links without <inertial>: massless in ROS, while MuJoCo takes their collision geometry at 1000
// kg/m^3, which needs the mesh files. They get what the policy says; none counts where a mesh file
// is not there or is of a kind that MuJoCo does not read. Shapes without volume weigh nothing. Returns
// which moving links got what, in one line; "" where it makes no difference. Throws InputError where
// geometry is asked for and not there.
std::string weigh_links(mjSpec* spec, const std::string& path, UrdfInertia policy);

}  // namespace kalmarm

// Everything that depends on MuJoCo's release, in one place: 3.10 and later.
#pragma once

#include <mujoco/mujoco.h>

#include <algorithm>
#include <iterator>
#include <type_traits>

static_assert(mjVERSION_HEADER >= 3010000, "MuJoCo 3.10 or later is needed: run scripts/setup");

// How many digits MuJoCo writes into XML, 6 unless told: not in its headers, but exported. Null
// where a release does not have them.
extern "C" {
__attribute__((weak)) int _mjPRIVATE__get_xml_precision();
__attribute__((weak)) void _mjPRIVATE__set_xml_precision(int digits);
}

namespace kalmarm {

// Makes MuJoCo's fatal errors exceptions (InputError) and keeps its warnings off the terminal.
// Called by every entry point of robots/; cheap.
void install_mujoco_handlers();

// Dense M (nv x nv, row-major) of the state in d, both triangles. The three-argument form since
// 3.10.
inline void full_mass_matrix(const mjModel* m, const mjData* d, mjtNum* M) { mj_fullM(m, d, M); }

// Number of actuators: its own field since 3.11, before that one control each.
inline int actuator_count(const mjModel* m) {
#if mjVERSION_HEADER >= 3011000
  return static_cast<int>(m->nactuator);
#else
  return static_cast<int>(m->nu);
#endif
}

// Where in ctrl the control of an actuator is that has one alone.
inline int control_address(const mjModel* m, int actuator) {
#if mjVERSION_HEADER >= 3011000
  return m->actuator_ctrladr[actuator];
#else
  return static_cast<void>(m), actuator;
#endif
}

// Length or force from which the spring of a tendon yields; releases before 3.13 have none.
template <class Tendon>
double yield_of(const Tendon& tendon) {
  if constexpr (requires { tendon.springyield; })
    return tendon.springyield;
  else
    return 0;
}
template <class Compiled>
double yield_of_tendon(const Compiled& m, int tendon) {
  if constexpr (requires { m.tendon_springyield; })
    return m.tendon_springyield[tendon];
  else
    return 0;
}

// The inputs of an actuator are those of its type: older releases have one alone.
template <class SpecActuator>
void clear_signature(SpecActuator& actuator) {
  if constexpr (requires { actuator.ctrlspec; }) actuator.ctrlspec = 0;
}

// MuJoCo writes all digits of a double while this lives.
class AllDigits {
 public:
  AllDigits() {
    if (!exported()) return;
    before_ = _mjPRIVATE__get_xml_precision();
    _mjPRIVATE__set_xml_precision(17);
  }
  AllDigits(const AllDigits&) = delete;
  AllDigits& operator=(const AllDigits&) = delete;
  ~AllDigits() {
    if (exported()) _mjPRIVATE__set_xml_precision(before_);
  }

 private:
  static bool exported() { return _mjPRIVATE__get_xml_precision && _mjPRIVATE__set_xml_precision; }
  int before_ = 0;
};

// The linear one of a joint's coefficients of stiffness or damping: the first, or the only one in
// older releases.
template <class Coefficients>
auto& linear(Coefficients& coefficients) {
  if constexpr (std::is_array_v<Coefficients>)
    return coefficients[0];
  else
    return coefficients;
}

// Whether one of the others, which older releases have not, is not zero.
template <class Coefficients>
bool is_nonlinear(const Coefficients& coefficients) {
  if constexpr (std::is_array_v<Coefficients>)
    return std::any_of(std::begin(coefficients) + 1, std::end(coefficients),
                       [](double c) { return c != 0; });
  else
    return false;
}

}  // namespace kalmarm

// Whether what a fit leaves of the torques looks like friction: that it was not told of, or that it
// was told of and is not there.
//
// Of every joint the residual e(t) of the torques is fitted by a line in the friction of
// parameters.hpp,
//   e ~ v q' + c tanh(q' / 0.01)                                                             (1)
// It looks like friction where (1) explains more than half of e'e and e is more than 1 % of the
// torques. The sum of (1) times q', the power that it takes, says which of the two it is.
#pragma once

#include <string>
#include <vector>

#include "accuracy/fits/parameters.hpp"
#include "accuracy/fits/samples.hpp"

namespace kalmarm {

struct FrictionLeft {
  std::vector<int> missing;    // DoF on which the data show more friction than the robot has
  std::vector<int> excessive;  // or less
};
FrictionLeft friction_left(const Mechanics<double>& robot, const Samples& samples);

}  // namespace kalmarm

// What a robot's owner should know of its limits, in one sentence.
//
// Right to d digits: in both tasks, no state that was searched was refused, and no error is larger
// than 10^-d. The rule:
//   1. The promise is about the first of Ladder<default> in float32 and in float64 and
//      Ladder<last_bits> in float64 that is right to at least 3 digits on the robot as given; d is the
//      number of its digits there, at most 5 in float32, 9 in float64. Where it is not the first,
//      the sentence begins with what float32 keeps.
//   2. A stress is a limit where the promise does not hold at all of its values. It holds up to the
//      last value before the first at which it does not.
//      One that is told is named with its last value too where it is no limit.
//   3. Beyond the limits: the first of those after it that is right to d digits on the robot as given
//      and at all values of the stresses that are limits. What float64 keeps in all that was
//      searched is said too, if that is d digits or more.
#pragma once

#include <string>
#include <vector>

#include "accuracy/limits/campaign.hpp"

namespace kalmarm::limits {

struct Promise {
  int contender = -1;  // as in Found::tallies; -1: none is right to 3 digits
  int digits = 0;
};

// floor(-log10(error)) of the larger error of the tasks, 0 where any state was refused.
int digits_kept(const Swept& swept, std::size_t value, int contender);

Promise promise_of(const Swept& given);

// How many values, from the first on, keep the promise.
std::size_t values_kept(const Swept& swept, const Promise& promise);

// swept: the robot as given first.
std::string sentence_of(const std::vector<Swept>& swept);

}  // namespace kalmarm::limits

// What contacts do to digits: H x = b, H = M + J'DJ (study/contacts/contact_row.hpp), by every way of
// carrying them, against truth. CSV, one answer a row:
//   scene,n,rows,stiffness,precision,variant,state,status,warns,error,kS
// rows: of J; stiffness: d along a contact's normal [kg], 0.3 d along its two tangents; warns: whether
// the outcome does; error: |dx| / |x|, empty where there is no answer. Truth is an array filter in 100
// digits; parameters, state, contacts and b are rounded to the precision first and exact from there. kS: what
// moving all of these by a little each, at random, moves x by (truth/structured_condition.hpp):
//   kS = sqrt(mean over draws of |x' - x|^2) / (|x| delta),   p' = p (1 +- delta)
// an answer that is wrong by u kS is as good as its parameters.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "robots/scene/scene.hpp"
#include "robots/scene/standing.hpp"

namespace kalmarm::contact_errors {

inline constexpr const char* csv_header =
    "scene,n,rows,stiffness,precision,variant,state,status,warns,error,kS\n";

// Rows of one state in float32 or float64; b is its tau, the seed is of points and normals.
std::string rows(const Scene& scene, const State& state, int number, const Standing& standing,
                 const std::vector<double>& stiffness, std::uint64_t seed,
                 const std::string& precision);

}  // namespace kalmarm::contact_errors

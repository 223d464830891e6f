// A robot that stands: contacts at points of some of its links, drawn from a seed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/study/contacts/contact_row.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

struct Standing {
  std::vector<int> links;
  int points = 1;  // of each, at its radius of gyration from its centre of mass
};

// Those of the joints that are named, by patterns, and that have mass; where none is named, those that
// carry no other. Throws InputError where there is none.
std::vector<int> standing_links(const Scene& scene, const std::vector<std::string>& joints);

// Three rows a point: d = 1 along a normal, 0.3 along its two tangents.
std::vector<ContactRow<double>> contacts_of(const Model<double>& model, const Standing& standing,
                                            std::uint64_t seed);

// The same with d times as stiff, rounded to T.
template <class T>
std::vector<ContactRow<T>> stiffened(std::vector<ContactRow<double>> contacts, double d) {
  std::vector<ContactRow<T>> out;
  for (ContactRow<double>& row : contacts) {
    row.d *= d;
    out.push_back(row.cast<T>());
  }
  return out;
}

}  // namespace kalmarm

// Numbers and names as C text. Nothing of a robot's file reaches a comment or a string of C: of its names what is no
// letter, digit or underscore is replaced.
#pragma once

#include <set>
#include <string>

namespace kalmarm {

// The shortest decimal that is read as x again, of S (float, with its suffix, or double).
template <class S>
std::string c_number(S x);

// Letters, digits and underscores of the name, anything else an underscore.
std::string c_identifier(const std::string& name);

// prefix and the identifier of a name, with a number where others have the same; remembered in `taken`.
std::string unique_identifier(const std::string& prefix, const std::string& name,
                              std::set<std::string>& taken);

}  // namespace kalmarm

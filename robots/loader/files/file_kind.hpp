// What kind of file a user brought.
#pragma once

#include <string>
#include <vector>

#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {

// Throws InputError with the path and what to do about it: SDF, USD, xacro, a fragment that other
// MJCF files include.
void refuse_other_kinds(const std::string& path, const std::string& text,
                        const std::vector<XmlTag>& tags);

bool is_urdf(const std::vector<XmlTag>& tags);

}  // namespace kalmarm

// Files that an MJCF file includes or attaches.
#pragma once

#include <string>
#include <vector>

#include "robots/files/xml_tags.hpp"

namespace kalmarm {

// Looks at all of them before MuJoCo's reader does, which attaches a model to itself until its
// stack ends and waits for a pipe that nobody writes to. Throws InputError where a model attaches
// itself, where more than 1000 are attached, and where one cannot be read (text_file.hpp); one that
// is not there is left to MuJoCo.
void refuse_bad_attachments(const std::string& path, const std::vector<XmlTag>& tags);

}  // namespace kalmarm

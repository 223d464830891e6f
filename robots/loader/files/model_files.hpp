// The XML files that make one robot: a file, what it includes and what it attaches.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "robots/loader/files/xml_tags.hpp"

namespace kalmarm {

struct ModelFile {
  std::string path, text;
  std::string model_folder;  // of the model that it belongs to

  // What an <include> names, if it is there: MuJoCo looks beside the model, and then beside this
  // file.
  std::optional<std::string> included(const XmlTag& tag) const;

  // What a <model> to attach names, if it is there: beside the model.
  std::optional<std::string> attached(const XmlTag& tag) const;
};

// `path` and every file that MuJoCo's reader would open for it, each behind what names it first.
// That reader attaches a model to itself until its stack ends, and waits for a pipe that nobody
// writes to: throws InputError where a model attaches itself, where more than 1000 are attached, and
// where a file cannot be read (text_file.hpp). One that is not there is left to it.
std::vector<ModelFile> model_files(const std::string& path);

}  // namespace kalmarm

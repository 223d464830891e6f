// Files that programs write, and standard output in their place.
#pragma once

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "robots/input_error.hpp"

namespace kalmarm {

// Writes the whole file or nothing: under a temporary name first. Throws InputError, also where the
// path is there already as something that a rename would destroy, such as a device.
inline void write_file(const std::string& path, const std::string& text) {
  if (std::filesystem::exists(path) && !std::filesystem::is_regular_file(path))
    throw InputError(path + ": is not a file that can be replaced");
  const std::string temporary = path + ".part";
  std::ofstream file(temporary, std::ios::binary);
  file << text;
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(temporary, path, error);
  if (!file || error) {
    std::filesystem::remove(temporary, error);
    throw InputError(path + ": cannot be written");
  }
}

// The file of --json, whole or not at all. To standard output it goes alone: a program then prints
// nothing else there.
inline void write_json(const std::string& path, const std::string& text) {
  if (path != "-") return write_file(path, text);
  if (std::fputs(text.c_str(), stdout) == EOF || std::fflush(stdout) != 0)
    throw InputError("standard output cannot be written");
}

}  // namespace kalmarm

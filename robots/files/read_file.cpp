#include "robots/files/read_file.hpp"

#include <filesystem>
#include <fstream>
#include <iterator>

#include "robots/files/floating.hpp"
#include "robots/files/ignored.hpp"
#include "robots/input_error.hpp"

namespace kalmarm {
namespace {

// MuJoCo's reader would load a part of the robot without a word.
void refuse_xacro(const std::string& path) {
  std::ifstream file(path);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  if (text.find("<xacro:") != std::string::npos)
    throw InputError(path + ": has macros, expand them first: xacro " + path + " > robot.urdf");
}

SpecPtr parse(const std::string& path) {
  if (!std::filesystem::is_regular_file(path)) throw InputError(path + ": no such file");
  refuse_xacro(path);
  char error[1024] = "";
  SpecPtr spec(mj_parseXML(path.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  if (!spec) throw InputError(path + ": " + one_line(error));
  return spec;
}

}  // namespace

ReadFile read_file(const std::string& path, const LoadOptions& options) {
  ReadFile out{parse(path), {}};
  mjSpec* spec = out.spec.get();
  const auto note = [&](const std::string& text) {
    if (!text.empty()) out.notes.push_back(text);
  };
  try {
    if (options.floating) free_root(spec, *options.floating);
    note(note_of_welded_base(spec));
    if (const std::string parts = ignored_parts(spec); !parts.empty()) note("ignored: " + parts);
  } catch (const InputError& e) {
    throw InputError(path + ": " + e.what());
  }
  return out;
}

}  // namespace kalmarm

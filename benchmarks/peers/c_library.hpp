// C code, such as a library generates for a mechanism, made into a shared library by a compiler of
// choice. What was made before from the same text in the same way is taken again.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace kalmarm {

struct CCompiler {
  std::string path, version;
  std::vector<std::string> flags;  // of compiling; linking has none
};

struct CLibrary {
  std::filesystem::path path;
  double seconds;  // of the processor that the compiler took when it was made
};

// Of C files by name, and headers (.h), in a folder where it stays. Throws std::runtime_error where the compiler
// fails, which says itself what is wrong, and std::filesystem::filesystem_error.
CLibrary make_library(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                      const std::filesystem::path& folder);

}  // namespace kalmarm

// C code, such as is generated for a robot, made into a shared library by a compiler of choice, and loaded. What was made
// before from the same text, by the same compiler, with the same flags, for the same instruction set, is taken again:
//
//   FOLDER/KEY/library.so, recipe, made
//
// KEY is a hash of the recipe: text, command and flags, and all macros that the compiler defines with them, which say its
// version and, with -march=native, what this processor has. What is taken has the recipe itself and the checksum of what
// was made, and belongs to the user, so that neither two recipes of one hash nor half a file is loaded.
//
// A library is made in a folder of its own beside, and moved into place by one rename, so that processes may do so at the
// same time and nothing half-written ever stands there.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace kalmarm {

struct CCompiler {
  // A program, found on PATH, and its first arguments, such as {"python", "-m", "ziglang", "cc"}.
  std::vector<std::string> command;
  std::vector<std::string> flags;  // of compiling; linking has none
  double limit = 600;              // seconds that a file may take
};

// Open as long as a copy is there.
class CLibrary {
 public:
  struct Made {
    std::filesystem::path path;
    std::string version;  // of the compiler, as it says itself
    double seconds;       // of the processor that it took
    bool was_there;       // and is taken again
  };

  // Throws std::runtime_error where it cannot be loaded.
  explicit CLibrary(const Made& made);

  const Made& made() const { return made_; }

  // Null where there is none.
  template <class Function>
  Function* function(const std::string& name) const {
    return reinterpret_cast<Function*>(symbol(name));
  }

 private:
  void* symbol(const std::string& name) const;

  Made made_;
  std::shared_ptr<void> handle_;
};

// Of C files by name, and headers (.h). Throws std::runtime_error, in one line, where the compiler fails or something
// cannot be written.
CLibrary make_library(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                      const std::filesystem::path& folder);

}  // namespace kalmarm

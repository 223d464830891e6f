#include "algorithms/generate/c_library.hpp"

#include <dlfcn.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "algorithms/generate/run_command.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// A folder of its own for one process, which goes with all that is in it.
struct TemporaryFolder {
  fs::path path;

  explicit TemporaryFolder(const fs::path& in) {
    fs::create_directories(in);
    std::string name = in / "making-XXXXXX";
    if (!mkdtemp(name.data())) throw std::runtime_error("cannot write to " + in.string());
    path = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

void write(const fs::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  if (!(out << text).flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// FNV-1a.
std::string hash(const std::string& text) {
  std::uint64_t sum = 0xcbf29ce484222325;
  for (const unsigned char c : text) sum = (sum ^ c) * 0x100000001b3;
  std::ostringstream out;
  out << std::hex << sum;
  return out.str();
}

// What the compiler with its flags defines by itself.
std::string macros_of(const CCompiler& compiler) {
  std::vector<std::string> command = compiler.command;
  command.insert(command.end(), compiler.flags.begin(), compiler.flags.end());
  command.insert(command.end(), {"-dM", "-E", "-x", "c", "/dev/null"});
  return run_command(command, compiler.limit).output;
}

// The version among them.
std::string version_in(const std::string& macros) {
  const std::string name = "#define __VERSION__ \"";
  const std::size_t at = macros.find(name);
  if (at == std::string::npos) return "";
  const std::size_t first = at + name.size();
  return macros.substr(first, macros.find('"', first) - first);
}

std::string recipe_of(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                      const std::string& macros) {
  std::string out;
  const auto add = [&out](const std::string& part) {
    out += std::to_string(part.size()) + ' ' + part + '\n';
  };
  for (const auto* list : {&compiler.command, &compiler.flags})
    for (const std::string& word : *list) add(word);
  add(macros);
  for (const auto& [name, text] : files) {
    add(name);
    add(text);
  }
  return out;
}

// Whether it belongs to this user, and nobody else can change it.
bool is_own(const fs::path& path, mode_t kind) {
  struct stat found = {};
  return lstat(path.c_str(), &found) == 0 && (found.st_mode & S_IFMT) == kind &&
         found.st_uid == geteuid() && (found.st_mode & (S_IWGRP | S_IWOTH)) == 0;
}

std::string library_in(const fs::path& entry) { return entry / "library.so"; }

// What stands there, where it is what the recipe gives, whole and this user's.
std::optional<CLibrary::Made> taken(const fs::path& entry, const std::string& recipe) {
  const std::string library = library_in(entry);
  if (!is_own(entry, S_IFDIR) || !is_own(library, S_IFREG)) return {};
  double seconds = 0;
  std::string sum;
  if (!(std::ifstream(entry / "made") >> seconds >> sum) || content(entry / "recipe") != recipe ||
      hash(content(library)) != sum)
    return {};
  return CLibrary::Made{library, "", seconds, true};
}

// Returns the seconds of the processor.
double compile(const std::map<std::string, std::string>& files, const CCompiler& compiler,
               const fs::path& in, const std::string& library) {
  double seconds = 0;
  // -Ofast at the link would make the whole program that loads the library flush denormal numbers.
  std::vector<std::string> link = compiler.command;
  link.insert(link.end(), {"-shared", "-o", library});
  for (const auto& [name, text] : files) write(in / name, text);
  for (const auto& [name, text] : files) {
    if (name.ends_with(".h")) continue;
    const std::string source = in / name, object = source + ".o";
    std::vector<std::string> command = compiler.command;
    command.insert(command.end(), compiler.flags.begin(), compiler.flags.end());
    command.insert(command.end(), {"-x", "c", "-fPIC", "-c", source, "-o", object});
    seconds += run_command(command, compiler.limit).seconds;
    link.push_back(object);
  }
  link.push_back("-lm");
  return seconds + run_command(link, compiler.limit).seconds;
}

// Nobody else's. Throws where it was not written.
void make_own(const fs::path& path) {
  if (chmod(path.c_str(), S_IRWXU) != 0)
    throw std::runtime_error("the compiler has not written " + path.filename().string());
}

// Into the entry, in one step.
CLibrary::Made make(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                    const std::string& recipe, const fs::path& entry) {
  const TemporaryFolder own(entry.parent_path());
  const fs::path made = own.path / "made";
  const std::string library = library_in(made);
  fs::create_directory(made);
  const double seconds = compile(files, compiler, own.path, library);
  make_own(made);
  make_own(library);
  write(made / "recipe", recipe);
  write(made / "made", std::to_string(seconds) + ' ' + hash(content(library)));
  std::error_code failed;
  fs::rename(made, entry, failed);
  if (failed) {  // another process was faster, or what stands there is of no use
    if (const auto found = taken(entry, recipe)) return *found;
    fs::remove_all(entry);
    fs::rename(made, entry);
  }
  return {library_in(entry), "", seconds, false};
}

}  // namespace

CLibrary::CLibrary(const Made& made) : made_(made) {
  void* const handle = dlopen(made_.path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!handle) throw std::runtime_error(std::string("cannot load ") + dlerror());
  handle_ = {handle, dlclose};
}

void* CLibrary::symbol(const std::string& name) const { return dlsym(handle_.get(), name.c_str()); }

CLibrary make_library(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                      const fs::path& folder) {
  const std::string macros = macros_of(compiler), recipe = recipe_of(files, compiler, macros);
  const fs::path entry = folder / hash(recipe);
  const auto found = taken(entry, recipe);
  CLibrary::Made made = found ? *found : make(files, compiler, recipe, entry);
  made.version = version_in(macros);
  return CLibrary(made);
}

}  // namespace kalmarm

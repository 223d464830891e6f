#include "benchmarks/peers/c_library.hpp"

#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <stdexcept>

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// A folder of its own for one process, which goes with all that is in it.
struct TemporaryFolder {
  fs::path path;

  explicit TemporaryFolder(const fs::path& in) {
    fs::create_directories(in);
    std::string name = in / "making-XXXXXX";
    if (!mkdtemp(name.data())) throw std::runtime_error("cannot make a folder in " + in.string());
    path = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

// Returns the processor's seconds.
double run(std::vector<std::string> command) {
  std::vector<char*> arguments;
  for (std::string& argument : command) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  int status = 0;
  rusage used = {};
  if (posix_spawn(&child, arguments[0], nullptr, nullptr, arguments.data(), environ) != 0 ||
      wait4(child, &status, 0, &used) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(command[0] + " failed");
  const auto seconds = [](const timeval& time) { return time.tv_sec + 1e-6 * time.tv_usec; };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream out(path);
  if (!(out << text).flush()) throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

CLibrary make_library(const std::map<std::string, std::string>& files, const CCompiler& compiler,
                      const fs::path& folder) {
  std::string recipe = compiler.path + '\n' + compiler.version + '\n';
  for (const std::string& flag : compiler.flags) recipe += flag + '\n';
  for (const auto& [name, text] : files) recipe += name + '\n' + text;
  const std::string key = std::to_string(std::hash<std::string>()(recipe));
  const fs::path library = folder / (key + ".so"), time = folder / (key + ".seconds");
  double seconds = 0;
  if (fs::exists(library) && std::ifstream(time) >> seconds) return {library, seconds};
  seconds = 0;

  const TemporaryFolder own(folder);
  // -Ofast at the link would make the whole program that loads the library flush denormal numbers.
  std::vector<std::string> link = {compiler.path, "-shared", "-o", own.path / "library"};
  for (const auto& [name, text] : files) write(own.path / name, text);
  for (const auto& [name, text] : files) {
    if (name.ends_with(".h")) continue;
    const fs::path source = own.path / name;
    const std::string object = source.string() + ".o";
    std::vector<std::string> command = {compiler.path, "-x",   "c",  "-fPIC",
                                        "-c",          source, "-o", object};
    command.insert(command.end(), compiler.flags.begin(), compiler.flags.end());
    seconds += run(command);
    link.push_back(object);
  }
  seconds += run(link);
  write(own.path / "seconds", std::to_string(seconds));
  fs::rename(own.path / "seconds", time);
  fs::rename(own.path / "library", library);  // the last: where it stands, all is there
  return {library, seconds};
}

}  // namespace kalmarm

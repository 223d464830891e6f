#include "algorithms/generate/compiled_task.hpp"

#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sstream>
#include <stdexcept>

#include "algorithms/generate/package.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// Of a variable that is set; nothing to a program that runs with another user's rights.
std::string environment(const char* name) {
  const char* const value = secure_getenv(name);
  return value ? value : "";
}

// Where a program stands; empty: nowhere.
std::string found(const std::string& program) {
  const auto runs = [](const fs::path& path) {
    return fs::is_regular_file(path) && access(path.c_str(), X_OK) == 0;
  };
  if (program.find('/') != std::string::npos) return runs(program) ? program : "";
  std::istringstream folders(environment("PATH"));
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path path = fs::path(folder) / program; !folder.empty() && runs(path))
      return path;
  return "";
}

std::vector<std::string> words(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

std::vector<std::string> command_of(const CodeOptions& options) {
  std::vector<std::string> given =
      options.compiler.empty() ? words(environment("CC")) : options.compiler;
  if (given.empty()) {
    for (const char* const name : {"cc", "clang", "gcc"})
      if (const std::string path = found(name); !path.empty()) return {path};
    throw std::runtime_error("no C compiler: neither $CC nor cc, clang or gcc");
  }
  const std::string path = found(given[0]);
  if (path.empty()) throw std::runtime_error("no C compiler: " + given[0] + " is not there");
  given[0] = path;
  return given;
}

// Others may read kalmarm/, where programs keep truth: code stands in a folder of its own there.
fs::path cache_of(const CodeOptions& options) {
  if (!options.folder.empty()) return options.folder;
  if (const fs::path own = environment("KALMARM_CACHE"); !own.empty()) return own / "code";
  if (const fs::path all = environment("XDG_CACHE_HOME"); all.is_absolute())
    return all / "kalmarm" / "code";
  if (const fs::path home = environment("HOME"); home.is_absolute())
    return home / ".cache" / "kalmarm" / "code";
  throw std::runtime_error(
      "no folder for compiled code: none of KALMARM_CACHE, XDG_CACHE_HOME and HOME is set");
}

template <class T>
bool is_faster_of_one_state(const Package<T>& package) {
  const TaskRecord& record = package.records()[0];
  return record.graph.count(record.results).flops() <= most_operations_of_one_state(record.task);
}

template <class T>
CLibrary made(const Package<T>& package, bool one_state, bool rows, const CCompiler& compiler,
              const fs::path& folder) {
  if (!one_state && !rows) throw std::runtime_error("of one state they are faster");
  std::map<std::string, std::string> files = package.files({});
  for (const char* const unused : {"robot.md", "robot_test.c"}) files.erase(unused);
  if (!one_state) files.erase("robot.c");
  return make_library(files, compiler, folder);
}

}  // namespace

template <class T>
CompiledTask<T>::CompiledTask(const CodeFor& of, const Model<double>& model,
                              const std::vector<Frame>& loaded, double tolerance, bool one_state,
                              bool rows, const CCompiler& compiler, const fs::path& folder)
    : CompiledTask(of,
                   Package<T>(model, std::vector<double>(model.nq(), 0.0),
                              {"robot", {of.task}, rows, tolerance, {.loaded = loaded}}),
                   one_state && of.of_one_state, rows, compiler, folder) {
  loaded_ = !loaded.empty();
}

template <class T>
CompiledTask<T>::CompiledTask(const CodeFor& of, const Package<T>& package, bool one_state,
                              bool rows, const CCompiler& compiler, const fs::path& folder)
    : of_(of),
      loaded_(false),
      library_(
          made(package, one_state && is_faster_of_one_state(package), rows, compiler, folder)) {
  const std::string name = "robot_" + to_string(of.task);
  const bool has_state = one_state && is_faster_of_one_state(package);
  if (has_state) one_ = library_.function<void()>(name);
  if (rows) rows_ = library_.function<void()>(name + "_rows");
  if (has_state != has_one() || rows != has_rows())
    throw std::runtime_error(library_.made().path.string() + " has not all functions");
}

// For this processor, or for what the library's own kernels are held to.
CCompiler compiler_of(const CodeOptions& options) {
  const bool is_held = !environment("KALMARM_INSTRUCTION_SET").empty();
  const std::string set = is_held ? instruction_set() : "native";
  return {command_of(options),
          {"-O3", "-march=" + set, "-ffp-contract=fast", "-fno-math-errno"},
          options.limit};
}

fs::path folder_of(const CodeOptions& options) {
  const fs::path given = cache_of(options);
  std::error_code failed;
  fs::create_directories(given.parent_path(), failed);
  mkdir(given.c_str(), S_IRWXU);
  const fs::path folder = fs::canonical(given, failed);
  if (failed) throw std::runtime_error("cannot make " + given.string());
  struct stat is = {};
  if (stat(folder.c_str(), &is) != 0 || !S_ISDIR(is.st_mode) || is.st_uid != geteuid() ||
      (is.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw std::runtime_error(folder.string() + " is no folder of this user alone (mode 0700)");
  return folder;
}

template class CompiledTask<float>;
template class CompiledTask<double>;

}  // namespace kalmarm

// What every program shares: its command line, its progress line, and how it ends.
#pragma once

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "robots/input_error.hpp"

extern "C" char* openblas_get_corename() __attribute__((weak));  // null where it is not linked

namespace kalmarm {

inline constexpr const char* scene_help =
    "MJCF or URDF file, shipped robot or scene (robots/), or family:N (straight, chain, tree, "
    "planar)";

// OpenBLAS 0.3.21 does not know processors from 2022 on and falls back to its SSE3 kernels
// ("Prescott"), which are 1.8 times slower at n = 500 and crash in strsm at n = 255. Where it did
// so on a machine with AVX2, and the user has not chosen, starts this program again with
// OPENBLAS_CORETYPE=Haswell; the library reads it only when it is loaded. Call it first in main.
inline void choose_openblas_kernels([[maybe_unused]] char** argv) {
#ifdef __x86_64__
  if (!openblas_get_corename || std::string(openblas_get_corename()) != "Prescott" ||
      !__builtin_cpu_supports("avx2") || std::getenv("OPENBLAS_CORETYPE"))
    return;
  setenv("OPENBLAS_CORETYPE", "Haswell", 1);
  execv("/proc/self/exe", argv);  // returns only where it fails: then the slow kernels it is
#endif
}

// Parses the command line and runs the program: 0 or what `run` returns; 2 and one line on bad
// input.
template <class Run>
int run_program(CLI::App& app, int argc, char** argv, Run&& run) {
  choose_openblas_kernels(argv);
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), e.what());
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), e.what());
  }
  return 2;
}

// One line on a terminal, overwritten in place: what is running, how far, how long is left. Silent
// elsewhere.
class Progress {
 public:
  explicit Progress(int steps) : steps_(steps), shown_(isatty(STDERR_FILENO)) {}
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress() {
    if (shown_) std::fprintf(stderr, "\r\033[K");
  }

  void step(const std::string& what) {
    if (!shown_) return;
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    const double left = done_ > 0 ? elapsed.count() * (steps_ - done_) / done_ : 0;
    std::fprintf(stderr, "\r\033[K%3d %%  %s, about %.0f s left", 100 * done_ / steps_,
                 what.c_str(), left);
    ++done_;
  }

 private:
  int steps_, done_ = 0;
  bool shown_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

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

}  // namespace kalmarm

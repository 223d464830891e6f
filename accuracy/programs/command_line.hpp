// What every program shares: its command line, and how it ends.
#pragma once

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "robots/input_error.hpp"

extern "C" char* openblas_get_corename() __attribute__((weak));  // null where it is not linked

namespace kalmarm {

inline constexpr const char* scene_help =
    "MJCF or URDF file, shipped robot or scene (robots/), or family:N (straight, chain, tree, "
    "planar)";

// What --json says in every program, after what the JSON holds.
inline constexpr const char* json_help = "file to write as JSON; - is standard output";

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

namespace detail {
inline std::vector<std::string> notes;
}

// A line for standard error, once, when the program has succeeded: one that fails says its error
// alone.
inline void add_note(const std::string& note) {
  std::vector<std::string>& notes = detail::notes;
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
}

// Parses the command line and runs the program: 0 or what `run` returns; 2 and one line on bad
// input.
template <class Run>
int run_program(CLI::App& app, int argc, char** argv, Run&& run) {
  choose_openblas_kernels(argv);
  try {
    app.parse(argc, argv);
    const int code = run();
    for (const std::string& note : detail::notes)
      std::fprintf(stderr, "%s: note: %s\n", app.get_name().c_str(), note.c_str());
    return code;
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), e.what());
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s: error: %s\n", app.get_name().c_str(), e.what());
  }
  return 2;
}

}  // namespace kalmarm

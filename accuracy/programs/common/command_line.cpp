#include "accuracy/programs/common/command_line.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <stdexcept>
#include <vector>

#include "accuracy/programs/common/output_file.hpp"
#include "robots/loader/input_error.hpp"

extern "C" char* openblas_get_corename() __attribute__((weak));  // null where it is not linked

namespace kalmarm {
namespace {

// Options and arguments whose files a program reads; open_scene() adds those of scenes.
constexpr const char* read_by_programs[] = {"--states", "--data", "--armature", "FILE"};

std::string program;  // its name
std::vector<std::string> notes;

// Of options that take one word, A,B, and may be repeated, CLI11's help says "...", as of those that
// take several.
class Help : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string out = CLI::Formatter::make_option_opts(option);
    const std::size_t several = out.find(" ...");
    if (option->get_delimiter() == ',' && several != std::string::npos)
      out.replace(several, 4, "[,...]");
    return out;
  }
};

int fail() {
  std::fprintf(stderr, "%s: error: %s\n", program.c_str(), handled_error().c_str());
  return 2;
}

// Of a thread, or where nothing may be thrown.
[[noreturn]] void end() {
  if (std::current_exception()) _exit(fail());
  std::fprintf(stderr, "%s: error: ended by std::terminate\n", program.c_str());
  _exit(2);
}

// OpenBLAS 0.3.21 does not know processors from 2022 on and falls back to its SSE3 kernels
// ("Prescott"), which are 1.8 times slower at n = 500 and crash in strsm at n = 255. Where it did
// so on a machine with AVX2, and the user has not chosen, starts this program again with
// OPENBLAS_CORETYPE=Haswell; the library reads it only when it is loaded.
void choose_openblas_kernels([[maybe_unused]] char** argv) {
#ifdef __x86_64__
  if (!openblas_get_corename || std::string(openblas_get_corename()) != "Prescott" ||
      !__builtin_cpu_supports("avx2") || std::getenv("OPENBLAS_CORETYPE"))
    return;
  setenv("OPENBLAS_CORETYPE", "Haswell", 1);
  execv("/proc/self/exe", argv);  // returns only where it fails: then the slow kernels it is
#endif
}

// A stream that was closed before the program began would be the first file that it opens. In its
// place stands what can neither be read nor written.
void fill_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0 &&
        open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY) != stream)
      _exit(2);
}

void add_inputs(const CLI::App& app) {
  for (const char* name : read_by_programs)
    if (const CLI::Option* option = app.get_option_no_throw(name))
      for (const std::string& path : option->results()) add_input(path);
}

}  // namespace

void start_program(char** argv) {
  choose_openblas_kernels(argv);
  fill_closed_streams();
}

std::string handled_error() {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    return "out of memory";
  } catch (const std::length_error&) {
    return "more is asked for than memory can hold";
  } catch (const std::exception& e) {
    return one_line(e.what());
  } catch (...) {
    return "unknown error";
  }
}

void add_note(const std::string& note) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
}

void flush_standard_output() {
  std::cout.flush();
  if (std::fflush(stdout) != 0 || std::ferror(stdout) || !std::cout)
    throw InputError("standard output cannot be written");
}

int run_program(CLI::App& app, int argc, char** argv, const std::function<int()>& run) {
  start_program(argv);
  program = app.get_name();
  app.formatter(std::make_shared<Help>());
  std::set_terminate(end);
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond its allowed size is an error of the write
  try {
    int code = 0;
    try {
      app.parse(argc, argv);
      add_inputs(app);
      code = run();
    } catch (const CLI::Success& help) {
      code = app.exit(help);
    }
    flush_standard_output();
    for (const std::string& note : notes)
      std::fprintf(stderr, "%s: note: %s\n", program.c_str(), note.c_str());
    return code;
  } catch (...) {
    return fail();
  }
}

}  // namespace kalmarm

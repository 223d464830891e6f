// kalmarm_command NAME ARGUMENT…: runs the program NAME, of those that scripts/cmake/KalmarmCommand.cmake
// lists. Without arguments it prints their names.
#include <cstdio>
#include <cstring>

#define KALMARM_PROGRAM(name) extern "C" int name##_main(int argc, char** argv);
KALMARM_PROGRAMS
#undef KALMARM_PROGRAM

namespace {

struct Program {
  const char* name;
  int (*main)(int argc, char** argv);
};

#define KALMARM_PROGRAM(name) {#name, name##_main},
constexpr Program programs[] = {KALMARM_PROGRAMS};
#undef KALMARM_PROGRAM

}  // namespace

int main(int argc, char** argv) {
  for (const Program& program : programs) {
    if (argc < 2)
      std::puts(program.name);
    else if (std::strcmp(program.name, argv[1]) == 0)
      return program.main(argc - 1, argv + 1);
  }
  if (argc < 2) return 0;
  std::fprintf(stderr, "kalmarm_command: error: no program %s\n", argv[1]);
  return 2;
}

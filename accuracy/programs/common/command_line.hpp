// What every program shares: its command line, and how it ends.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "robots/loader/input_error.hpp"

namespace kalmarm {

inline constexpr const char* scene_help =
    "MJCF or URDF file, shipped robot or scene (robots/), or family:N (straight, chain, tree, "
    "planar)";

// What --json says in every program, after what the JSON holds.
inline constexpr const char* json_help = "file to write as JSON; - is standard output";

// Chooses OpenBLAS's kernels (command_line.cpp), and puts something in the place of standard streams
// that are closed. run_program() does it; call it first in a main() that does anything before.
void start_program(char** argv);

// A line for standard error, once, when the program has succeeded: one that fails says its error
// alone.
void add_note(const std::string& note);

// What the exception that is being handled says, in a line.
std::string handled_error();

// Throws InputError where what has been printed did not arrive, on a full disk for example.
void flush_standard_output();

// Parses the command line and runs the program: 0 or what `run` returns; 2 and one line where
// anything is thrown, in a thread too, or where standard output cannot be written.
int run_program(CLI::App& app, int argc, char** argv, const std::function<int()>& run);

}  // namespace kalmarm

// How a robot's file is read, as users say it on a command line.
#pragma once

#include <map>
#include <string>

#include "kalmarm/load.hpp"

namespace CLI {
class App;
}

namespace kalmarm {

// Adds what LoadOptions has to the command line.
void add_file_options(CLI::App& app, LoadOptions& read);

// The file of --armature or --controls: a JSON object of names and numbers. Throws InputError.
std::map<std::string, double> read_numbers(const std::string& path);

// The options as C++ has them, "{.floating = \"\"}"; empty where all are as the file has it.
std::string initializer_of(const LoadOptions& read);

}  // namespace kalmarm

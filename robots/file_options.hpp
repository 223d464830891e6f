// How a robot's file is read, as users say it on a command line.
#pragma once

#include <string>

#include "kalmarm/load.hpp"

namespace CLI {
class App;
}

namespace kalmarm {

// Adds what LoadOptions has to the command line.
void add_file_options(CLI::App& app, LoadOptions& read);

// The options as C++ has them, "{.floating = \"\"}"; empty where all are as the file has it.
std::string initializer_of(const LoadOptions& read);

}  // namespace kalmarm

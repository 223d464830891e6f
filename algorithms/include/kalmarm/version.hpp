// The version of the library; CMakeLists.txt reads it from here.
#pragma once

#define KALMARM_VERSION_MAJOR 0
#define KALMARM_VERSION_MINOR 2
#define KALMARM_VERSION_PATCH 0
#define KALMARM_VERSION "0.2.0"

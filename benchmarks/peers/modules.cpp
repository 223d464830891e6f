#include "benchmarks/peers/modules.hpp"

#include <dlfcn.h>

#include <sstream>
#include <string>

#include "robots/loader/input_error.hpp"

namespace kalmarm {

std::vector<Module> load_modules() {
  std::vector<Module> out{kalmarm_peers};  // our own: peers/fast.cpp
  std::istringstream paths(KALMARM_PEER_MODULES);
  for (std::string path; std::getline(paths, path, ':');) {
    void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
    void* entry = module ? dlsym(module, "kalmarm_peers") : nullptr;
    if (!entry) throw InputError(dlerror());
    out.push_back(reinterpret_cast<Module>(entry));
  }
  return out;
}

}  // namespace kalmarm

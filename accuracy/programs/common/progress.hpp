// How far a program is.
#pragma once

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <string>

namespace kalmarm {

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

}  // namespace kalmarm

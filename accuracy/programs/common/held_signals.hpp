// Signals that wait until something is done that must not be left half done.
#pragma once

#include <array>
#include <csignal>

namespace kalmarm {

// While one lives, SIGINT, SIGTERM and SIGHUP do not end the program; the last of them does when it
// is destroyed.
class HeldSignals {
 public:
  HeldSignals() {
    struct sigaction note {};
    note.sa_handler = [](int signal) { caught = signal; };
    for (std::size_t i = 0; i < held.size(); ++i) {
      sigaction(held[i], nullptr, &before_[i]);
      if (before_[i].sa_handler != SIG_IGN) sigaction(held[i], &note, nullptr);
    }
  }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;
  ~HeldSignals() {
    release();
    const int signal = caught;
    caught = 0;
    if (signal != 0) std::raise(signal);
  }

  // The signal that waits; 0: none.
  int waiting() const { return caught; }

  // As it was before: for a child process, which the signals may end.
  void release() {
    for (std::size_t i = 0; i < held.size(); ++i) sigaction(held[i], &before_[i], nullptr);
  }

 private:
  static constexpr std::array<int, 3> held{SIGINT, SIGTERM, SIGHUP};
  static inline volatile std::sig_atomic_t caught = 0;
  std::array<struct sigaction, held.size()> before_;
};

}  // namespace kalmarm

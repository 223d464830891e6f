#include "algorithms/generate/run_command.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace kalmarm {
namespace {

using Clock = std::chrono::steady_clock;

// The read end of a pipe, and the write end while a child is started.
class Pipe {
 public:
  Pipe() {
    if (pipe2(ends_, O_CLOEXEC) != 0)
      throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  }
  Pipe(const Pipe&) = delete;
  ~Pipe() {
    close(ends_[0]);
    close_write();
  }
  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void close_write() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  int ends_[2];
};

// Of a group of its own, whose output goes to the pipe.
pid_t start(const std::vector<std::string>& command, Pipe& pipe) {
  std::vector<std::string> copy = command;
  std::vector<char*> arguments;
  arguments.reserve(copy.size() + 1);
  for (std::string& argument : copy) arguments.push_back(argument.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  for (const int out : {1, 2}) posix_spawn_file_actions_adddup2(&files, pipe.write_end(), out);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  pid_t child = 0;
  const int error =
      posix_spawnp(&child, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  pipe.close_write();
  if (error) throw std::runtime_error("cannot run " + command[0] + ": " + std::strerror(error));
  return child;
}

// Adds what can be read; whether more may follow.
bool read_some(int from, std::string& to) {
  char buffer[4096];
  const ssize_t count = read(from, buffer, sizeof buffer);
  if (count > 0) to.append(buffer, static_cast<std::size_t>(count));
  return count > 0 || (count < 0 && errno == EINTR);
}

// The line that says what is wrong, without what a terminal would take for a command.
std::string first_error(const std::string& output) {
  std::istringstream lines(output);
  std::string first;
  for (std::string line; std::getline(lines, line);) {
    const bool is_error = line.find("error") != std::string::npos;
    if (first.empty() || is_error) first = line;
    if (is_error) break;
  }
  std::erase_if(first, [](unsigned char c) { return c < ' ' || c == 127; });
  return first.substr(0, 200);
}

}  // namespace

CommandResult run_command(const std::vector<std::string>& command, double limit) {
  const auto end = Clock::now() + std::chrono::duration<double>(limit);
  CommandResult out;
  Pipe pipe;
  const pid_t child = start(command, pipe);
  rusage used = {};
  int status = 0;
  pid_t ended = 0;
  for (bool is_open = true; ended == 0;) {
    const std::chrono::duration<double, std::milli> left = end - Clock::now();
    if (left.count() <= 0) {
      kill(-child, SIGKILL);
      while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
      }
      std::ostringstream text;
      text << command[0] << " took longer than " << limit << " s";
      throw std::runtime_error(text.str());
    }
    pollfd ready = {pipe.read_end(), POLLIN, 0};
    if (is_open && poll(&ready, 1, static_cast<int>(std::min(left.count() + 1, 20.0))) > 0) {
      is_open = read_some(pipe.read_end(), out.output);
      if (is_open) continue;
    }
    ended = wait4(child, &status, WNOHANG, &used);
    if (ended == 0 && !is_open) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (ended < 0)
    throw std::runtime_error(command[0] + " cannot be waited for: " + std::strerror(errno));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    const std::string error = first_error(out.output);
    throw std::runtime_error(command[0] + " failed" + (error.empty() ? "" : ": " + error));
  }
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  out.seconds = seconds(used.ru_utime) + seconds(used.ru_stime);
  return out;
}

}  // namespace kalmarm

#include "accuracy/programs/common/output_file.hpp"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/vfs.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <random>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "accuracy/programs/common/digest.hpp"
#include "accuracy/programs/common/held_signals.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

using Inode = std::pair<dev_t, ino_t>;

std::set<Inode> inputs;
std::vector<std::weak_ptr<const Inode>> outputs;

Inode inode(const struct stat& it) { return {it.st_dev, it.st_ino}; }

bool on_proc(const fs::path& folder) {
  struct statfs it;
  return statfs(folder.c_str(), &it) == 0 && it.f_type == PROC_SUPER_MAGIC;
}

struct Resolved {
  fs::path path;
  bool is_descriptor = false;  // such as /dev/fd/3: of a process, whatever it is open on
};

// Where links lead, also where there is nothing yet. Loops have been refused by stat().
Resolved resolved(fs::path path) {
  constexpr int most_links = 40;  // Linux's own limit
  for (int links = 0; links < most_links; ++links) {
    std::error_code error;
    const fs::path next = fs::read_symlink(path, error);
    if (error) break;
    if (on_proc(path.parent_path())) return {path, true};
    path = path.parent_path() / next;
  }
  return {path};
}

// A name that nobody has, short enough wherever names of its folder's files are.
std::string temporary_name() {
  std::random_device random;
  char text[40];
  std::snprintf(text, sizeof text, ".kalmarm-%08x%08x", random(), random());
  return text;
}

// A lock on a name in a folder, as a Unix socket of an abstract name. The kernel removes it with
// its process, however that ends, and nothing of it stands in the folder. Where there are no such
// sockets, or the other process is on another machine, nothing is locked; files are still whole.
// False where another has the lock.
bool lock(const Descriptor& folder, const std::string& name, Descriptor& lock) {
  struct stat it;
  if (fstat(folder.number(), &it) != 0) return true;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string text =
      "kalmarm " +
      hex(digest_of(std::to_string(it.st_dev) + ' ' + std::to_string(it.st_ino) + ' ' + name));
  text.copy(address.sun_path + 1, sizeof address.sun_path - 1);  // after a 0: abstract
  Descriptor own(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + text.size());
  if (own && bind(own.number(), reinterpret_cast<const sockaddr*>(&address), length) != 0 &&
      errno == EADDRINUSE)
    return false;
  lock = std::move(own);
  return true;
}

Descriptor create(const Descriptor& folder, const std::string& name, mode_t mode) {
  return Descriptor(
      openat(folder.number(), name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
}

// False, with errno; a file system that cannot flush has nothing to lose.
bool flush(const Descriptor& file) {
  return fsync(file.number()) == 0 || errno == EINVAL || errno == EROFS || errno == ENOSYS;
}

InputError would_be_overwritten(const std::string& path) {
  return InputError(path + ": is read by this program, and would be overwritten by it");
}

}  // namespace

void add_input(const std::string& path) {
  struct stat it;
  if (stat(path.c_str(), &it) != 0 || !S_ISREG(it.st_mode)) return;
  for (const std::weak_ptr<const Inode>& output : outputs)
    if (const auto replaced = output.lock(); replaced && *replaced == inode(it))
      throw would_be_overwritten(path);
  inputs.insert(inode(it));
}

OutputFile OutputFile::standard_output() {
  OutputFile out;
  out.kind_ = Kind::standard_output;
  out.path_ = "standard output";
  return out;
}

OutputFile::OutputFile(const std::string& path) : path_(path) {
  if (path.empty()) return;
  struct stat it, standard;
  const bool exists = stat(path.c_str(), &it) == 0;
  if (!exists && errno != ENOENT) fail(errno);
  if (exists && S_ISDIR(it.st_mode)) fail(EISDIR);
  if (exists && S_ISBLK(it.st_mode)) throw InputError(path + ": is a disk");
  if (exists && S_ISREG(it.st_mode)) {
    if (inputs.contains(inode(it))) throw would_be_overwritten(path);
    const auto replaced = std::make_shared<const Inode>(inode(it));
    outputs.push_back(replaced);
    replaces_ = replaced;
  }
  if (exists && fstat(STDOUT_FILENO, &standard) == 0 && inode(it) == inode(standard))
    kind_ = Kind::standard_output;  // after what is printed there, not over it
  else if (exists && (!S_ISREG(it.st_mode) || resolved(path).is_descriptor))
    open_stream(S_ISFIFO(it.st_mode));
  else
    open_file(exists);
}

void OutputFile::open_stream(bool is_pipe) {
  kind_ = Kind::stream;
  // A pipe that nobody reads would hold the program for ever: its reader has five seconds to come.
  constexpr int tries = 250;
  constexpr useconds_t pause = 20000;
  const int flags = O_WRONLY | O_APPEND | O_NOCTTY | O_CLOEXEC;
  for (int i = 0; !stream_; ++i) {
    stream_ = Descriptor(open(path_.c_str(), flags | (is_pipe ? O_NONBLOCK : 0)));
    if (!stream_ && (errno != ENXIO || !is_pipe)) fail(errno);
    if (stream_) break;
    if (i == tries) throw InputError(path_ + ": nobody reads this pipe");
    usleep(pause);
  }
  if (is_pipe) fcntl(stream_.number(), F_SETFL, flags & O_APPEND);
}

void OutputFile::open_file(bool exists) {
  kind_ = Kind::file;
  const fs::path target = resolved(path_).path;
  name_ = target.filename();
  if (name_.empty() || name_ == "." || name_ == "..") fail(EISDIR);
  const fs::path folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  folder_ = Descriptor(open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!folder_) fail(errno);
  // Its permissions count, although a file can be replaced without them.
  if (exists &&
      !Descriptor(openat(folder_.number(), name_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC)))
    fail(errno);
  const std::string temporary = temporary_name();
  if (!create(folder_, temporary, 0600)) fail(errno);
  unlinkat(folder_.number(), temporary.c_str(), 0);
  if (!lock(folder_, name_, lock_))
    throw InputError(path_ + ": is being written already, by this program or by another");
}

void OutputFile::write(const std::string& text) {
  switch (kind_) {
    case Kind::none:
      return;
    case Kind::standard_output:
      if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() ||
          std::fflush(stdout) != 0)
        fail(errno);
      return;
    case Kind::stream: {
      // A pipe's reader that has gone is an error like others, and not the end of the program.
      const auto before = std::signal(SIGPIPE, SIG_IGN);
      const bool written = write_all(stream_, text);
      const int error = errno;
      std::signal(SIGPIPE, before);
      if (!written) fail(error);
      return;
    }
    case Kind::file:
      return replace(text);
  }
}

void OutputFile::replace(const std::string& text) {
  const HeldSignals held;  // or the temporary file would be left
  struct stat before;
  const bool exists = fstatat(folder_.number(), name_.c_str(), &before, AT_SYMLINK_NOFOLLOW) == 0;
  if (exists && !S_ISREG(before.st_mode)) fail(EEXIST);
  constexpr mode_t permissions = 07777, of_new_files = 0666;
  const std::string temporary = temporary_name();
  Descriptor file =
      create(folder_, temporary, exists ? before.st_mode & permissions : of_new_files);
  if (!file) fail(errno);
  if (exists) {
    // Another's file stays another's where we may give files away; else it becomes ours.
    [[maybe_unused]] const int given = fchown(file.number(), before.st_uid, before.st_gid);
    fchmod(file.number(), before.st_mode & permissions);
  }
  if (!write_all(file, text) || !flush(file) || !file.close() ||
      renameat(folder_.number(), temporary.c_str(), folder_.number(), name_.c_str()) != 0) {
    const int error = errno;
    unlinkat(folder_.number(), temporary.c_str(), 0);
    fail(error);
  }
  replaces_.reset();
}

void OutputFile::fail(int error) const {
  throw InputError(path_ + ": cannot be written: " + std::generic_category().message(error));
}

}  // namespace kalmarm

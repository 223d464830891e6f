#include "robots/loader/files/text_file.hpp"

#include <linux/magic.h>
#include <sys/vfs.h>

#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <system_error>

#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t largest = std::size_t{1} << 30;  // of a text, in bytes

[[noreturn]] void refuse(const std::string& path, std::string why) {
  why[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(why[0])));
  throw InputError((path.empty() ? "''" : path) + ": " + why);
}

std::string read_open(const std::string& path) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"),
                                                             std::fclose);
  if (!file) refuse(path, std::strerror(errno));
  std::string out;
  char block[1 << 16];
  while (const std::size_t count = std::fread(block, 1, sizeof block, file.get())) {
    out.append(block, count);
    if (out.size() > largest) refuse(path, "larger than 1 GiB");
  }
  if (std::ferror(file.get())) refuse(path, std::strerror(errno));
  return out;
}

// What the kernel shows as files is regular by its type, and may never end: /proc/kmsg waits for what is
// yet to happen.
bool is_of_kernel(const fs::path& path) {
  struct statfs system = {};
  if (statfs(path.c_str(), &system) != 0) return false;
  for (const unsigned long magic :
       {PROC_SUPER_MAGIC, SYSFS_MAGIC, DEBUGFS_MAGIC, TRACEFS_MAGIC, CGROUP2_SUPER_MAGIC})
    if (static_cast<unsigned long>(system.f_type) == magic) return true;
  return false;
}

fs::file_type type_of(const fs::path& path, std::error_code& error) {
  const fs::file_type type = fs::status(path, error).type();
  return type == fs::file_type::regular && is_of_kernel(path) ? fs::file_type::character : type;
}
fs::file_type type_of(const fs::path& path) {
  std::error_code error;
  return type_of(path, error);
}

}  // namespace

std::string read_text(const std::string& path) {
  std::error_code error;
  const fs::file_type type = type_of(path, error);
  if (type == fs::file_type::not_found) refuse(path, "no such file");
  if (type == fs::file_type::none || type == fs::file_type::unknown) refuse(path, error.message());
  if (type == fs::file_type::directory) refuse(path, "is a folder, not a file");
  if (type != fs::file_type::regular) refuse(path, "is a pipe, socket or device, not a file");
  return read_open(path);
}

std::string read_text_or_stream(const std::string& path) {
  const bool stream = path == "/dev/stdin" || path.starts_with("/dev/fd/");
  return stream ? read_open(path) : read_text(path);
}

bool is_file(const fs::path& path) { return type_of(path) == fs::file_type::regular; }
bool is_folder(const fs::path& path) { return type_of(path) == fs::file_type::directory; }
bool is_there(const fs::path& path) { return type_of(path) != fs::file_type::not_found; }

}  // namespace kalmarm

#include "robots/loader/files/text_file.hpp"

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

fs::file_type type_of(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error).type();
}

}  // namespace

std::string read_text(const std::string& path) {
  std::error_code error;
  const fs::file_type type = fs::status(path, error).type();
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

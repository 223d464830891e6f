// A file that lives as long as its object.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace kalmarm {

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text, const std::string& ending)
      : path_(std::filesystem::temp_directory_path() /
              ("kalmarm-" + std::to_string(getpid()) + "-" + std::to_string(++count_) + ending)) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }

  std::string path() const { return path_.string(); }

 private:
  static inline int count_ = 0;
  std::filesystem::path path_;
};

}  // namespace kalmarm

// Files that programs write.
//
// A file appears as a whole or not at all: it is written under a name that nobody else has, in the
// folder of the file that it replaces, flushed to the disk, and renamed. Links are followed, and
// permissions stay. What is no file, such as a device or a pipe, is written to and never replaced.
//
// Two programs do not write one file at the same time: the second is refused.
#pragma once

#include <memory>
#include <string>

#include "accuracy/programs/common/descriptor.hpp"

namespace kalmarm {

// A file that the program reads. Throws InputError where one of its outputs would replace it, which
// is refused in the other order too. What is no file is passed over.
void add_input(const std::string& path);

class OutputFile {
 public:
  // Writes nothing.
  OutputFile() = default;

  // An empty path writes nothing. Throws InputError where the path cannot be written, before work
  // is spent on what shall stand there. Waits a few seconds for the reader of a named pipe.
  explicit OutputFile(const std::string& path);

  // In place of what is there. Throws InputError.
  void write(const std::string& text);

  // True of a file that can stay, as opposed to a stream.
  bool is_file() const { return kind_ == Kind::file; }

  // For a child process, which must not hold the lock on after its parent has ended.
  void unlock() { lock_.close(); }

  static OutputFile standard_output();

 private:
  enum class Kind { none, standard_output, stream, file };

  void open_stream(bool is_pipe);
  void open_file(bool exists);
  void replace(const std::string& text);
  [[noreturn]] void fail(int error) const;

  Kind kind_ = Kind::none;
  std::string path_;                      // as it was given
  std::shared_ptr<const void> replaces_;  // while it lives, the file that is there is an output
  std::string name_;                      // in its folder
  Descriptor folder_;                     // of a file
  Descriptor stream_, lock_;
};

// What --json names: a file, or "-" for standard output, where a program then prints nothing else.
inline OutputFile json_output(const std::string& path) {
  return path == "-" ? OutputFile::standard_output() : OutputFile(path);
}

}  // namespace kalmarm

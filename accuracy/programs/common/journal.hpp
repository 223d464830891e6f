// Results of the parts of a long run, kept on the disk until the run is whole, so that it can go on
// after an interruption.
//
// A journal is a folder. Each process that works for the run appends to a file KEY-PID of its own,
// where KEY is the digest of what determines the run's results; files of other keys are other
// runs', and stay. A block is
//   #kalmarm-journal-1 KEY PART BYTES DIGEST
// and so many bytes, which with KEY and PART have that digest. What is not whole, or was changed,
// counts as not there.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>

#include "accuracy/programs/common/descriptor.hpp"

namespace kalmarm {

class Journal {
 public:
  struct Found {
    std::map<std::size_t, std::string> parts;  // of this run
    int garbled = 0;                           // blocks of this run that are not whole
    int others = 0;                            // files of other runs
  };

  // Appends to a file of this process.
  class Writer {
   public:
    Writer(const std::filesystem::path& folder, const std::string& key);
    void append(std::size_t part, const std::string& text);  // throws InputError

   private:
    std::filesystem::path path_;
    std::string key_;
    Descriptor file_;
  };

  // `run` is all that determines the results. Throws InputError where the folder holds what no
  // journal has, or is no folder.
  Journal(const std::filesystem::path& folder, const std::string& run);

  Found read() const;
  Writer writer() const { return {folder_, key_}; }

  // This run's files, and the folder where nothing else is in it.
  void remove() const;

 private:
  bool owns(const std::filesystem::path& file) const;

  std::filesystem::path folder_;
  std::string key_;
  bool is_journal_;  // and no empty folder of somebody
};

}  // namespace kalmarm

// A journal: of a file that holds anything, only whole blocks are read, each as it stands there,
// and what is appended to it later is read too.
//
// Digests of mutated blocks are mostly made right again, or no mutated block would pass for whole.
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <regex>

#include "accuracy/programs/common/digest.hpp"
#include "accuracy/programs/common/journal.hpp"
#include "algorithms/test/temporary_folder.hpp"
#include "robots/loader/test/fuzz/reader.hpp"

namespace kalmarm {
namespace {

constexpr const char* run = "run";  // of the seeds

// Each block with the digest of as many bytes as its header says, or of those that are left.
std::string with_right_digests(std::string text) {
  static const std::regex header("#kalmarm-journal-1 ([0-9a-f]{40} [0-9]+ )([0-9]+) .*");
  for (std::size_t end, at = text.find('#'); at != std::string::npos; at = text.find('#', at + 1)) {
    if ((end = text.find('\n', at)) == std::string::npos) break;
    std::smatch match;
    const std::string line = text.substr(at, end - at);
    if (line.size() > 200 || !std::regex_match(line, match, header)) continue;
    const std::string block =
        text.substr(end + 1, std::strtoull(match.str(2).c_str(), nullptr, 10));
    const std::string right = "#kalmarm-journal-1 " + match.str(1) + match.str(2) + ' ' +
                              hex(digest_of(match.str(1) + block));
    text.replace(at, end - at, right);
  }
  return text;
}

}  // namespace
}  // namespace kalmarm

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  size = LLVMFuzzerMutate(data, size, most);
  if (seed % 4 == 0) return size;
  const std::string text =
      kalmarm::with_right_digests(std::string(reinterpret_cast<const char*>(data), size));
  if (text.size() > most) return size;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  static const TemporaryFolder folder;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const std::string key = hex(digest_of(run));
  put(folder / (key + '-' + std::to_string(getpid())), text);  // to which the writer appends
  const Journal journal(folder.path(), run);
  const Journal::Found before = journal.read();
  expect(before.others == 0 && before.garbled >= 0, "other counts");
  std::size_t bytes = 0;
  for (const auto& [part, block] : before.parts) {
    const std::string header = "#kalmarm-journal-1 " + key + ' ' + std::to_string(part) + ' ' +
                               std::to_string(block.size()) + ' ' +
                               hex(digest_of(key + ' ' + std::to_string(part) + ' ' + block)) +
                               '\n';
    expect(text.find(header + block) != std::string::npos, "a block that is not there");
    bytes += header.size() + block.size();
  }
  expect(bytes <= text.size(), "more than is there");
  expect(!text.empty() || before.garbled == 0, "a garbled block of nothing");

  constexpr std::size_t appended = 12345;
  journal.writer().append(appended, "a,1\n");
  Journal::Found after = journal.read();
  expect(after.parts[appended] == "a,1\n", "what was appended is not read");
  for (const auto& [part, block] : before.parts)
    expect(part == appended || after.parts[part] == block, "a block is lost by another");
  return 0;
}

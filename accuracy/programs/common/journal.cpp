#include "accuracy/programs/common/journal.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <regex>
#include <system_error>

#include "accuracy/programs/common/digest.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

constexpr const char* format = "#kalmarm-journal-1";

std::string header(const std::string& key, std::size_t part, const std::string& text) {
  const std::string begin = key + ' ' + std::to_string(part) + ' ';
  return std::string(format) + ' ' + begin + std::to_string(text.size()) + ' ' +
         hex(digest_of(begin + text)) + '\n';
}

// Takes the block at `position`, and sets it behind; false where it is not whole.
bool take(const std::string& bytes, const std::string& key, std::size_t& position,
          std::map<std::size_t, std::string>& parts) {
  const std::size_t end = bytes.find('\n', position);
  if (end == std::string::npos) return false;
  const std::string line = bytes.substr(position, end + 1 - position);
  std::size_t part, size;
  if (std::sscanf(line.c_str(), "%*s %*s %zu %zu", &part, &size) != 2) return false;
  if (size > bytes.size() - (end + 1)) return false;
  std::string text = bytes.substr(end + 1, size);
  if (line != header(key, part, text)) return false;
  parts[part] = std::move(text);
  position = end + 1 + size;
  return true;
}

std::string cannot(const fs::path& path, int error) {
  return path.string() + ": " + std::generic_category().message(error);
}

}  // namespace

Journal::Writer::Writer(const fs::path& folder, const std::string& key)
    : path_(folder / (key + '-' + std::to_string(getpid()))),
      key_(key),
      file_(open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666)) {
  if (!file_) throw InputError(cannot(path_, errno));
}

void Journal::Writer::append(std::size_t part, const std::string& text) {
  if (!write_all(file_, header(key_, part, text) + text)) throw InputError(cannot(path_, errno));
}

Journal::Journal(const fs::path& folder, const std::string& run)
    : folder_(folder), key_(hex(digest_of(run))) {
  std::error_code error;
  is_journal_ = fs::create_directory(folder_, error);
  if (!error && !fs::is_directory(folder_, error))
    error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw InputError(folder_.string() + ": no folder for a journal: " + error.message());
  static const std::regex of_journals("[0-9a-f]{40}-[0-9]+");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    if (!std::regex_match(entry.path().filename().string(), of_journals) ||
        !fs::is_regular_file(entry.symlink_status()))
      throw InputError(folder_.string() + ": is not a journal of this program: it holds '" +
                       entry.path().filename().string() + "'");
    is_journal_ = true;
  }
}

Journal::Found Journal::read() const {
  Found out;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_)) {
    if (!owns(entry)) {
      ++out.others;
      continue;
    }
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes(std::istreambuf_iterator<char>(file), {});
    for (std::size_t position = 0; position < bytes.size();) {
      if (take(bytes, key_, position, out.parts)) continue;
      ++out.garbled;
      position = std::min(bytes.find(format, position + 1), bytes.size());
    }
  }
  return out;
}

void Journal::remove() const {
  std::error_code error;  // what cannot be removed now is another run's at the next
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_))
    if (owns(entry)) fs::remove(entry.path(), error);
  if (is_journal_) fs::remove(folder_, error);  // only where it is empty
}

bool Journal::owns(const fs::path& file) const {
  return file.filename().string().starts_with(key_ + '-');
}

}  // namespace kalmarm

#include "robots/loader/names.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <cctype>
#include <numeric>
#include <utility>

namespace kalmarm {
namespace {

// Letters to insert, delete or replace (Levenshtein), a letter's case for nothing.
int distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    int diagonal = std::exchange(row[0], static_cast<int>(i) + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const bool same = std::tolower(a[i]) == std::tolower(b[j]);
      const int least = std::min({row[j] + 1, row[j + 1] + 1, diagonal + !same});
      diagonal = std::exchange(row[j + 1], least);
    }
  }
  return row.back();
}

}  // namespace

std::string unknown_name(const std::string& kind, const std::string& name,
                         const std::vector<std::string>& known) {
  std::vector<std::string> nearest = known;
  std::stable_sort(nearest.begin(), nearest.end(), [&](const std::string& a, const std::string& b) {
    return distance(name, a) < distance(name, b);
  });
  nearest.erase(std::unique(nearest.begin(), nearest.end()), nearest.end());
  std::string out = kind + " '" + name + "' is unknown";
  for (std::size_t i = 0; i < std::min<std::size_t>(nearest.size(), 3); ++i)
    out += (i == 0 ? "; nearest: " : ", ") + nearest[i];
  return out;
}

std::string counted(int count, const std::string& kind) {
  const std::string number = std::to_string(count) + " ";
  if (count == 1) return number + kind;
  const std::size_t of = std::min({kind.find(" of "), kind.find(" with "), kind.size()});
  std::string noun = kind.substr(0, of);
  if (noun.ends_with("sh") || noun.ends_with("x"))
    noun += "es";
  else if (noun.ends_with("dy") || noun.ends_with("ty"))
    noun.replace(noun.size() - 1, 1, "ies");
  else
    noun += "s";
  return number + noun + kind.substr(of);
}

void Counts::add(const std::string& kind, int count) {
  if (count == 0) return;
  for (auto& [known, sum] : counts_)
    if (known == kind) return void(sum += count);
  counts_.emplace_back(kind, count);
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const auto first = static_cast<unsigned char>(text[0]);
    const std::size_t length = first < 0x80 ? 1 : first < 0xe0 ? 2 : first < 0xf0 ? 3 : 4;
    if ((first >= 0x80 && first < 0xc2) || first > 0xf4 || text.size() < length) return false;
    unsigned code = length == 1 ? first : first & (0x7f >> length);
    for (std::size_t i = 1; i < length; ++i) {
      const auto next = static_cast<unsigned char>(text[i]);
      if ((next & 0xc0) != 0x80) return false;
      code = code << 6 | (next & 0x3f);
    }
    const bool is_longer_than_needed =
        (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
    const bool is_surrogate = code >= 0xd800 && code < 0xe000;
    if (is_longer_than_needed || is_surrogate || code > 0x10ffff) return false;
    text.remove_prefix(length);
  }
  return true;
}

bool matches(const std::string& pattern, const std::string& name) {
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

}  // namespace kalmarm

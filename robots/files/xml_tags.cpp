#include "robots/files/xml_tags.hpp"

#include <algorithm>

namespace kalmarm {
namespace {

constexpr std::string_view blank = " \t\r\n";

class Scanner {
 public:
  explicit Scanner(std::string_view text) : left_(text) {}

  std::vector<XmlTag> tags() {
    std::vector<XmlTag> out;
    while (skip_past("<"))
      if (left_.starts_with("!--"))
        skip_past("-->");
      else if (left_.starts_with("![CDATA["))
        skip_past("]]>");
      else if (!left_.empty() && std::string_view("?!/").find(left_[0]) == std::string_view::npos)
        out.push_back(tag());
    return out;
  }

 private:
  // False at the end of the text.
  bool skip_past(std::string_view what) {
    const std::size_t at = left_.find(what);
    left_.remove_prefix(at == std::string_view::npos ? left_.size() : at + what.size());
    return at != std::string_view::npos;
  }

  std::string_view take(std::size_t length) {
    const std::string_view out = left_.substr(0, length);
    left_.remove_prefix(out.size());
    return out;
  }

  std::string_view word() { return take(left_.find_first_of(" \t\r\n=/>")); }
  void skip_blanks() { take(std::min(left_.find_first_not_of(blank), left_.size())); }

  XmlTag tag() {
    XmlTag out;
    out.name = word();
    for (;;) {
      skip_blanks();
      const std::string key(word());
      skip_blanks();
      if (key.empty() || !left_.starts_with("=")) return out;
      left_.remove_prefix(1);
      skip_blanks();
      if (left_.empty() || (left_[0] != '"' && left_[0] != '\'')) return out;
      const char quote = take(1)[0];
      out.attributes[key] = take(left_.find(quote));
      take(1);
    }
  }

  std::string_view left_;
};

}  // namespace

std::string XmlTag::attribute(const std::string& key) const {
  const auto found = attributes.find(key);
  return found == attributes.end() ? "" : found->second;
}

std::vector<XmlTag> xml_tags(std::string_view text) { return Scanner(text).tags(); }

}  // namespace kalmarm

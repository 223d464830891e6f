#include "robots/loader/files/xml_tags.hpp"

#include <algorithm>

namespace kalmarm {
namespace {

constexpr std::string_view blank = " \t\r\n";

class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text), left_(text) {}

  std::vector<XmlTag> tags() {
    std::vector<XmlTag> out;
    while (skip_past("<"))
      if (left_.starts_with("!--"))
        skip_past("-->");
      else if (left_.starts_with("![CDATA["))
        skip_past("]]>");
      else if (!left_.empty() && left_[0] != '?' && left_[0] != '!')
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

  std::size_t position() const { return text_.size() - left_.size(); }

  // Behind its <.
  XmlTag tag() {
    XmlTag out;
    out.begin = position() - 1;
    if (left_.starts_with("/")) {
      take(1);
      out.kind = XmlTag::Kind::closing;
    }
    out.name = word();
    read_attributes(out);
    if (left_.starts_with("/")) out.kind = XmlTag::Kind::empty;
    skip_past(">");
    out.end = position();
    return out;
  }

  // As far as they are ones.
  void read_attributes(XmlTag& out) {
    for (;;) {
      skip_blanks();
      const std::string key(word());
      skip_blanks();
      if (key.empty() || !left_.starts_with("=")) return;
      left_.remove_prefix(1);
      skip_blanks();
      if (left_.empty() || (left_[0] != '"' && left_[0] != '\'')) return;
      const char quote = take(1)[0];
      out.attributes[key] = take(left_.find(quote));
      take(1);
    }
  }

  std::string_view text_;
  std::string_view left_;
};

}  // namespace

std::string without_elements(std::string text, const std::function<bool(const XmlTag&)>& unwanted) {
  const auto blank = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (text[i] != '\n' && text[i] != '\r') text[i] = ' ';
  };
  const std::vector<XmlTag> tags = all_xml_tags(text);
  const XmlTag* first = nullptr;  // of the element that is being left out
  int depth = 0;                  // of its name within itself
  for (const XmlTag& tag : tags) {
    if (!first) {
      if (tag.kind == XmlTag::Kind::closing || !unwanted(tag)) continue;
      if (tag.kind == XmlTag::Kind::empty)
        blank(tag.begin, tag.end);
      else
        first = &tag, depth = 1;
    } else if (tag.name == first->name) {
      if (tag.kind == XmlTag::Kind::opening) ++depth;
      if (tag.kind != XmlTag::Kind::closing || --depth > 0) continue;
      blank(first->begin, tag.end);
      first = nullptr;
    }
  }
  return text;
}

std::string XmlTag::attribute(const std::string& key) const {
  const auto found = attributes.find(key);
  return found == attributes.end() ? "" : found->second;
}

std::vector<XmlTag> all_xml_tags(std::string_view text) { return Scanner(text).tags(); }

std::vector<XmlTag> xml_tags(std::string_view text) {
  std::vector<XmlTag> out = all_xml_tags(text);
  std::erase_if(out, [](const XmlTag& tag) { return tag.kind == XmlTag::Kind::closing; });
  return out;
}

}  // namespace kalmarm

// The tags of an XML text, for what MuJoCo's reader does not tell of a file.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace kalmarm {

struct XmlTag {
  enum class Kind { opening, closing, empty };  // <a>, </a>, <a/>

  Kind kind = Kind::opening;
  std::string name;
  std::map<std::string, std::string> attributes;  // as written: entities are not replaced
  std::size_t begin = 0, end = 0;                 // in the text: from < to behind >

  // "" where there is none.
  std::string attribute(const std::string& key) const;
};

// In the text's order. Comments, CDATA sections, declarations and processing instructions are
// skipped. Nothing is checked: of a text that is no XML it is any list of tags.
std::vector<XmlTag> all_xml_tags(std::string_view text);

// The same without closing tags: one for each element.
std::vector<XmlTag> xml_tags(std::string_view text);

// The text with blanks where elements stood whose opening tag is unwanted. Lines end where they
// ended, so that what a reader says of a line holds for the original. An element without an end
// stays.
std::string without_elements(std::string text, const std::function<bool(const XmlTag&)>& unwanted);

}  // namespace kalmarm

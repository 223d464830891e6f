// The opening tags of an XML text, for what MuJoCo's reader does not tell of a file.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace kalmarm {

struct XmlTag {
  std::string name;
  std::map<std::string, std::string> attributes;  // as written: entities are not replaced

  // "" where there is none.
  std::string attribute(const std::string& key) const;
};

// In the text's order. Comments, CDATA sections, declarations and processing instructions are
// skipped. Nothing is checked: of a text that is no XML it is any list of tags.
std::vector<XmlTag> xml_tags(std::string_view text);

}  // namespace kalmarm

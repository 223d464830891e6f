#include "robots/loader/files/sizes.hpp"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// Of the numbers in a text, as far as they are some.
double product(const std::string& numbers) {
  double out = 1;
  const char* at = numbers.c_str();
  for (char* end = nullptr;; at = end) {
    const double number = std::strtod(at, &end);
    if (end == at) return out;
    out *= number;
  }
}

void refuse_above(double limit, double size, const ModelFile& file, const XmlTag& tag) {
  if (size <= limit) return;
  char text[64];
  std::snprintf(text, sizeof text, "> makes %.3g, at most %.3g are read", size, limit);
  throw InputError(file.path + ": <" + tag.name + text);
}

void refuse_in(const ModelFile& file) {
  std::vector<double> copies = {1};  // of what stands in the open <replicate>s
  for (const XmlTag& tag : all_xml_tags(file.text)) {
    const bool closes = tag.kind == XmlTag::Kind::closing;
    if (tag.name == "replicate" && closes && copies.size() > 1) copies.pop_back();
    if (closes) continue;
    const auto attribute = [&](const char* name) { return product(tag.attribute(name)); };
    if (tag.name == "hfield") refuse_above(1e8, attribute("nrow") * attribute("ncol"), file, tag);
    if (tag.name == "flexcomp" || tag.name == "composite")
      refuse_above(1e6, copies.back() * attribute("count"), file, tag);
    if (tag.name != "replicate") continue;
    const double count = copies.back() * attribute("count");
    refuse_above(1e4, count, file, tag);
    if (tag.kind == XmlTag::Kind::opening) copies.push_back(count);
  }
}

}  // namespace

void refuse_huge_sizes(const std::vector<ModelFile>& files) {
  for (const ModelFile& file : files) refuse_in(file);
}

}  // namespace kalmarm

#include "robots/loader/test/fuzz/xml_mutator.hpp"

#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace kalmarm {
namespace {

constexpr const char* special_numbers[] = {
    "0",     "-0",   "1",    "-1",    "2",      "0.5",    "1e-3",  "1e-15",      "1e-16", "-1e-9",
    "1e-30", "1e30", "1e99", "1e-99", "1e-308", "5e-324", "1e308", "-1e308",     "nan",   "inf",
    "-inf",  "3",    "7",    "90",    "180",    "1e6",    "300",   "2147483648", "1e999", ""};

// Attributes that decide how M comes about.
constexpr const char* attributes[] = {"armature='.1'",
                                      "armature='-1'",
                                      "gravcomp='1'",
                                      "type='ball'",
                                      "type='free'",
                                      "type='slide'",
                                      "type='hinge'",
                                      "axis='0 0 0'",
                                      "axis='1e-9 1 0'",
                                      "range='-1e308 1e308'",
                                      "range='1 0'",
                                      "limited='true'",
                                      "ref='3'",
                                      "mass='0'",
                                      "mass='1e-20'",
                                      "diaginertia='1 1 3'",
                                      "diaginertia='0 0 0'",
                                      "fullinertia='1 1 1 .9 .9 .9'",
                                      "quat='0 0 0 0'",
                                      "euler='1 2 3'",
                                      "pos='1e9 0 0'",
                                      "gravity='0 0 0'",
                                      "gravity='disable'",
                                      "autolimits='true'",
                                      "balanceinertia='true'",
                                      "boundmass='1'",
                                      "boundinertia='1'",
                                      "settotalmass='3'",
                                      "inertiafromgeom='true'",
                                      "inertiagrouprange='1 2'",
                                      "fusestatic='true'",
                                      "discardvisual='true'",
                                      "angle='radian'",
                                      "mocap='true'",
                                      "sleep='never'",
                                      "density='0'",
                                      "shellinertia='true'",
                                      "group='1'",
                                      "class='arm'",
                                      "dclass='x'",
                                      "childclass='arm'",
                                      "active='true'",
                                      "gear='1e3'",
                                      "name='a'",
                                      "name=''",
                                      "joint='j1'",
                                      "count='2'",
                                      "damping='1 2 3'",
                                      "stiffness='-1'",
                                      "springref='1'",
                                      "frictionloss='1'",
                                      "simple='false'",
                                      "conaxis='true'",
                                      "prefix='p'"};

template <std::size_t n>
const char* pick(const char* const (&words)[n], std::size_t i) {
  return words[i % n];
}

}  // namespace

std::vector<XmlMutator::Span> XmlMutator::tags(const std::string& text) {
  std::vector<Span> out;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) break;
    out.push_back({at, end + 1});
  }
  return out;
}

std::vector<XmlMutator::Span> XmlMutator::elements(const std::string& text) {
  std::vector<Span> out, open;
  for (const Span& tag : tags(text)) {
    const char second = text[tag.begin + 1];
    if (second == '!' || second == '?') continue;
    if (second == '/') {
      if (open.empty()) continue;
      out.push_back({open.back().begin, tag.end});
      open.pop_back();
    } else if (text[tag.end - 2] == '/') {
      out.push_back(tag);
    } else {
      open.push_back(tag);
    }
  }
  return out;
}

std::vector<XmlMutator::Span> XmlMutator::values(const std::string& text) {
  std::vector<Span> out;
  for (std::size_t at = text.find('='); at != std::string::npos; at = text.find('=', at + 1)) {
    if (at + 1 >= text.size() || (text[at + 1] != '"' && text[at + 1] != '\'')) continue;
    const std::size_t end = text.find(text[at + 1], at + 2);
    if (end == std::string::npos) break;
    out.push_back({at + 2, end});
  }
  return out;
}

std::vector<XmlMutator::Span> XmlMutator::numbers(const std::string& text) {
  std::vector<Span> out;
  for (const Span& value : values(text)) {
    const char* at = text.c_str() + value.begin;
    const char* const stop = text.c_str() + value.end;
    while (at < stop) {
      char* end = nullptr;
      std::strtod(at, &end);
      if (end == at || end > stop) break;
      while (at < end && std::isspace(static_cast<unsigned char>(*at))) ++at;
      out.push_back({static_cast<std::size_t>(at - text.c_str()),
                     static_cast<std::size_t>(end - text.c_str())});
      at = end;
    }
  }
  return out;
}

std::string XmlMutator::number() {
  if (below(3)) return pick(special_numbers, below(1000));
  char out[32];
  std::snprintf(out, sizeof out, "%.3g", (static_cast<double>(below(2001)) - 1000) / 300);
  return out;
}

void XmlMutator::change(std::string& text) {
  const auto all = [&](const Span& span) { return text.substr(span.begin, span.end - span.begin); };
  const auto replace = [&](const Span& span, const std::string& by) {
    text.replace(span.begin, span.end - span.begin, by);
  };
  switch (below(8)) {
    case 0:
    case 1:
    case 2:
      if (const auto spans = numbers(text); !spans.empty()) replace(any(spans), number());
      break;
    case 3:
      if (const auto spans = values(text); !spans.empty()) replace(any(spans), all(any(spans)));
      break;
    case 4:
      if (const auto spans = tags(text); !spans.empty()) {
        const Span& tag = any(spans);
        const bool closed = text[tag.end - 2] == '/';
        text.insert(tag.end - 1 - closed, std::string(" ") + pick(attributes, below(1000)));
      }
      break;
    case 5:
      if (const auto spans = values(text); !spans.empty()) {  // the attribute goes
        const Span& value = any(spans);
        const std::size_t begin = text.rfind(' ', value.begin);
        if (begin != std::string::npos) text.erase(begin, value.end + 1 - begin);
      }
      break;
    case 6:
      if (const auto spans = elements(text); !spans.empty()) replace(any(spans), "");
      break;
    case 7:
      if (const auto spans = elements(text); !spans.empty()) {
        const std::string element = all(any(spans));
        if (below(2)) {
          replace(any(spans), element);
        } else {
          text.insert(any(tags(text)).end, element);
        }
      }
      break;
  }
}

std::string XmlMutator::mutated(std::string text) {
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) change(text);
  return text;
}

}  // namespace kalmarm

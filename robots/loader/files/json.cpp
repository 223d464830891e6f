#include "robots/loader/files/json.hpp"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

#include "robots/loader/input_error.hpp"
#include "robots/loader/names.hpp"

namespace kalmarm {
namespace {

constexpr int deepest = 32;

// Not by sums of strings, of which gcc 12 warns.
std::string quoted(std::string_view text) {
  std::string out(1, '\'');
  out += text;
  out += '\'';
  return out;
}

class Parser {
 public:
  explicit Parser(std::string_view text) : text_(text) {}

  Json whole() {
    Json out = value(0);
    space();
    if (at_ < text_.size()) fail("the end is needed, not " + here());
    return out;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + at_, '\n');
    throw InputError("line " + std::to_string(line) + ": " + what);
  }
  std::string here() const { return at_ < text_.size() ? quoted(text_.substr(at_, 1)) : "the end"; }
  char next() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void space() { at_ = std::min(text_.find_first_not_of(" \t\r\n", at_), text_.size()); }
  bool take(std::string_view word) {
    space();
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }
  void need(const char* word, const char* or_else = "") {
    if (!take(word)) fail(quoted(word) + or_else + " is needed, not " + here());
  }

  Json value(int depth) {
    if (depth > deepest)
      fail("lists and objects are nested more than " + std::to_string(deepest) + " deep");
    if (take("{")) return object(depth);
    if (take("[")) return list(depth);
    if (take("null")) return {};
    if (take("true")) return {.kind = Json::Kind::boolean, .number = 1};
    if (take("false")) return {.kind = Json::Kind::boolean};
    if (next() == '"') return {.kind = Json::Kind::text, .text = text()};
    return {.kind = Json::Kind::number, .number = number()};
  }

  Json object(int depth) {
    Json out{.kind = Json::Kind::object};
    if (take("}")) return out;
    do {
      space();
      if (next() != '"') fail("a name in quotes is needed, not " + here());
      std::string key = text();
      if (out.find(key)) fail("an object has '" + key + "' twice");
      need(":");
      out.members.emplace_back(std::move(key), value(depth + 1));
    } while (take(","));
    need("}", " or ','");
    return out;
  }

  Json list(int depth) {
    Json out{.kind = Json::Kind::list};
    if (take("]")) return out;
    do out.list.push_back(value(depth + 1));
    while (take(","));
    need("]", " or ','");
    return out;
  }

  double number() {
    const std::size_t end = std::min(text_.find_first_not_of("+-.0123456789eE", at_), text_.size());
    const std::string_view token = text_.substr(at_, end - at_);
    const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
    const std::string_view digits = token.substr(token.starts_with('-'));
    const bool has_form = !digits.empty() && is_digit(digits.front()) && is_digit(digits.back()) &&
                          !(digits.size() > 1 && digits[0] == '0' && is_digit(digits[1])) &&
                          digits.find(".e") == digits.npos && digits.find(".E") == digits.npos;
    double out = 0;
    const auto [stop, error] = std::from_chars(token.data(), token.data() + token.size(), out);
    if (!has_form || error == std::errc::invalid_argument || stop != token.data() + token.size())
      fail("a value is needed, not " + (token.empty() ? here() : quoted(token)));
    if (error != std::errc()) fail("double does not hold " + std::string(token));
    at_ = end;
    return out;
  }

  std::string text() {
    std::string out;
    for (++at_; next() != '"'; ++at_) {
      if (static_cast<unsigned char>(next()) < ' ')
        fail("text ends without a quote, or holds a control character");
      if (next() != '\\') {
        out += next();
        continue;
      }
      ++at_;
      constexpr std::string_view letters = "\"\\/bfnrt", meant = "\"\\/\b\f\n\r\t";
      const std::size_t known = letters.find(next());
      if (next() == 'u')
        append_code(out);
      else if (at_ < text_.size() && known != letters.npos)
        out += meant[known];
      else
        fail(quoted(text_.substr(at_ - 1, 2)) + " stands for nothing");
    }
    ++at_;
    return out;
  }

  // Of \uXXXX, or two of them where the first is half of a pair, whose u is next; ends at the last digit.
  void append_code(std::string& out) {
    unsigned code = unit();
    if (code >= 0xdc00 && code < 0xe000) fail("half of a pair of \\u");
    if (code >= 0xd800 && code < 0xdc00) {
      if (!text_.substr(at_ + 1).starts_with("\\u")) fail("half of a pair of \\u");
      at_ += 2;
      const unsigned low = unit();
      if (low < 0xdc00 || low >= 0xe000) fail("half of a pair of \\u");
      code = 0x10000 + ((code - 0xd800) << 10) + (low - 0xdc00);
    }
    const auto put = [&](unsigned byte) { out += static_cast<char>(byte); };
    if (code < 0x80) return put(code);
    if (code < 0x800) {
      put(0xc0 | code >> 6);
    } else if (code < 0x10000) {
      put(0xe0 | code >> 12);
      put(0x80 | (code >> 6 & 0x3f));
    } else {
      put(0xf0 | code >> 18);
      put(0x80 | (code >> 12 & 0x3f));
      put(0x80 | (code >> 6 & 0x3f));
    }
    put(0x80 | (code & 0x3f));
  }
  unsigned unit() {
    unsigned out = 0;
    const std::string_view digits = text_.substr(at_ + 1, 4);
    const auto [stop, error] =
        std::from_chars(digits.data(), digits.data() + digits.size(), out, 16);
    if (error != std::errc() || digits.size() != 4 || stop != digits.data() + 4)
      fail("'\\u' needs four digits");
    at_ += 4;
    return out;
  }

  std::string_view text_;
  std::size_t at_ = 0;
};

}  // namespace

const Json* Json::find(const std::string& key) const {
  for (const auto& [name, value] : members)
    if (name == key) return &value;
  return nullptr;
}

Json json_of(const std::string& text) {
  if (!is_utf8(text)) throw InputError("is not UTF-8");
  return Parser(text).whole();
}

}  // namespace kalmarm

// Changes XML so that it mostly stays XML: a reader that we cannot instrument refuses nearly all
// that changed bytes make of a file.
#pragma once

#include <random>
#include <string>
#include <vector>

namespace kalmarm {

class XmlMutator {
 public:
  explicit XmlMutator(unsigned seed) : random_(seed) {}

  // With one to four changes: a number, the value of an attribute, an attribute more or less, an
  // element removed, doubled or moved.
  std::string mutated(std::string text);

  std::size_t below(std::size_t n) { return n ? random_() % n : 0; }

 private:
  struct Span {
    std::size_t begin, end;
  };

  // `<…>` without comments; whole elements that can be told by their names; values without quotes.
  static std::vector<Span> tags(const std::string& text);
  static std::vector<Span> elements(const std::string& text);
  static std::vector<Span> values(const std::string& text);
  static std::vector<Span> numbers(const std::string& text);

  const Span& any(const std::vector<Span>& spans) { return spans[below(spans.size())]; }
  void change(std::string& text);
  std::string number();

  std::minstd_rand random_;
};

}  // namespace kalmarm

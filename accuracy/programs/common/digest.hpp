// SHA-1 of bytes, by which files that a program reads again are known to be what it wrote. In hex it
// is what sha1sum prints.
#pragma once

#include <array>
#include <boost/uuid/detail/sha1.hpp>
#include <cstddef>
#include <string>

namespace kalmarm {

using Digest = std::array<char, 20>;

inline Digest digest_of(const std::string& bytes) {
  boost::uuids::detail::sha1 hash;
  hash.process_bytes(bytes.data(), bytes.size());
  boost::uuids::detail::sha1::digest_type digest;
  hash.get_digest(digest);
  Digest out;
  static_assert(sizeof digest == sizeof out);
  for (std::size_t i = 0; i < out.size(); ++i)  // words, the highest byte first
    out[i] = static_cast<char>(digest[i / 4] >> (24 - 8 * (i % 4)));
  return out;
}

inline std::string hex(const Digest& digest) {
  std::string out;
  for (const char byte : digest) {
    constexpr const char* figures = "0123456789abcdef";
    const auto value = static_cast<unsigned char>(byte);
    out += figures[value / 16];
    out += figures[value % 16];
  }
  return out;
}

}  // namespace kalmarm

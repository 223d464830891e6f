// SHA-1 of bytes, by which files that a program reads again are known to be what it wrote.
#pragma once

#include <array>
#include <boost/uuid/detail/sha1.hpp>
#include <cstring>
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
  std::memcpy(out.data(), &digest, sizeof out);
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

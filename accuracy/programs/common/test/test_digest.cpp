#include <gtest/gtest.h>

#include "accuracy/programs/common/digest.hpp"

namespace kalmarm {
namespace {

// FIPS 180: the empty message, and one of a block.
TEST(Digest, IsSha1) {
  EXPECT_EQ(hex(digest_of("")), "da39a3ee5e6b4b0d3255bfef95601890afd80709");
  EXPECT_EQ(hex(digest_of("abc")), "a9993e364706816aba3e25717850c26c9cd0d89d");
}

}  // namespace
}  // namespace kalmarm

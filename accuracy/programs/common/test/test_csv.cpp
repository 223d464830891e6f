#include <gtest/gtest.h>

#include "accuracy/programs/common/csv.hpp"

namespace kalmarm {
namespace {

TEST(Csv, NoNameIsAFormula) {
  for (const std::string name : {"=1+1", "+a", "-a", "@a", "'a"})
    EXPECT_EQ(field(name), "'" + name);
  EXPECT_EQ(field("=a,b"), "\"'=a,b\"");
  EXPECT_EQ(field("arm=1"), "arm=1");
  EXPECT_EQ(field(""), "");
}

}  // namespace
}  // namespace kalmarm

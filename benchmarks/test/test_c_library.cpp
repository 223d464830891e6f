// Code that is generated for a mechanism is compiled once, and changes nothing but what it computes.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "accuracy/programs/common/test/temporary_folder.hpp"
#include "benchmarks/peers/c_library.hpp"

namespace kalmarm::test {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;

const CCompiler compiler = {KALMARM_TEST_COMPILER, "1", {"-Ofast"}};
// In two files, as long functions are.
const Files twice = {
    {"twice.c", "double sum(double, double); double twice(double x) { return sum(x, x); }"},
    {"sum.c", "double sum(double x, double y) { return x + y; }"}};

struct Close {
  void operator()(void* library) const { dlclose(library); }
};
std::unique_ptr<void, Close> load(const CLibrary& library) {
  return std::unique_ptr<void, Close>(dlopen(library.path.c_str(), RTLD_NOW | RTLD_LOCAL));
}

TEST(CLibrary, ComputesWhatTheTextSays) {
  const TemporaryFolder folder;
  const auto loaded = load(make_library(twice, compiler, folder.path()));
  ASSERT_TRUE(loaded);
  const auto function = reinterpret_cast<double (*)(double)>(dlsym(loaded.get(), "twice"));
  ASSERT_TRUE(function);
  EXPECT_EQ(function(21), 42);
}

// What is found is not looked into: a mark in the library and in its time shows whether it was
// written again.
TEST(CLibrary, TheSameTextIsCompiledOnce) {
  const TemporaryFolder folder;
  const CLibrary first = make_library(twice, compiler, folder.path());
  put(first.path, "mark");
  put(fs::path(first.path).replace_extension(".seconds"), "1234.5");
  const CLibrary second = make_library(twice, compiler, folder.path());
  EXPECT_EQ(second.path, first.path);
  EXPECT_EQ(second.seconds, 1234.5);
  EXPECT_EQ(content(first.path), "mark");
}

TEST(CLibrary, OtherTextFlagsAndVersionsAreOtherLibraries) {
  const TemporaryFolder folder;
  const fs::path first = make_library(twice, compiler, folder.path()).path;
  Files thrice = twice;
  thrice.at("twice.c") += "\n";
  EXPECT_NE(make_library(thrice, compiler, folder.path()).path, first);
  CCompiler other = compiler;
  other.flags = {"-O1"};
  EXPECT_NE(make_library(twice, other, folder.path()).path, first);
  other = compiler;
  other.version = "2";
  EXPECT_NE(make_library(twice, other, folder.path()).path, first);
}

TEST(CLibrary, WhatFailsThrowsAndLeavesNothing) {
  const TemporaryFolder folder;
  testing::internal::CaptureStderr();
  EXPECT_THROW(make_library({{"wrong.c", "no C"}}, compiler, folder.path()), std::runtime_error);
  EXPECT_NE(testing::internal::GetCapturedStderr(), "");
  EXPECT_THROW(make_library(twice, {"/no/compiler", "", {}}, folder.path()), std::runtime_error);
  EXPECT_EQ(folder.count(), 0);
}

TEST(CLibrary, DenormalNumbersAreNotFlushedOnceItIsLoaded) {
  const TemporaryFolder folder;
  const auto loaded = load(make_library(twice, compiler, folder.path()));
  ASSERT_TRUE(loaded);
  volatile double smallest = std::numeric_limits<double>::min();
  EXPECT_GT(smallest / 2, 0);
}

}  // namespace
}  // namespace kalmarm::test

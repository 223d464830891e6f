#include <gtest/gtest.h>

#include "accuracy/programs/common/journal.hpp"
#include "algorithms/test/temporary_folder.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

using Parts = std::map<std::size_t, std::string>;

const Parts three{{0, "a,1\nb,2\n"}, {1, ""}, {7, "c,3.25\n"}};

// A journal of this run that holds the three parts; its only file.
fs::path write_three(const TemporaryFolder& folder) {
  const Journal journal(folder.path(), "run");
  Journal::Writer out = journal.writer();
  for (const auto& [part, text] : three) out.append(part, text);
  return *fs::directory_iterator(folder.path());
}

TEST(Journal, GivesBackWhatWasWrittenInThisRunAndNothingOfOthers) {
  const TemporaryFolder folder;
  write_three(folder);
  const Journal journal(folder.path(), "run"), other(folder.path(), "another run");
  EXPECT_EQ(journal.read().parts, three);
  EXPECT_EQ(journal.read().garbled, 0);
  EXPECT_EQ(other.read().parts, Parts());
  EXPECT_EQ(other.read().others, 1);
}

TEST(Journal, AnyByteThatIsChangedOrCutOffCostsItsPartAlone) {
  const TemporaryFolder folder;
  const fs::path file = write_three(folder);
  const std::string whole = content(file);
  const Journal journal(folder.path(), "run");
  for (std::size_t i = 0; i < whole.size(); ++i) {
    SCOPED_TRACE(i);
    std::string changed = whole;
    changed[i] = changed[i] == '1' ? '2' : '1';
    put(file, changed);
    const Journal::Found found = journal.read();
    EXPECT_EQ(found.garbled, 1);
    EXPECT_EQ(found.parts.size(), 2);
    for (const auto& [part, text] : found.parts) EXPECT_EQ(three.at(part), text);
  }
  for (std::size_t length = 0; length < whole.size(); ++length) {
    put(file, whole.substr(0, length));
    for (const auto& [part, text] : journal.read().parts) EXPECT_EQ(three.at(part), text);
  }
  put(file, whole.substr(0, whole.size() - 3));
  journal.writer().append(7, three.at(7));  // after what was cut off
  EXPECT_EQ(journal.read().parts, three);
}

TEST(Journal, AnothersFileOrFolderIsRefusedAndStays) {
  const TemporaryFolder folder;
  const std::string users = folder / "run.csv.journal";
  put(users, "a user's");
  EXPECT_THROW(Journal(users, "run"), InputError);
  EXPECT_EQ(content(users), "a user's");
  EXPECT_THROW(Journal(folder.path(), "run"), InputError);
  EXPECT_EQ(folder.count(), 1);
  EXPECT_THROW(Journal(folder / "nowhere/run.csv.journal", "run"), InputError);
}

TEST(Journal, RemovesItsOwnFilesAlone) {
  const TemporaryFolder folder;
  const std::string path = folder / "run.csv.journal";
  const Journal journal(path, "run");
  journal.writer().append(0, "a");
  const Journal other(path, "another run");
  other.writer().append(0, "b");
  journal.remove();
  EXPECT_EQ(other.read().parts, (Parts{{0, "b"}}));
  other.remove();
  EXPECT_FALSE(fs::exists(path));
}

TEST(Journal, AnEmptyFolderOfSomebodyStays) {
  const TemporaryFolder folder;
  const Journal journal(folder.path(), "run");
  journal.writer().append(0, "a");
  journal.remove();
  EXPECT_TRUE(fs::exists(folder.path()));
  EXPECT_EQ(folder.count(), 0);
}

}  // namespace
}  // namespace kalmarm

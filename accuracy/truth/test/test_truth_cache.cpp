#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include "accuracy/programs/common/digest.hpp"
#include "accuracy/truth/truth_cache.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// A folder of its own, a small problem, and how its truth looks.
class TruthCache : public testing::Test {
 protected:
  TruthCache() {
    std::string name = (fs::temp_directory_path() / "kalmarm-XXXXXX").string();
    folder = mkdtemp(name.data());
  }
  ~TruthCache() override { fs::remove_all(folder); }

  Truth<double> cached() const { return cached_truth(model, q, tasks, options, folder); }

  std::vector<fs::path> files() const {
    return {fs::directory_iterator(folder), fs::directory_iterator()};
  }
  fs::path entry() const {
    EXPECT_EQ(files().size(), 1u);
    return files().at(0);
  }
  // Changes when the entry is written again.
  static ino_t identity(const fs::path& path) {
    struct stat status {};
    stat(path.c_str(), &status);
    return status.st_ino;
  }
  static std::string read(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  fs::path folder;
  Model<double> model = test::planar_two_link(0);
  VectorX<double> q = Eigen::Vector2d(0.3, -0.4);
  std::vector<Task<double>> tasks{
      {Eigen::Vector2d(1, 2), Eigen::Vector2d(0.1, 0.2), Drive::innovations}};
  TruthOptions options{.draws = 2};
};

void expect_same(const Truth<double>& a, const Truth<double>& b) {
  EXPECT_EQ(a.outcome.status, b.outcome.status);
  EXPECT_EQ(a.outcome.joint, b.outcome.joint);
  EXPECT_EQ(a.M, b.M);
  EXPECT_EQ(a.X, b.X);
  EXPECT_EQ(a.D, b.D);
  EXPECT_EQ(a.g, b.g);
  EXPECT_EQ(a.digits, b.digits);
  EXPECT_EQ(a.width.M, b.width.M);
  EXPECT_EQ(a.width.X, b.width.X);
  EXPECT_EQ(a.width.D, b.width.D);
  EXPECT_EQ(a.width.g, b.width.g);
  ASSERT_EQ(a.responses.size(), b.responses.size());
  for (std::size_t i = 0; i < a.responses.size(); ++i) {
    EXPECT_EQ(a.responses[i].tau, b.responses[i].tau);
    EXPECT_EQ(a.responses[i].a, b.responses[i].a);
    EXPECT_EQ(a.responses[i].width.relative, b.responses[i].width.relative);
    EXPECT_EQ(a.responses[i].width.energy, b.responses[i].width.energy);
    EXPECT_EQ(a.responses[i].width.componentwise, b.responses[i].width.componentwise);
    EXPECT_EQ(a.responses[i].kS.relative, b.responses[i].kS.relative);
    EXPECT_EQ(a.responses[i].kS.energy, b.responses[i].kS.energy);
  }
}

TEST_F(TruthCache, ReadsWhatWasWorkedOutToTheLastBit) {
  const Truth<double> exact = truth(model, q, tasks, options);
  expect_same(cached(), exact);
  EXPECT_GT(exact.largest_width(), 0);
  const ino_t written = identity(entry());
  const Truth<double> again = cached();
  EXPECT_EQ(identity(entry()), written);
  expect_same(again, exact);
  EXPECT_EQ(again.M(0, 0).precision(), exact.M(0, 0).precision());
}

TEST_F(TruthCache, RemembersThatThereIsNoInverse) {
  test::Builder builder;
  builder.add_massless({});
  model = builder.build();
  q = VectorX<double>::Zero(1);
  tasks.clear();
  EXPECT_EQ(cached().outcome.status, Outcome::Status::singular);
  const ino_t written = identity(entry());
  expect_same(cached(), truth(model, q, tasks, options));
  EXPECT_EQ(identity(entry()), written);
}

TEST_F(TruthCache, EveryInputHasAnEntryOfItsOwn) {
  std::vector<Joint<double>> joints{model.joint(0), model.joint(1)};
  Vector3<double> gravity = model.gravity();
  std::size_t count = 0;
  const auto expect_one_more = [&] {
    model = Model<double>(joints, {"a", "b"}, 2, gravity);
    (void)cached();
    EXPECT_EQ(files().size(), ++count);
  };
  expect_one_more();
  for (const auto& change : std::vector<std::function<void(Joint<double>&)>>{
           [](auto& j) { j.ref = 0.1; }, [](auto& j) { j.r = 0.1; },
           [](auto& j) { j.rotation.z() = 0.1; }, [](auto& j) { j.translation[1] = 0.1; },
           [](auto& j) { j.body.mass = 3; }, [](auto& j) { j.body.com[2] = 0.1; },
           [](auto& j) { j.body.axes.x() = 0.1; }, [](auto& j) { j.body.moments[0] = 0.1; },
           [](auto& j) { j.coordinate = Coordinate::distance; }, [](auto& j) { j.slides = true; },
           [](auto& j) { j.q_index = 0; }, [](auto& j) { j.parent = -1; }}) {
    change(joints[1]);
    expect_one_more();
  }
  gravity[2] = 1;
  expect_one_more();
  q[0] = 1;
  expect_one_more();
  tasks[0].value[0] = 3;
  expect_one_more();
  tasks[0].qd[0] = 3;
  expect_one_more();
  tasks[0].gravity = false;
  expect_one_more();
  tasks[0].drive = Drive::acceleration;
  expect_one_more();
  tasks.push_back(tasks[0]);
  expect_one_more();
  options.draws = 3;
  expect_one_more();
  options.matrices = false;
  expect_one_more();
  options.digits = 500;
  expect_one_more();
  (void)cached_truth<float>(model.cast<float>(), q.cast<float>(), {}, options, folder);
  EXPECT_EQ(files().size(), ++count);
}

// One flipped bit in any byte, and any shorter file.
TEST_F(TruthCache, DamageIsSeenAndRepaired) {
  const Truth<double> exact = cached();
  const fs::path path = entry();
  const std::string whole = read(path);
  const auto expect_repaired = [&] {
    const ino_t damaged = identity(path);
    expect_same(cached(), exact);
    EXPECT_NE(identity(path), damaged);
    EXPECT_EQ(read(path), whole);
  };
  for (std::size_t i = 0; i < whole.size(); i += i < 100 ? 1 : 23) {
    SCOPED_TRACE(i);
    std::string bytes = whole;
    bytes[i] ^= static_cast<char>(1 << i % 8);
    write(path, bytes);
    expect_repaired();
    write(path, whole.substr(0, i));
    expect_repaired();
  }
  write(path, whole + '\0');
  expect_repaired();
  write(path, "something else");
  expect_repaired();
}

// Whatever an entry says under a checksum that is right, vectors and matrices have the model's sizes.
TEST_F(TruthCache, ContentIsReadWithTheSizesOfTheModel) {
  const Truth<double> exact = cached();
  const fs::path path = entry();
  const std::string whole = read(path);
  constexpr std::size_t head = 8 + sizeof(Digest), content = head + sizeof(Digest);
  const auto write_signed = [&](std::string bytes) {
    const Digest digest = digest_of(bytes.substr(content));
    write(path, bytes.replace(head, digest.size(), digest.data(), digest.size()));
  };
  for (std::size_t i = content; i < whole.size(); i += i < content + 100 ? 1 : 11) {
    SCOPED_TRACE(i);
    for (const int byte : {0x00, 0x01, 0x7f, 0xff}) {
      std::string bytes = whole;
      bytes[i] = static_cast<char>(byte);
      write_signed(bytes);
      const Truth<double> got = cached();
      if (!got.outcome) continue;
      ASSERT_EQ(got.M.size() + got.X.size() + got.D.size() + got.g.size(), 4 + 4 + 2 + 12);
      ASSERT_EQ(got.responses.size(), 1u);
      ASSERT_EQ(got.responses[0].tau.size() + got.responses[0].a.size(), 4);
    }
    write_signed(whole.substr(0, i));
    expect_same(cached(), exact);
  }
  write_signed(whole + '\n');
  expect_same(cached(), exact);
  EXPECT_EQ(read(path), whole);
}

TEST_F(TruthCache, AFileOfAnotherKindIsReplaced) {
  const Truth<double> exact = cached();
  const fs::path path = entry();
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  expect_same(cached(), exact);  // and does not wait for a writer
  EXPECT_TRUE(fs::is_regular_file(path));
  fs::resize_file(path, 20'000'000'000);
  expect_same(cached(), exact);
  EXPECT_LT(fs::file_size(path), 100'000u);
}

TEST_F(TruthCache, FilesOfOthersAreNotRead) {
  if (geteuid() != 0) GTEST_SKIP() << "only root gives a file to somebody else";
  (void)cached();
  const ino_t written = identity(entry());
  ASSERT_EQ(chown(entry().c_str(), 1, 1), 0);
  (void)cached();
  EXPECT_NE(identity(entry()), written);
}

TEST_F(TruthCache, ARenamedEntryIsNotTrusted) {
  const Truth<double> exact = cached();
  const fs::path path = entry();
  const std::string whole = read(path);
  const VectorX<double> before = q;
  q[0] = 1;
  (void)cached();
  for (const fs::path& other : files())
    if (other != path) fs::rename(other, path);
  q = before;
  expect_same(cached(), exact);
  EXPECT_EQ(read(entry()), whole);
}

TEST_F(TruthCache, WorksWithoutAFolder) {
  const Truth<double> exact = cached();
  write(folder / "file", "");
  for (const fs::path& nowhere : {fs::path(), folder / "file" / "below", fs::path("/proc/nowhere")})
    expect_same(cached_truth(model, q, tasks, options, nowhere), exact);
}

TEST_F(TruthCache, ManyProcessesShareAFolder) {
  const Truth<double> exact = truth(model, q, tasks, options);
  std::vector<pid_t> children;
  for (int i = 0; i < 4; ++i)
    if (const pid_t child = fork(); child == 0) {
      bool same = true;
      for (int round = 0; round < 20; ++round) {
        same = same && cached().M == exact.M;
        for (const fs::path& path : files())
          if (round % 4 == i) truncate(path.c_str(), 50);
      }
      _exit(same ? 0 : 1);
    } else {
      children.push_back(child);
    }
  for (const pid_t child : children) {
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  expect_same(cached(), exact);
  (void)entry();  // and no temporary file is left
}

TEST_F(TruthCache, AboveTheLimitKeepsAccelerationsOnly) {
  model = test::straight_chain(151);
  q = VectorX<double>::Zero(151);
  tasks = {{VectorX<double>::Ones(151), q}};
  options = {};
  (void)cached();
  EXPECT_TRUE(files().empty());
  options.matrices = false;
  const Truth<double> exact = cached();
  const ino_t written = identity(entry());
  expect_same(cached(), exact);
  EXPECT_EQ(identity(entry()), written);
}

TEST_F(TruthCache, FolderIsNamedByTheEnvironment) {
  const auto with = [](const char* own, const char* xdg, const char* home) {
    const auto set = [](const char* name, const char* value) {
      value ? setenv(name, value, 1) : unsetenv(name);
    };
    set("KALMARM_CACHE", own);
    set("XDG_CACHE_HOME", xdg);
    set("HOME", home);
    return cache_folder();
  };
  const pid_t child = fork();  // the environment is this process's
  if (child == 0)
    _exit(with("/a", "/b", "/c") == "/a" && with("", "/b", "/c").empty() &&
                  with(nullptr, "/b", "/c") == "/b/kalmarm" &&
                  with(nullptr, "", "/c") == "/c/.cache/kalmarm" &&
                  with(nullptr, "b", "/c") == "/c/.cache/kalmarm" &&
                  with(nullptr, nullptr, nullptr).empty()
              ? 0
              : 1);
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace kalmarm

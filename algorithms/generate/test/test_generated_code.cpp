// The generated C as a compiler sees it: plain C99 that gives what its record does, for one state and for rows; and
// no text of a file in it.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "algorithms/fast/test/support.hpp"
#include "algorithms/generate/c_text.hpp"
#include "algorithms/generate/package.hpp"

namespace kalmarm::test {
namespace {

namespace fs = std::filesystem;

const std::vector<GeneratedTask> all_tasks(std::begin(generated_tasks), std::end(generated_tasks));

// A package in a folder of its own.
class Folder {
 public:
  explicit Folder(const std::map<std::string, std::string>& files) {
    std::string name = (fs::temp_directory_path() / "kalmarm-XXXXXX").string();
    path_ = mkdtemp(name.data());
    for (const auto& [file, text] : files) std::ofstream(path_ / file, std::ios::binary) << text;
  }
  ~Folder() { fs::remove_all(path_); }

  // Whether the compiler takes a file, as C; what it says goes to standard error.
  bool compiles(const std::string& file, const std::string& flags) const {
    return runs_there(KALMARM_TEST_COMPILER " -fPIC " + flags + " -x c -c " + file + ".c");
  }
  bool links(const std::string& output, const std::string& files) const {
    return runs_there(KALMARM_TEST_COMPILER " -o " + output + " " + files + " -lm");
  }
  bool runs_there(const std::string& command) const {
    return std::system(("cd '" + path_.string() + "' && " + command).c_str()) == 0;
  }
  std::string operator/(const std::string& file) const { return path_ / file; }

 private:
  fs::path path_;
};

constexpr const char *strict = "-std=c99 -pedantic -Wall -Wextra -Werror -O1",
                     *of_rows = "-O1 -march=native -Wall -Wextra -Werror";

template <class T>
Package<T> package_of(const Model<double>& model, const PackageOptions& options) {
  return {model, std::vector<double>(model.nq(), 0.0), options};
}

// The functions of a library by name, with 1, 2 or 3 inputs and one result.
class Library {
 public:
  explicit Library(const std::string& path) : handle_(dlopen(path.c_str(), RTLD_NOW)) {
    EXPECT_TRUE(handle_) << dlerror();
  }
  ~Library() { dlclose(handle_); }

  template <class Function>
  Function* function(const std::string& name) const {
    void* const out = dlsym(handle_, name.c_str());
    EXPECT_TRUE(out) << name;
    return reinterpret_cast<Function*>(out);
  }

 private:
  void* handle_;
};

template <class T>
void call(const Library& library, const std::string& name, const std::vector<const T*>& in,
          T* out) {
  if (in.size() == 1) library.function<void(const T*, T*)>(name)(in[0], out);
  if (in.size() == 2) library.function<void(const T*, const T*, T*)>(name)(in[0], in[1], out);
  if (in.size() == 3)
    library.function<void(const T*, const T*, const T*, T*)>(name)(in[0], in[1], in[2], out);
}
template <class T>
void call_rows(const Library& library, const std::string& name, std::size_t rows,
               const std::vector<const T*>& in, T* out) {
  if (in.size() == 1) library.function<void(std::size_t, const T*, T*)>(name)(rows, in[0], out);
  if (in.size() == 2)
    library.function<void(std::size_t, const T*, const T*, T*)>(name)(rows, in[0], in[1], out);
  if (in.size() == 3)
    library.function<void(std::size_t, const T*, const T*, const T*, T*)>(name)(rows, in[0], in[1],
                                                                                in[2], out);
}

template <class T>
class GeneratedCode : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(GeneratedCode, Precisions, PrecisionName);

// For numbers of rows on both sides of a register's width; behind the last result nothing is written. The error is
// beside that of the record: sines differ by a few roundings, which the mechanism makes larger.
TYPED_TEST(GeneratedCode, GivesWhatItsRecordGives) {
  using T = TypeParam;
  using enum GeneratedTask;
  struct Robot {
    Model<double> model;
    std::vector<GeneratedTask> tasks;
  };
  const std::vector<Robot> robots = {
      {body_on_the_base<&Builder::add_free>(1), {forward_dynamics, mass}},
      {body_on_the_base<&Builder::add_ball>(1), {forward_dynamics, solve}},
      {slides(1), {inverse_dynamics, inverse_mass}},
      {chain(1, 3), {forward_dynamics, inverse_dynamics, mass}}};
  for (const Robot& robot : robots) {
    const Model<double>& model = robot.model;
    const Package<T> package = package_of<T>(model, {"arm", robot.tasks, true});
    const Folder folder(package.files({}));
    ASSERT_TRUE(folder.compiles("arm", strict));
    ASSERT_TRUE(folder.compiles("arm_rows", of_rows));
    ASSERT_TRUE(folder.links("arm.so", "-shared arm.o arm_rows.o"));
    const Library library(folder / "arm.so");
    constexpr int most = 37;
    std::vector<T> q, v, tau;
    for (int i = 0; i < most; ++i) {
      const State<T> state = random_state(model, i).template cast<T>();
      q.insert(q.end(), state.q.begin(), state.q.end());
      v.insert(v.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
    }
    for (const TaskRecord& record : package.records()) {
      const std::string name = "arm_" + to_string(record.task);
      const int size = record.outputs[0].size;
      const auto inputs = [&](int i) {
        std::vector<const T*> in = {&q[i * model.nq()]};
        if (record.inputs.size() == 3) in.push_back(&v[i * model.nv()]);
        if (record.inputs.size() > 1) in.push_back(&tau[i * model.nv()]);
        return in;
      };
      std::vector<T> one(most * size, T(NAN));
      for (int i = 0; i < most; ++i) {
        call(library, name, inputs(i), &one[i * size]);
        std::vector<T> given;
        for (std::size_t k = 0; k < record.inputs.size(); ++k)
          given.insert(given.end(), inputs(i)[k], inputs(i)[k] + record.inputs[k].size);
        const std::vector<T> expected = record.graph.template evaluate<T>(record.results, given);
        const auto x = Eigen::Map<const VectorX<T>>(&one[i * size], size);
        const auto y = Eigen::Map<const VectorX<T>>(expected.data(), size);
        EXPECT_LE((x - y).norm(), (sizeof(T) == 4 ? T(1e-3) : T(1e-11)) * y.norm())
            << name << " " << i;
      }
      for (const int rows : {1, 2, 3, 7, 8, 9, 16, 17, 33, most}) {
        std::vector<T> many(most * size + 64, T(-77));
        call_rows(library, name + "_rows", rows, inputs(0), many.data());
        const auto x = Eigen::Map<const VectorX<T>>(many.data(), rows * size);
        const auto y = Eigen::Map<const VectorX<T>>(one.data(), rows * size);
        EXPECT_LE((x - y).norm(), (sizeof(T) == 4 ? T(1e-3) : T(1e-11)) * y.norm())
            << name << " of " << rows;
        for (std::size_t i = rows * size; i < many.size(); ++i)
          ASSERT_EQ(many[i], T(-77)) << name << " of " << rows << " writes behind its rows";
      }
    }
  }
}

// Far angles and angles that are none, in both forms. What is added to an angle is rounded with it.
TYPED_TEST(GeneratedCode, AnglesOfAnySizeAreExactOrNaN) {
  using T = TypeParam;
  const Model<double> model = one_hinge(1);
  const Package<T> package = package_of<T>(model, {"arm", {GeneratedTask::inverse_dynamics}, true});
  const Folder folder(package.files({}));
  ASSERT_TRUE(folder.compiles("arm", strict));
  ASSERT_TRUE(folder.compiles("arm_rows", of_rows));
  ASSERT_TRUE(folder.links("arm.so", "-shared arm.o arm_rows.o"));
  const Library library(folder / "arm.so");
  const T farthest = sizeof(T) == 4 ? T(1.2e4) : T(1.6e6), zero = 0;
  for (const T angle : {T(0), T(0.7), T(-1.6), T(3.2), T(99), -farthest, farthest, T(2) * farthest,
                        std::numeric_limits<T>::infinity(), T(NAN)}) {
    const bool is_far = !(std::abs(angle) <= farthest);
    State<double> state{VectorX<double>::Constant(1, angle), VectorX<double>::Zero(1),
                        VectorX<double>::Zero(1)};
    for (const char* suffix : {"", "_rows"}) {
      VectorX<T> tau = poisoned<T>(1);
      const std::string name = std::string("arm_inverse_dynamics") + suffix;
      if (*suffix)
        call_rows<T>(library, name, 1, {&angle, &zero, &zero}, tau.data());
      else
        call<T>(library, name, {&angle, &zero, &zero}, tau.data());
      if (is_far)
        EXPECT_TRUE(std::isnan(tau[0])) << angle << suffix;
      else
        EXPECT_LE(Truth(rounded<T>(model), state).torque(tau),
                  (32 + 2 * std::abs(angle)) * unit_roundoff<T>())
            << angle << suffix;
    }
  }
}

TEST(GeneratedFiles, AreTheSameToTheByteForTheSameRobot) {
  const PackageOptions options{"arm", all_tasks, true};
  EXPECT_EQ(package_of<double>(everything(1), options).files({}),
            package_of<double>(everything(1), options).files({}));
}

TEST(GeneratedTest, SaysWhatIsWrong) {
  const Model<double> model = chain(1, 3);
  const State<double> state = random_state(model, 1);
  const MatrixX<double> M = dense_mechanics(model, state).M;
  const Package<double> package = package_of<double>(model, {"arm", {GeneratedTask::mass}});
  const auto list = [](const auto& x) { return std::vector<double>(x.begin(), x.end()); };
  TaskCheck check{GeneratedTask::mass, {list(state.q)}, list(M.reshaped()), 1e-13};
  for (const bool is_right : {true, false}) {
    if (!is_right) check.truth[4] *= 1 + 1e-10;
    const Folder folder(package.files({check}));
    ASSERT_TRUE(folder.compiles("arm", strict) && folder.compiles("arm_test", strict) &&
                folder.links("test", "arm.o arm_test.o"));
    EXPECT_EQ(folder.runs_there("./test > /dev/null"), is_right);
  }
}

// A comment that a name ends, a string, a line that a backslash joins, trigraphs, words of C, and nothing.
TEST(GeneratedNames, OfAFileNeverReachTheCode) {
  const std::vector<std::string> names = {"*/ int x; /*", "\"\\", "a\nb",     "a\\\nb",
                                          "?\?/",         "int",  "",         "a b",
                                          "a_b",          "a\rb", "\xc3\xa9", "a_b_2"};
  Model<double> model;
  {
    Random random(1);
    Builder builder;
    for (std::size_t k = 0; k < names.size(); ++k)
      builder.add(random_joint(random, static_cast<int>(k) - 1));
    const Model<double> drawn = builder.build();
    std::vector<Joint<double>> joints;
    for (int k = 0; k < drawn.nv(); ++k) joints.push_back(drawn.joint(k));
    model = Model<double>(joints, names, drawn.nq(), drawn.gravity());
  }
  const auto files =
      package_of<double>(model, {"arm", {GeneratedTask::inverse_dynamics}, true}).files({});
  for (const auto& [file, text] : files)
    for (const std::string& name : names) {
      if (c_identifier(name) == name) continue;
      EXPECT_EQ(text.find(name), std::string::npos) << file << ": " << name;
    }
  const Folder folder(files);
  EXPECT_TRUE(folder.compiles("arm", std::string(strict) + " -trigraphs"));
}

TEST(GeneratedNames, DifferWhereTheFilesDoNot) {
  std::set<std::string> taken;
  EXPECT_EQ(unique_identifier("arm_", "a b", taken), "arm_a_b");
  EXPECT_EQ(unique_identifier("arm_", "a_b_2", taken), "arm_a_b_2");
  EXPECT_EQ(unique_identifier("arm_", "a.b", taken), "arm_a_b_3");
}

TEST(GeneratedNumbers, AreReadAsTheyAre) {
  for (const double x : {0.1, -1e-300, 1e300, 3.0, 5e-324, 1.0 / 3}) {
    EXPECT_EQ(std::strtod(c_number(x).c_str(), nullptr), x);
    EXPECT_NE(c_number(x).find_first_of(".e"), std::string::npos) << c_number(x);
  }
  EXPECT_EQ(c_number(2.0F), "2.0f");
}

TEST(GeneratedCodeOfALongRobot, IsRefusedWithTheLimit) {
  EXPECT_THROW(package_of<double>(chain(1, 101), {"arm", {GeneratedTask::mass}}), TooLarge);
  try {
    package_of<double>(chain(1, 90), {"arm", {GeneratedTask::inverse_mass}});
    ADD_FAILURE();
  } catch (const TooLarge& e) {
    EXPECT_NE(std::string(e.what()).find(std::to_string(most_generated_operations)),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace kalmarm::test

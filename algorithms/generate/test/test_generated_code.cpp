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

// The functions of a library by name.
class Library {
 public:
  explicit Library(const std::string& path) : handle_(dlopen(path.c_str(), RTLD_NOW)) {
    EXPECT_TRUE(handle_) << dlerror();
  }
  ~Library() { dlclose(handle_); }

  void* function(const std::string& name) const {
    void* const out = dlsym(handle_, name.c_str());
    EXPECT_TRUE(out) << name;
    return out;
  }

 private:
  void* handle_;
};

// A function of a library, of all these arrays; `given` stands before them.
template <std::size_t n = 0, class T, class... Given>
void call_with(void* function, const std::vector<T*>& arrays, Given... given) {
  if constexpr (n < 12) {
    if (n < arrays.size()) return call_with<n + 1>(function, arrays, given..., arrays[n]);
  }
  reinterpret_cast<void (*)(Given...)>(function)(given...);
}
template <class T>
void call(const Library& library, const std::string& name, const std::vector<T*>& arrays) {
  call_with(library.function(name), arrays);
}
template <class T>
void call_rows(const Library& library, const std::string& name, std::size_t rows,
               const std::vector<T*>& arrays) {
  call_with(library.function(name), arrays, rows);
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
      {body_on_the_base<&Builder::add_free>(1), {forward_dynamics, mass, derivatives}},
      {body_on_the_base<&Builder::add_ball>(1), {forward_dynamics, solve, implicit_step}},
      {slides(1), {inverse_dynamics, inverse_mass, judged_diagonal}},
      {chain(1, 3), {forward_dynamics, judged_implicit_step, mass, operational}}};
  constexpr int most = 37;
  // Inputs and results of `most` states, and a guard behind them.
  struct Array {
    int width;
    std::vector<T> x;

    T* row(int i) { return &x[i * width]; }
    auto first(int rows) const { return Eigen::Map<const VectorX<T>>(x.data(), rows * width); }
  };
  const auto rows_of = [](std::vector<Array>& arrays, int i) {
    std::vector<T*> out;
    for (Array& array : arrays) out.push_back(array.row(i));
    return out;
  };
  const auto all = [](std::vector<T*> x, const std::vector<T*>& y) {
    x.insert(x.end(), y.begin(), y.end());
    return x;
  };
  for (const Robot& robot : robots) {
    const Model<double>& model = robot.model;
    const int last = model.nv() - 1;
    const Package<T> package =
        package_of<T>(model, {.name = "arm",
                              .tasks = robot.tasks,
                              .rows = true,
                              .question = {.frames = {{last, {1, 0, 0, 0}, {0, 0, 1}}},
                                           .loaded = {{last, {1, 0, 0, 0}, {0, 1, 0}}}}});
    const Folder folder(package.files({}));
    ASSERT_TRUE(folder.compiles("arm", strict));
    ASSERT_TRUE(folder.compiles("arm_rows", of_rows));
    ASSERT_TRUE(folder.links("arm.so", "-shared arm.o arm_rows.o"));
    const Library library(folder / "arm.so");
    for (const TaskRecord& record : package.records()) {
      const std::string name = "arm_" + to_string(record.task);
      std::vector<Array> inputs, one, many;
      for (const Argument& input : record.inputs) {
        inputs.push_back({input.size, {}});
        for (int i = 0; i < most; ++i) {
          const State<double> state = random_state(model, i);
          VectorX<double> x =
              VectorX<double>::Constant(input.size, 0.25 + 0.01 * i);  // gains, loads
          if (input.name == "q") x = state.q;
          if (input.name == "qd") x = state.qd;
          if (input.name == "tau" || input.name == "qdd") x = state.tau;
          for (const double number : x) inputs.back().x.push_back(static_cast<T>(number));
        }
      }
      for (const Argument& output : record.outputs)
        one.push_back({output.size, std::vector<T>(most * output.size, T(NAN))});
      for (int i = 0; i < most; ++i) {
        call(library, name, all(rows_of(inputs, i), rows_of(one, i)));
        std::vector<T> given;
        for (Array& input : inputs)
          given.insert(given.end(), input.row(i), input.row(i) + input.width);
        const std::vector<T> expected = record.graph.template evaluate<T>(record.results, given);
        const T* next = expected.data();
        for (Array& output : one) {
          const auto x = Eigen::Map<const VectorX<T>>(output.row(i), output.width);
          const auto y = Eigen::Map<const VectorX<T>>(next, output.width);
          EXPECT_LE((x - y).norm(), (sizeof(T) == 4 ? T(1e-3) : T(1e-11)) * y.norm())
              << name << " " << i;
          next += output.width;
        }
      }
      for (const int rows : {1, 2, 3, 7, 8, 9, 16, 17, 33, most}) {
        many.clear();
        for (const Array& output : one)
          many.push_back({output.width, std::vector<T>(most * output.width + 64, T(-77))});
        call_rows(library, name + "_rows", rows, all(rows_of(inputs, 0), rows_of(many, 0)));
        for (std::size_t k = 0; k < many.size(); ++k) {
          const auto x = many[k].first(rows), y = one[k].first(rows);
          EXPECT_LE((x - y).norm(), (sizeof(T) == 4 ? T(1e-3) : T(1e-11)) * y.norm())
              << name << " of " << rows;
          for (std::size_t i = x.size(); i < many[k].x.size(); ++i)
            ASSERT_EQ(many[k].x[i], T(-77)) << name << " of " << rows << " writes behind its rows";
        }
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
  const T farthest = sizeof(T) == 4 ? T(1.2e4) : T(1.6e6);
  T zero = 0;
  for (T angle : {T(0), T(0.7), T(-1.6), T(3.2), T(99), -farthest, farthest, T(2) * farthest,
                  std::numeric_limits<T>::infinity(), T(NAN)}) {
    const bool is_far = !(std::abs(angle) <= farthest);
    State<double> state{VectorX<double>::Constant(1, angle), VectorX<double>::Zero(1),
                        VectorX<double>::Zero(1)};
    for (const char* suffix : {"", "_rows"}) {
      VectorX<T> tau = poisoned<T>(1);
      const std::string name = std::string("arm_inverse_dynamics") + suffix;
      if (*suffix)
        call_rows<T>(library, name, 1, {&angle, &zero, &zero, tau.data()});
      else
        call<T>(library, name, {&angle, &zero, &zero, tau.data()});
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
  TaskCheck check{GeneratedTask::mass, {list(state.q)}, {{list(M.reshaped()), 1e-13}}};
  for (const bool is_right : {true, false}) {
    if (!is_right) check.results[0].truth[4] *= 1 + 1e-10;
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

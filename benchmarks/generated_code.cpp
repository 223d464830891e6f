#include "benchmarks/generated_code.hpp"

#include "algorithms/generate/compiled_task.hpp"

namespace kalmarm {
namespace {

template <class T>
Package<T> package_of(const GeneratedVariant& variant, GeneratedTask task, const Model<T>& model) {
  const Model<double> exact = model.template cast<double>();
  return {exact,
          std::vector<double>(model.nq(), 0.0),
          {.name = "robot", .tasks = {}, .rows = true},
          {variant.record(task, exact)}};
}

template <class T>
CLibrary made_of(const Package<T>& package) {
  auto files = package.files({});
  files.erase("robot.md");
  files.erase("robot_test.c");
  return make_library(files, compiler_of({}), folder_of({}));
}

}  // namespace

template <class T>
GeneratedCode<T>::GeneratedCode(const GeneratedVariant& variant, GeneratedTask task,
                                const Model<T>& model)
    : GeneratedCode(package_of(variant, task, model)) {}

template <class T>
GeneratedCode<T>::GeneratedCode(const Package<T>& package) : library_(made_of(package)) {
  const TaskRecord& record = package.records()[0];
  const std::string name = "robot_" + to_string(record.task), rows = name + "_rows";
  flops_ = record.graph.count(record.results).flops();
  if (record.task == GeneratedTask::inverse_mass) {
    X_ = library_.function<void(const T*, T*)>(name);
    X_rows_ = library_.function<void(std::size_t, const T*, T*)>(rows);
  } else {
    a_ = library_.function<void(const T*, const T*, const T*, T*)>(name);
    a_rows_ = library_.function<void(std::size_t, const T*, const T*, const T*, T*)>(rows);
  }
}

template class GeneratedCode<float>;
template class GeneratedCode<double>;

}  // namespace kalmarm

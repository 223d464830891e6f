// simulate: what the random model's covariances are worth when they are sampled. CSV, one
// measurement a row:
//   scene,n,quantity,method,samples,replica,error,seconds,threads
// error: relative Frobenius error against the reference in multi-precision. The robot stands in the
// first random state of seed 1, whatever the seed of the samples.
//
// A sampler's row has the error and the seconds after that many samples of a replica, the samples
// of the rows before included. phi, M, W, H and the filter's gains are given, and memory is taken
// before, but for the sums that threads add up.
//
// SigmaPoints and Recursion are exact and have one row a quantity, on one thread; calls are
// repeated for at least 10 ms, and seconds are those of one. Recursion starts from phi, M, W and H,
// and takes M from mass_matrix.hpp, the others from covariances.hpp and covariance_analysis.hpp.
#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/simulation/reference.hpp"
#include "accuracy/simulation/sample_covariance.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/estimation/covariance_analysis.hpp"
#include "algorithms/study/estimation/operators.hpp"

namespace kalmarm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr unsigned digits = 60;  // of the reference
constexpr std::chrono::milliseconds shortest{10};

const std::vector<std::pair<std::string, Quantity>> quantities{
    {"M", Quantity::M}, {"P", Quantity::P}, {"D", Quantity::D}, {"Lambda", Quantity::Lambda}};

std::vector<std::string> quantity_names() {
  std::vector<std::string> names;
  names.reserve(quantities.size());
  for (const auto& [name, quantity] : quantities) names.push_back(name);
  return names;
}

std::vector<std::string> method_names() {
  std::vector<std::string> names{"Recursion", "SigmaPoints"};
  for (const std::string& name : sampler_names()) names.push_back(name);
  return names;
}

struct Options {
  std::vector<std::string> methods = method_names(), quantities = quantity_names();
  std::int64_t samples = 65536;
  int replicas = 8;
  std::uint64_t seed = 1;
  int threads = 1;
};

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// Of one call.
double timed(const std::function<void()>& call) {
  const Clock::time_point start = Clock::now();
  int calls = 0;
  do {
    call();
    ++calls;
  } while (Clock::now() - start < shortest);
  return seconds_since(start) / calls;
}

// The robot in its state.
struct Robot {
  const Scene& scene;
  VectorX<double> q;
  LinkKinematics<double> kin;
  Process<double> process;
  Covariances<double> cov;

  explicit Robot(const Scene& of)
      : scene(of), q(random_states(of, 1, 1)[0].q), kin(of.model), process(at(q)), cov(process) {
    if (const Outcome outcome = set_state_covariances(process, cov); !outcome)
      throw InputError("scene '" + scene.name + "': singular mechanism: joint '" +
                       scene.model.name(outcome.joint) + "' moves no inertia, D = " +
                       number(outcome.D) + " of a scale of " + number(outcome.scale));
  }

  // The covariance by recursion, to be called again and again.
  std::function<void(MatrixX<double>&)> recursion(Quantity quantity) {
    switch (quantity) {
      case Quantity::M:
        return [this, ws = CompositeInertia<double>(scene.model)](MatrixX<double>& C) mutable {
          mass_matrix(scene.model, kin, ws, Eigen::Ref<MatrixX<double>>(C));
        };
      case Quantity::P:
        return [this](MatrixX<double>& C) {
          (void)set_state_covariances(process, cov);  // as in the constructor
          state_error_covariance(process, cov, C);
        };
      case Quantity::D:
        return [this](MatrixX<double>& C) {
          (void)set_state_covariances(process, cov);
          C.setZero();
          for (int k = 0; k < process.size(); ++k) C(k, k) = cov.D[k];
        };
      default:
        return [this](MatrixX<double>& C) {
          (void)set_state_covariances(process, cov);
          set_co_state_covariances(process, cov);
          co_state_covariance(process, cov, C);
        };
    }
  }

 private:
  Process<double> at(const VectorX<double>& position) {
    set_position(scene.model, position, kin);
    set_velocity(scene.model, VectorX<double>(VectorX<double>::Zero(scene.model.nv())), kin);
    return {scene.model, kin};
  }
};

class Table {
 public:
  explicit Table(const Scene& scene)
      : scene_(field(scene.name) + ',' + std::to_string(scene.model.nv()) + ',') {}

  void add(const std::string& quantity, const std::string& method, std::int64_t samples,
           int replica, double error, double seconds, int threads) {
    text_ += scene_ + quantity + ',' + method + ',' + std::to_string(samples) + ',' +
             std::to_string(replica) + ',' + number(error) + ',' + number(seconds) + ',' +
             std::to_string(threads) + '\n';
  }

  const std::string& text() const { return text_; }

 private:
  std::string scene_;
  std::string text_ = "scene,n,quantity,method,samples,replica,error,seconds,threads\n";
};

std::string run(const Scene& scene, const Options& options) {
  Robot robot(scene);
  const Simulation<double> simulation(robot.process, robot.cov);
  const Reference exact_values = [&] {
    const Digits precision(digits);
    return reference(scene.model.cast<Real>(), robot.q.cast<Real>());
  }();
  SamplerThreads threads(options.threads);
  Table table(scene);
  const auto exact_methods = std::ranges::count_if(options.methods, [](const std::string& method) {
    return method == "Recursion" || method == "SigmaPoints";
  });
  const auto samplers = static_cast<int>(options.methods.size() - exact_methods);
  Progress progress(static_cast<int>(options.quantities.size()) * samplers * options.replicas);
  for (const auto& entry : quantities) {
    const std::string& name = entry.first;
    const Quantity quantity = entry.second;
    if (std::ranges::count(options.quantities, name) == 0) continue;
    const Exact exact(exact_values[quantity]);
    MatrixX<double> C(simulation.size(quantity), simulation.size(quantity));
    for (const std::string& method : options.methods) {
      if (method == "Recursion") {
        const auto recursion = robot.recursion(quantity);
        const double seconds = timed([&] { recursion(C); });
        table.add(name, method, 0, 0, relative_error(C, exact), seconds, 1);
        continue;
      }
      if (method == "SigmaPoints") {
        const double seconds = timed([&] { C = sigma_point_covariance(simulation, quantity); });
        table.add(name, method, simulation.dimension, 0, relative_error(C, exact), seconds, 1);
        continue;
      }
      for (int replica = 0; replica < options.replicas; ++replica) {
        progress.step(scene.name);
        const auto sampler = make_sampler(method, simulation.dimension, options.seed, replica);
        SampleCovariance covariance(simulation, quantity, *sampler, threads);
        double seconds = 0;
        for (std::int64_t n = SampleCovariance::block; n <= options.samples; n *= 2) {
          const Clock::time_point start = Clock::now();
          covariance.grow(n);
          C = covariance.value();
          seconds += seconds_since(start);
          table.add(name, method, n, replica, relative_error(C, exact), seconds, options.threads);
        }
      }
    }
  }
  return table.text();
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("Error of sampled covariances of the random model against sample count, as CSV",
               "simulate");
  std::string name, out;
  LoadOptions read;
  Options options;
  add_scene(app, name, read)->required();
  app.add_option("--method", options.methods, "which to run")
      ->check(CLI::IsMember(method_names()))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--quantity", options.quantities, "whose covariance")
      ->check(CLI::IsMember(quantity_names()))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  app.add_option("--samples", options.samples, "64, 128, … up to so many")
      ->check(between(std::int64_t{SampleCovariance::block}, std::int64_t{1} << 32))
      ->capture_default_str();
  app.add_option("--replicas", options.replicas, "independent repetitions of every sampler")
      ->check(between(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the samples")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--threads", options.threads, "of the samplers")
      ->check(between(1, 1024))
      ->capture_default_str();
  app.add_option("--out", out, "CSV file to write")->required();

  return run_program(app, argc, argv, [&] {
    const Scene scene = open_scene(name, read);
    if (const int nv = scene.model.nv(); nv > largest_dense)
      throw InputError("scene '" + name + "' has " + std::to_string(nv) +
                       " degrees of freedom; covariances of 6n rows are sampled up to n = " +
                       std::to_string(largest_dense));
    OutputFile file(out);
    file.write(run(scene, options));
    return 0;
  });
}

#include "accuracy/scan/scan_errors.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <limits>

#include "accuracy/programs/common/csv.hpp"
#include "algorithms/study/inverse_mass/refinement/wide_refined.hpp"
#include "algorithms/study/scan/divide_and_conquer.hpp"
#include "algorithms/study/scan/scan.hpp"
#include "algorithms/study/scan/square_root_element.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::scan_errors {
namespace {

constexpr scan::Order orders[] = {scan::Order::balanced, scan::Order::tips_first,
                                  scan::Order::base_first};

constexpr const char* name_of(scan::Order order) {
  switch (order) {
    case scan::Order::balanced:
      return "balanced";
    case scan::Order::tips_first:
      return "tips_first";
    case scan::Order::base_first:
      return "base_first";
  }
  return "";
}

using Exact = FixedReal<100>;

template <class T>
struct Task {
  VectorX<T> tau, qd;
  bool gravity;
};

template <class T>
class Table {
 public:
  Table(const stress::Case& c, std::uint64_t seed, std::string begin)
      : begin_(std::move(begin)),
        model_(c.model.cast<T>()),
        weightless_(model_),
        kin_(model_),
        q_(c.q.cast<T>()) {
    weightless_.set_gravity(Vector3<T>::Zero());
    boost::random::mt19937_64 random(seed);
    boost::random::normal_distribution<double> normal;
    const auto draw = [&] {
      VectorX<T> x(model_.nv());
      for (T& entry : x) entry = T(normal(random));
      return x;
    };
    const VectorX<T> zero = VectorX<T>::Zero(model_.nv());
    tasks_ = {{draw(), zero, false}, {draw(), c.qd.cast<T>(), true}};
    set_truth();
  }

  std::string text() const { return text_; }

  // A variant without blocks.
  template <class V>
  void add() {
    add<V>([](const Model<T>& model) { return typename V::template Workspace<T>(model); },
           ",0,,0,0");
  }

  template <bool projected>
  void add_divide_and_conquer() {
    using V = DivideAndConquer<projected>;
    if (!V::applies(model_)) return;
    for (const scan::Order order : orders) {
      const auto make = [&](const Model<T>& model) {
        return typename V::template Workspace<T>(model, order);
      };
      add<V>(make, std::string(",1,") + name_of(order) + ',' +
                       std::to_string(make(model_).depth()) + ",0");
    }
  }

  template <class Form>
  void add_scans(const std::vector<int>& links) {
    using V = Scan<Form>;
    for (const int count : links)
      for (const scan::Order order : orders)
        add<V>(
            [&](const Model<T>& model) {
              return typename V::template Workspace<T>(model,
                                                       {.links_of_block = count, .order = order});
            },
            ',' + std::to_string(count) + ',' + name_of(order));
  }

 private:
  // By the sequential filter in 100 digits.
  void set_truth() {
    using Filter = Sequential<ArrayGivens>;
    const Model<Exact> model = model_.template cast<Exact>();
    LinkKinematics<Exact> kin(model);
    typename Filter::template Workspace<Exact> ws(model);
    VectorX<Exact> a(model.nv());
    for (const Task<T>& task : tasks_) {
      Model<Exact> falling = model;
      if (!task.gravity) falling.set_gravity(Vector3<Exact>::Zero());
      set_position(falling, VectorX<Exact>(q_.template cast<Exact>()), kin);
      set_velocity(falling, VectorX<Exact>(task.qd.template cast<Exact>()), kin);
      truth_ = Filter::factor(falling, kin, ws);
      if (!truth_) return;
      Filter::acceleration(falling, kin, VectorX<Exact>(task.tau.template cast<Exact>()), ws, a);
      a_.push_back(a.template cast<long double>());
    }
  }

  // A workspace is made for every task: some hold the model, and with it gravity.
  template <class V, class Make>
  void add(const Make& make, const std::string& of_variant) {
    for (std::size_t i = 0; i < tasks_.size(); ++i) {
      const Task<T>& task = tasks_[i];
      const Model<T>& model = task.gravity ? model_ : weightless_;
      auto ws = make(model);
      set_position(model, q_, kin_);
      set_velocity(model, task.qd, kin_);
      VectorX<T> a = VectorX<T>::Constant(model.nv(), std::numeric_limits<T>::quiet_NaN());
      const Outcome outcome = V::factor(model, kin_, ws);
      if (outcome) V::acceleration(model, kin_, task.tau, ws, a);
      text_ += begin_ + (task.gravity ? "dynamics," : "random,") + field(V::name()) + of_variant;
      if constexpr (requires { ws.blocks; })
        text_ += ',' + std::to_string(ws.blocks.depth()) + ',' + number(forgetting(ws));
      text_ += std::string(",") + to_string(outcome.status) + ',' +
               (outcome && truth_ ? number(error(a, i)) : "") + '\n';
    }
  }

  template <class Workspace>
  static double forgetting(const Workspace& ws) {
    double open = 0, forget = 0;
    for (const scan::Block& block : ws.blocks.blocks())
      if (block.open()) ++open, forget += ws.runs[block.node].closed;
    return open > 0 ? forget / open : 0;
  }

  double error(const VectorX<T>& a, std::size_t task) const {
    return static_cast<double>((a.template cast<long double>() - a_[task]).norm() /
                               a_[task].norm());
  }

  std::string begin_, text_;
  Model<T> model_, weightless_;
  LinkKinematics<T> kin_;
  VectorX<T> q_;
  std::vector<Task<T>> tasks_;
  Outcome truth_;
  std::vector<VectorX<long double>> a_;  // of the tasks
};

template <class T>
std::string rows_of(const stress::Case& c, std::uint64_t seed, const std::string& begin,
                    const std::vector<int>& links) {
  Table<T> table(c, seed, begin);
  table.template add<Sequential<Conventional>>();
  table.template add<Sequential<ArrayGivens>>();
  table.template add_scans<scan::Conventional>(links);
  table.template add_scans<scan::SquareRoot>(links);
  table.template add_divide_and_conquer<false>();
  table.template add_divide_and_conquer<true>();
  table.template add<WideRefined<Scan<scan::Conventional>>>();
  table.template add<WideRefined<Scan<scan::SquareRoot>>>();
  return table.text();
}

}  // namespace

std::string rows(const stress::Family& family, double value, std::uint64_t seed,
                 const std::string& precision, const std::vector<int>& links) {
  const stress::Case c = family.make(value, seed);
  const std::string begin = field(family.name) + ',' + number(value) + ',' +
                            std::to_string(c.model.nv()) + ',' + std::to_string(seed) + ',' +
                            precision + ',';
  return precision == "float32" ? rows_of<float>(c, seed, begin, links)
                                : rows_of<double>(c, seed, begin, links);
}

}  // namespace kalmarm::scan_errors

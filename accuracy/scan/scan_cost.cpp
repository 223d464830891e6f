#include "accuracy/scan/scan_cost.hpp"

#include <limits>

#include "accuracy/programs/common/csv.hpp"
#include "algorithms/study/scan/counting.hpp"
#include "algorithms/study/scan/scan.hpp"
#include "algorithms/study/scan/square_root_element.hpp"

namespace kalmarm::scan_cost {
namespace {

constexpr double processors[] = {1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 10000};

class Counted {
 public:
  Counted(const stress::Case& c, std::string begin)
      : begin_(std::move(begin)), model_(c.model.cast<Count>()), kin_(model_) {
    set_position(model_, c.q.cast<Count>(), kin_);
    set_velocity(model_, c.qd.cast<Count>(), kin_);
  }

  std::string text() const { return text_; }

  template <class V>
  void add_sequential() {
    typename V::template Workspace<Count> ws(model_);
    VectorX<Count> tau = VectorX<Count>::Ones(model_.nv()), a(model_.nv());
    const long start = Count::flops;
    if (!V::factor(model_, kin_, ws)) return;
    const long factored = Count::flops;
    V::acceleration(model_, kin_, tau, ws, a);
    add("factor", V::name(), 0, 0, 1, static_cast<double>(factored - start));
    add("acceleration", V::name(), 0, 0, 1, static_cast<double>(Count::flops - factored));
  }

  template <class Form>
  void add_scan(int links) {
    using V = Scan<Form>;
    typename V::template Workspace<Count> ws(model_, {.links_of_block = links});
    VectorX<Count> tau = VectorX<Count>::Ones(model_.nv()), a(model_.nv());
    const auto add_phases = [&](const char* task) {
      for (const double p : processors)
        add(task, V::name(), links, ws.blocks.depth(), p, scan::flops_on(ws.tasks.phases, p));
      add(task, V::name(), links, ws.blocks.depth(), 0,
          scan::flops_on(ws.tasks.phases, std::numeric_limits<double>::infinity()));
      ws.tasks.phases.clear();
    };
    if (!V::factor(model_, kin_, ws)) return;
    add_phases("factor");
    V::acceleration(model_, kin_, tau, ws, a);
    add_phases("acceleration");
  }

 private:
  void add(const char* task, const std::string& variant, int links, int depth, double p,
           double flops) {
    text_ += begin_ + task + ',' + field(variant) + ',' + std::to_string(links) + ',' +
             std::to_string(depth) + ',' + number(p) + ',' + number(flops) + '\n';
  }

  std::string begin_, text_;
  Model<Count> model_;
  LinkKinematics<Count> kin_;
};

}  // namespace

std::string rows(const stress::Family& family, double value, std::uint64_t seed,
                 const std::vector<int>& links) {
  const stress::Case c = family.make(value, seed);
  Counted counted(c, field(family.name) + ',' + number(value) + ',' + std::to_string(c.model.nv()) +
                         ',' + std::to_string(seed) + ',');
  counted.add_sequential<Sequential<Conventional>>();
  counted.add_sequential<Sequential<ArrayGivens>>();
  for (const int count : links) {
    counted.add_scan<scan::Conventional>(count);
    counted.add_scan<scan::SquareRoot>(count);
  }
  return counted.text();
}

}  // namespace kalmarm::scan_cost

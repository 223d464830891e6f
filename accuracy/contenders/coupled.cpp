#include "accuracy/contenders/coupled.hpp"

#include <algorithm>
#include <utility>

#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

VectorX<double> vector_of(const json& from) {
  const auto numbers = from.get<std::vector<double>>();
  return Eigen::Map<const VectorX<double>>(numbers.data(), static_cast<int>(numbers.size()));
}

MatrixX<double> matrix_of(const json& from) {
  const int n = static_cast<int>(from.size());
  MatrixX<double> out(n, n);
  for (int i = 0; i < n; ++i) out.row(i) = vector_of(from[i]).transpose();
  return out;
}

json to_json(const VectorX<double>& x) { return std::vector<double>(x.begin(), x.end()); }

json to_json(const MatrixX<double>& X) {
  json out = json::array();
  for (int i = 0; i < X.rows(); ++i) out.push_back(to_json(VectorX<double>(X.row(i))));
  return out;
}

bool wants(const QuestionOptions& asked, const char* what) {
  return std::find(asked.want.begin(), asked.want.end(), what) != asked.want.end();
}

}  // namespace

QuestionOptions uncoupled(const QuestionOptions& asked) {
  for (const std::string& want : asked.want)
    if (want != "mass" && want != "inverse" && want != "acceleration")
      throw InputError("--impose-couplings gives mass, inverse and acceleration, no " + want);
  if (asked.selects())
    throw InputError("--impose-couplings is of the whole robot: no --dofs, --locked or --free");
  QuestionOptions out = asked;
  if (wants(asked, "acceleration") && !wants(asked, "inverse")) out.want.push_back("inverse");
  return out;
}

Evaluator coupled(Evaluator free, const Couplings& couplings, const QuestionOptions& asked) {
  return [free = std::move(free), &couplings, asked](const State& state) {
    Result out = free(state);
    if (!out.outcome) return out;
    json& entry = out.entry;
    if (wants(asked, "mass")) entry["mass"] = to_json(couplings.mass(matrix_of(entry["mass"])));
    if (wants(asked, "acceleration"))
      entry["acceleration"] = to_json(
          couplings.acceleration(matrix_of(entry["inverse"]), vector_of(entry["acceleration"])));
    if (wants(asked, "inverse"))
      entry["inverse"] = to_json(couplings.inverse(matrix_of(entry["inverse"])));
    else
      entry.erase("inverse");
    return out;
  };
}

}  // namespace kalmarm

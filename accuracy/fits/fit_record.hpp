// A fit in JSON (docs/data-formats.md, identify-*.json), and in a few lines for people.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "accuracy/fits/identification.hpp"

namespace kalmarm {

inline const std::map<std::string, Residual> residuals{
    {"inverse_dynamics", Residual::inverse_dynamics},
    {"forward_dynamics", Residual::forward_dynamics},
    {"innovations", Residual::innovations},
    {"mass_matrix", Residual::mass_matrix},
    {"likelihood", Residual::likelihood}};
inline const std::map<std::string, Differentiation> differentiations{
    {"analytic", Differentiation::analytic},
    {"automatic", Differentiation::automatic},
    {"numeric", Differentiation::numeric}};

nlohmann::json record_of(const Identification& done, const IdentificationOptions& options);

// To standard output.
void print_record(const nlohmann::json& record);

}  // namespace kalmarm

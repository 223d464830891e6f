#include "accuracy/adversary/rounds.hpp"

#include <cctype>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "accuracy/adversary/search_json.hpp"
#include "accuracy/programs/common/digest.hpp"
#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/json_file.hpp"

namespace kalmarm::adversary {
namespace {

using nlohmann::json;

constexpr std::size_t most_rounds = 200'000;  // their evaluations are counted in an int

constexpr const char *format = "kalmarm-rounds-1", *digest_begin = "\"digest\":\"";

// With the digest of all the rest, which shows a change.
std::string sealed(json document) {
  document["format"] = format;
  document["digest"] = hex(digest_of(document.dump()));
  return document.dump();
}

// The reverse. Throws where the text is none of sealed().
json unsealed(const std::string& text) {
  const std::size_t begin = text.find(digest_begin);
  if (begin == std::string::npos) throw InputError("is not whole, or not of this program");
  const std::size_t length = std::strlen(digest_begin) + 2 * sizeof(Digest) + std::strlen("\",");
  const std::string rest = std::string(text).erase(begin, length);
  if (text.substr(begin, length) != digest_begin + hex(digest_of(rest)) + "\",")
    throw InputError("has been changed since it was written");
  json document = parsed_json(rest);
  if (document.at("format") != format) throw InputError("is of another version");
  document.erase("format");
  return document;
}

// log10 of an error, of which the judge's largest is 1e300.
double value_of(const json& value) {
  const double out = finite_number(value, "value");
  if (out > 300) throw InputError("value is above 300");
  return out;
}

// As the search makes them (search.hpp).
Round round_of(const json& entry) {
  constexpr int most = 10'000;  // evaluations of a round: ten times the usual number
  Round out;
  out.best = genome_of(entry);
  out.value = value_of(entry.at("value"));
  out.evaluations = count_of(entry.at("evaluations"), "evaluations", 1, most);
  for (const json& point : entry.at("curve")) {
    if (!point.is_array() || point.size() != 2) throw InputError("a curve is not of pairs");
    out.curve.emplace_back(count_of(point[0], "evaluations", 0, out.evaluations),
                           value_of(point[1]));
  }
  return out;
}

}  // namespace

std::string Asked::slug() const {
  std::string name = of.variant + '-' + of.precision, out;
  if (of.task != Want::acceleration) name += std::string("-") + to_string(of.task);
  if (of.goal != Goal::error) name += std::string("-") + to_string(of.goal);
  if (of.kernel != Kernel::spatial) name += std::string("-") + to_string(of.kernel);
  if (of.rows) name += "-rows";
  name += std::string("-") + method() + '-' + std::to_string(seed);
  for (const char c : name)
    if (std::isalnum(static_cast<unsigned char>(c)))
      out += c;
    else if (!out.ends_with('-'))
      out += '-';
  return out;
}

std::string to_json(const Asked& asked, const std::vector<Round>& rounds) {
  json out = asked_json(asked);
  out["rounds"] = json::array();
  for (const Round& round : rounds)
    out["rounds"].push_back({{"bodies", round.best.bodies},
                             {"x", round.best.x},
                             {"value", round.value},
                             {"evaluations", round.evaluations},
                             {"curve", round.curve}});
  return sealed(std::move(out)) + '\n';
}

std::vector<Round> read_rounds(const std::string& path, const Asked& asked) {
  std::vector<Round> out;
  if (!is_there(path)) return out;
  std::string text = read_text(path);
  if (text.ends_with('\n')) text.pop_back();
  try {
    json document = unsealed(text);
    const json rounds = document.at("rounds");
    document.erase("rounds");
    if (document != asked_json(asked)) throw InputError("is of another search");
    if (rounds.size() > most_rounds) throw InputError("too many rounds");
    for (const json& entry : rounds) out.push_back(round_of(entry));
  } catch (const std::exception& e) {
    throw InputError(path + ": cannot be resumed: " + e.what());
  }
  return out;
}

}  // namespace kalmarm::adversary

// adversary --resume: what is read are rounds from which the search can go on, and which are
// written as they were read.
//
// The digest of a mutated file is mostly made right again, or all of them would be refused for it.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "accuracy/adversary/rounds.hpp"
#include "accuracy/programs/common/digest.hpp"
#include "robots/loader/test/fuzz/reader.hpp"

namespace kalmarm::adversary {
namespace {

const Asked asked{{"Sequential<UD>", "float32"}, 1};  // of the seeds

std::string with_right_digest(std::string text) {
  if (text.ends_with('\n')) text.pop_back();
  const std::string begin = "\"digest\":\"", end = "\",";
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return text;
  text.erase(at, begin.size() + 2 * sizeof(Digest) + end.size());
  return text.insert(at, begin + hex(digest_of(text)) + end);
}

void expect_finite(const Mechanism& mechanism) {
  const State& state = mechanism.state;
  expect(state.q.allFinite() && state.qd.allFinite() && state.tau.allFinite(), "a state");
  for (int k = 0; k < mechanism.model.nv(); ++k) {
    const Joint<double>& joint = mechanism.model.joint(k);
    expect(joint.translation.allFinite() && joint.rotation.coeffs().allFinite(), "a joint");
    expect(std::isfinite(joint.r) && std::isfinite(joint.body.mass), "a mass");
    expect(joint.body.com.allFinite() && joint.body.moments.allFinite(), "moments");
  }
}

bool equal(const Round& a, const Round& b) {
  return a.best.bodies == b.best.bodies && a.best.x == b.best.x && a.value == b.value &&
         a.evaluations == b.evaluations && a.curve == b.curve;
}

void expect_rounds(const std::string& path) {
  const std::vector<Round> rounds = read_rounds(path, asked);
  for (const Round& round : rounds) {
    expect(std::isfinite(std::pow(10, round.value)), "a value");
    expect(round.evaluations > 0, "evaluations");
    for (const auto& [evaluations, value] : round.curve)
      expect(evaluations >= 0 && evaluations <= round.evaluations &&
                 std::isfinite(std::pow(10, value)),
             "a curve");
    expect_finite(decode(round.best));
  }
  const TemporaryFile written(to_json(asked, rounds), ".json");
  const std::vector<Round> again = read_rounds(written.path(), asked);
  expect(std::equal(rounds.begin(), rounds.end(), again.begin(), again.end(), equal),
         "written as others");
}

}  // namespace
}  // namespace kalmarm::adversary

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  size = LLVMFuzzerMutate(data, size, most);
  if (seed % 4 == 0) return size;
  const std::string text =
      kalmarm::adversary::with_right_digest(std::string(reinterpret_cast<const char*>(data), size));
  if (text.size() > most) return size;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  return fuzz_reader(data, size, ".json", adversary::expect_rounds);
}

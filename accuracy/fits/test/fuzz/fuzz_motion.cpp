// identify --data: what is read are finite numbers in rising time, of the robot's sizes.
#include <cmath>

#include "accuracy/fits/samples.hpp"
#include "robots/loader/test/fuzz/reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  static const Scene scene = load_scene(TemporaryFile(small_robot, ".xml").path());
  return fuzz_reader(data, size, ".csv", [](const std::string& path) {
    const Samples read = read_samples(scene, path);
    const int count = read.count();
    expect(count >= 2 && read.q.cols() == count && read.tau.cols() == count, "other counts");
    expect(read.q.rows() == 5 && read.tau.rows() == 4, "other sizes");
    for (const MatrixX<double>* part : {&read.q, &read.qd, &read.qdd, &read.tau})
      expect(part->allFinite(), "not finite");
    for (int i = 0; i < count; ++i) {
      expect(i == 0 || read.time[i] > read.time[i - 1], "time does not rise");
      expect(std::abs(read.q.col(i).head<4>().norm() - 1) < 1e-8, "a quaternion of another length");
    }
  });
}

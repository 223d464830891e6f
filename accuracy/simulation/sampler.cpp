#include "accuracy/simulation/sampler.hpp"

#include <boost/random/sobol.hpp>

#include "accuracy/simulation/normal.hpp"

namespace kalmarm {
namespace {

using Normals = Eigen::Ref<MatrixX<double>>;

class MonteCarlo : public Sampler {
 public:
  explicit MonteCarlo(const PhiloxKey& key) : key_(key) {}

  void fill(std::uint64_t first, Normals normals) const override {
    for (Eigen::Index c = 0; c < normals.cols(); ++c) {
      Words bits;
      for (Eigen::Index i = 0; i < normals.rows(); ++i) {
        if (i % 4 == 0) bits = bits_at(key_, first + c, i / 4, Stream::normals);
        normals(i, c) = normal(bits[i % 4]);
      }
    }
  }

 private:
  PhiloxKey key_;
};

class Antithetic : public Sampler {
 public:
  explicit Antithetic(const PhiloxKey& key) : half_(key) {}

  void fill(std::uint64_t first, Normals normals) const override {
    for (Eigen::Index c = 0; c < normals.cols(); ++c) {
      const std::uint64_t sample = first + c;
      const bool second = sample % 2 == 1;
      if (second && c > 0) {
        normals.col(c) = -normals.col(c - 1);
      } else {
        half_.fill(sample / 2, normals.col(c));
        if (second) normals.col(c) *= -1;
      }
    }
  }

 private:
  MonteCarlo half_;
};

class QuasiMonteCarlo : public Sampler {
 public:
  QuasiMonteCarlo(int dimension, const PhiloxKey& key) : sobol_(dimension), shift_(dimension) {
    for (int i = 0; i < dimension; ++i) shift_[i] = bits_at(key, 0, i / 4, Stream::shift)[i % 4];
  }

  void fill(std::uint64_t first, Normals normals) const override {
    boost::random::sobol sobol = sobol_;   // drawing from it changes it
    if (first > 0) sobol.seed(first - 1);  // Boost's begins after the origin
    for (Eigen::Index c = 0; c < normals.cols(); ++c) {
      const bool origin = first + c == 0;
      for (Eigen::Index i = 0; i < normals.rows(); ++i)
        normals(i, c) = normal((origin ? 0 : sobol()) ^ shift_[i]);
    }
  }

 private:
  const boost::random::sobol sobol_;
  std::vector<std::uint64_t> shift_;
};

}  // namespace

std::vector<std::string> sampler_names() { return {"MonteCarlo", "Antithetic", "QuasiMonteCarlo"}; }

std::unique_ptr<Sampler> make_sampler(const std::string& name, int dimension, std::uint64_t seed,
                                      std::uint64_t replica) {
  const PhiloxKey key{seed, replica};
  if (name == "MonteCarlo") return std::make_unique<MonteCarlo>(key);
  if (name == "Antithetic") return std::make_unique<Antithetic>(key);
  if (name == "QuasiMonteCarlo") return std::make_unique<QuasiMonteCarlo>(dimension, key);
  return nullptr;
}

}  // namespace kalmarm

// Where the normal numbers of a sample come from. Every sample is a function of the seed, the
// replica and its index alone: it does not matter which are drawn, in which order, by which thread.
//
//   MonteCarlo       independent samples, from Philox.
//   Antithetic       samples 2i and 2i + 1 are xi and -xi, which makes the mean of any linear
//                    quantity exact. The mean is known here, and y y* is the same for both: of the
//                    second moments the pair says what one sample says. At equal numbers of samples
//                    the error is sqrt(2) times that of MonteCarlo.
//   QuasiMonteCarlo  Sobol points, the origin first, directions of Joe and Kuo (2008). A replica
//                    shifts them all by the same random bits (exclusive or: a digital shift): 2^m
//                    points stay evenly spread, the estimate is without bias, and replicas are
//                    independent of each other, so that their scatter is the error's.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

class Sampler {
 public:
  virtual ~Sampler() = default;

  // Samples first, first + 1, …: one a column, every entry of it. Threads may share a sampler.
  virtual void fill(std::uint64_t first, Eigen::Ref<MatrixX<double>> normals) const = 0;
};

// Names of the three, in the order above.
std::vector<std::string> sampler_names();

// Null where there is none of that name. dimension: normal numbers of a sample, up to 3667.
std::unique_ptr<Sampler> make_sampler(const std::string& name, int dimension, std::uint64_t seed,
                                      std::uint64_t replica);

}  // namespace kalmarm

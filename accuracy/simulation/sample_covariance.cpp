#include "accuracy/simulation/sample_covariance.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cassert>

namespace kalmarm {

// Of y y* over a range of blocks; lower triangle.
struct SampleCovariance::Sum {
  SampleCovariance& owner;
  MatrixX<double> C;

  explicit Sum(SampleCovariance& of)
      : owner(of), C(MatrixX<double>::Zero(of.sum_.rows(), of.sum_.cols())) {}
  Sum(const Sum& other, tbb::split) : Sum(other.owner) {}

  void operator()(const tbb::blocked_range<std::int64_t>& blocks) {
    auto& [normals, y, sample] = owner.workspaces_.local();
    for (std::int64_t i = blocks.begin(); i < blocks.end(); ++i) {
      owner.sampler_.fill(i * block, normals);
      for (int c = 0; c < block; ++c)
        observe(owner.simulation_, owner.quantity_, normals.col(c), sample,
                Eigen::Ref<VectorX<double>>(y.col(c)));
      C.selfadjointView<Eigen::Lower>().rankUpdate(y);
    }
  }

  void join(const Sum& right) { C += right.C; }
};

SampleCovariance::SampleCovariance(const Simulation<double>& simulation, Quantity quantity,
                                   const Sampler& sampler, SamplerThreads& threads)
    : simulation_(simulation),
      quantity_(quantity),
      sampler_(sampler),
      threads_(threads),
      workspaces_([&simulation, size = simulation.size(quantity)] {
        return Workspace{MatrixX<double>(simulation.dimension, block), MatrixX<double>(size, block),
                         Sample<double>(simulation)};
      }),
      sum_(MatrixX<double>::Zero(simulation.size(quantity), simulation.size(quantity))) {
  threads_.run([&] { workspaces_.local(); });
}

void SampleCovariance::grow(std::int64_t samples) {
  assert(samples % block == 0 && samples >= samples_);
  Sum more(*this);
  const tbb::blocked_range<std::int64_t> blocks(samples_ / block, samples / block);
  threads_.run([&] { tbb::parallel_deterministic_reduce(blocks, more); });
  sum_ += more.C;
  samples_ = samples;
}

MatrixX<double> SampleCovariance::value() const {
  return MatrixX<double>(sum_.selfadjointView<Eigen::Lower>()) / static_cast<double>(samples_);
}

}  // namespace kalmarm

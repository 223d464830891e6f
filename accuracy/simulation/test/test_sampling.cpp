// Where the samples come from, and how wrong their covariance is.
#include <cmath>
#include <limits>

#include "accuracy/simulation/normal.hpp"
#include "accuracy/simulation/sample_covariance.hpp"
#include "accuracy/simulation/test/robot.hpp"

namespace kalmarm::test {
namespace {

MatrixX<double> sampled(const Robot<double>& robot, Quantity quantity, const std::string& method,
                        std::int64_t samples, std::uint64_t replica = 0, int thread_count = 1,
                        std::uint64_t of_seed = seed) {
  SamplerThreads threads(thread_count);
  const auto sampler = make_sampler(method, robot.simulation.dimension, of_seed, replica);
  SampleCovariance covariance(robot.simulation, quantity, *sampler, threads);
  covariance.grow(samples);
  return covariance.value();
}

// Random123's kat_vectors of philox4x64-10.
TEST(Philox, GivesItsKnownAnswers) {
  constexpr std::uint64_t ones = ~std::uint64_t{0};
  EXPECT_EQ(philox({0, 0}, {0, 0, 0, 0}), (Words{0x16554d9eca36314c, 0xdb20fe9d672d0fdc,
                                                 0xd7e772cee186176b, 0x7e68b68aec7ba23b}));
  EXPECT_EQ(
      philox({ones, ones}, {ones, ones, ones, ones}),
      (Words{0x87b092c3013fe90b, 0x438c3c67be8d0224, 0x9cc7d7c69cd777b6, 0xa09caebf594f0ba0}));
  EXPECT_EQ(
      philox({0x452821e638d01377, 0xbe5466cf34e90c6c},
             {0x243f6a8885a308d3, 0x13198a2e03707344, 0xa4093822299f31d0, 0x082efa98ec4e6c89}),
      (Words{0xa528f45403e61d95, 0x38c72dbd566e9788, 0xa5a1610e72fd18b5, 0x57bd43b5e52b7fe6}));
}

TEST(Normal, IsTheInverseOfItsDistribution) {
  EXPECT_NEAR(normal(std::uint64_t{1} << 62), -0.67448975019608174, 1e-15);  // u = 1/4
  EXPECT_NEAR(normal(0), -8.2095361516013869, 1e-13);                        // u = 2^-53
  EXPECT_EQ(normal(~std::uint64_t{0}), -normal(0));
  for (std::uint64_t bits : {std::uint64_t{0x123456789abcdef0}, std::uint64_t{0xfedcba9876543210}})
    EXPECT_NEAR(std::erfc(-normal(bits) / std::sqrt(2)) / 2, std::ldexp(bits, -64), 1e-15);
}

class EverySampler : public testing::TestWithParam<std::string> {
 protected:
  static constexpr int dimension = 31;  // neither even nor a multiple of Philox's four

  static MatrixX<double> drawn(std::uint64_t first, int count, std::uint64_t of_seed = seed,
                               std::uint64_t replica = 0) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    MatrixX<double> normals = MatrixX<double>::Constant(dimension, count, nan);
    make_sampler(GetParam(), dimension, of_seed, replica)->fill(first, normals);
    return normals;
  }
};

TEST_P(EverySampler, GivesASampleByItsIndexAlone) {
  const MatrixX<double> all = drawn(0, 300);
  EXPECT_TRUE(all.allFinite());
  for (const auto& [first, count] : {std::pair{0, 1}, {1, 1}, {1, 64}, {64, 64}, {129, 171}})
    EXPECT_EQ(drawn(first, count), (MatrixX<double>(all.middleCols(first, count))));
  const std::uint64_t far = std::uint64_t{1} << 40;
  EXPECT_EQ(drawn(far, 3).col(2), drawn(far + 2, 1).col(0));
}

TEST_P(EverySampler, GivesOtherNumbersToAnotherSeedAndReplica) {
  const auto differ = [](const MatrixX<double>& a, const MatrixX<double>& b) {
    return (a.array() != b.array()).all();
  };
  EXPECT_EQ(drawn(0, 64, 1, 2), drawn(0, 64, 1, 2));
  EXPECT_TRUE(differ(drawn(0, 64, 1, 2), drawn(0, 64, 2, 2)));
  EXPECT_TRUE(differ(drawn(0, 64, 1, 2), drawn(0, 64, 1, 3)));
  EXPECT_TRUE(differ(drawn(0, 64, 1, 2), drawn(0, 64, 2, 1)));
  EXPECT_TRUE(differ(drawn(0, 64), drawn(64, 64)));
}

// Mean over replicas against the scatter of one: 1 on average if unbiased, and up to a few by
// chance. Replicas that are not independent of each other would give their number.
TEST_P(EverySampler, HasReplicasThatScatterAboutTheTruth) {
  constexpr int replicas = 64;
  const Model<double> model = chain(seed, 4);
  const Robot<double> robot(model);
  const MatrixX<double> exact = reference_of(model).M.cast<double>();
  MatrixX<double> mean = MatrixX<double>::Zero(4, 4);
  double scatter = 0;
  for (int replica = 0; replica < replicas; ++replica) {
    const MatrixX<double> error = sampled(robot, Quantity::M, GetParam(), 256, replica) - exact;
    mean += error / replicas;
    scatter += error.squaredNorm() / replicas;
  }
  EXPECT_LE(mean.squaredNorm() * replicas / scatter, 6);
}

TEST_P(EverySampler, GivesTheSameBitsForAnyNumberOfThreads) {
  const Robot<double> robot(tree(seed));
  for (const Quantity quantity : quantities) {
    const MatrixX<double> one = sampled(robot, quantity, GetParam(), 37 * 64, 0, 1);
    EXPECT_EQ(one, sampled(robot, quantity, GetParam(), 37 * 64, 0, 2));
    EXPECT_EQ(one, sampled(robot, quantity, GetParam(), 37 * 64, 0, 4));
  }
}

INSTANTIATE_TEST_SUITE_P(Names, EverySampler, testing::ValuesIn(sampler_names()),
                         [](const auto& info) { return info.param; });

TEST(SampleCovariance, GrowsByNewSamples) {
  const Robot<double> robot(chain(seed, 3));
  SamplerThreads threads(1);
  const auto sampler = make_sampler("MonteCarlo", robot.simulation.dimension, seed, 0);
  SampleCovariance covariance(robot.simulation, Quantity::P, *sampler, threads);
  for (const int samples : {64, 128, 640}) {
    covariance.grow(samples);
    EXPECT_EQ(covariance.samples(), samples);
    const MatrixX<double> at_once = sampled(robot, Quantity::P, "MonteCarlo", samples);
    EXPECT_LE((covariance.value() - at_once).norm(), 1e-14 * at_once.norm());
  }
}

TEST(SampleCovariance, IsTheMeanOfTheProductsOfItsSamples) {
  const Robot<double> robot(tree(seed));
  MatrixX<double> normals(robot.simulation.dimension, 192);
  make_sampler("QuasiMonteCarlo", robot.simulation.dimension, seed, 0)->fill(0, normals);
  Sample<double> sample(robot.simulation);
  MatrixX<double> T(robot.process.size(), 192);
  for (int c = 0; c < 192; ++c) {
    simulate(robot.simulation, normals.col(c), sample);
    T.col(c) = sample.tau;
  }
  const MatrixX<double> C = T * T.transpose() / 192;
  EXPECT_LE((sampled(robot, Quantity::M, "QuasiMonteCarlo", 192) - C).norm(), 1e-14 * C.norm());
}

// --- how wrong a sampled covariance is

// For y ~ N(0,M) and a known mean, E |C - M|_F^2 = (tr(M)^2 + |M|_F^2) / S whatever S is. In the
// eigenvectors of M the entries of sqrt(S) (C - M) are uncorrelated with variances 2 l_i^2 on the
// diagonal and l_i l_j beside it, and normal for large S. So |C - M|_F^2 is a weighted chi-square,
// and its variance is 4 (tr M^4 + |M|_F^4) / S^2.
struct Law {
  double mean, deviation;  // of S |C - M|_F^2

  explicit Law(const MatrixX<double>& M)
      : mean(M.trace() * M.trace() + M.squaredNorm()),
        deviation(2 * std::sqrt((M * M).squaredNorm() + M.squaredNorm() * M.squaredNorm())) {}
};

// Observed mean of S |C - M|_F^2, less the law's, in standard deviations of the observation.
double departure(const Robot<double>& robot, const MatrixX<double>& exact, Quantity quantity,
                 const std::string& method, int independent_of_samples) {
  constexpr int samples = 256, replicas = 200;
  const Law law(exact);
  double sum = 0;
  for (int replica = 0; replica < replicas; ++replica)
    sum += (sampled(robot, quantity, method, samples, replica) - exact).squaredNorm();
  const double observed = sum / replicas * samples / independent_of_samples;
  return (observed - law.mean) / (law.deviation / std::sqrt(replicas));
}

class ErrorLaw : public testing::Test {
 protected:
  Model<double> model_ = armature(seed);
  Robot<double> robot_{model_};
  Reference exact_ = reference_of(model_);

  MatrixX<double> exact(Quantity quantity) const { return exact_[quantity].cast<double>(); }
};

TEST_F(ErrorLaw, HoldsForMonteCarlo) {
  for (const Quantity quantity : quantities)
    EXPECT_LE(std::abs(departure(robot_, exact(quantity), quantity, "MonteCarlo", 1)), 4);
}

TEST_F(ErrorLaw, HoldsForAntitheticWithHalfTheSamples) {
  for (const Quantity quantity : quantities)
    EXPECT_LE(std::abs(departure(robot_, exact(quantity), quantity, "Antithetic", 2)), 4);
}

// At 2^18 samples a bias of 1 % of M would be seen.
TEST_F(ErrorLaw, LeavesNoBias) {
  const std::int64_t samples = std::int64_t{1} << 18;
  const MatrixX<double> M = exact(Quantity::M);
  const Law law(M);
  const MatrixX<double> error = sampled(robot_, Quantity::M, "MonteCarlo", samples) - M;
  EXPECT_LE(samples * error.squaredNorm(), law.mean + 4 * law.deviation);
}

// Root mean square over replicas: a third of the law's at 4096 samples and a tenth at 65536, so
// that its rate is better as well.
TEST_F(ErrorLaw, IsBeatenByQuasiMonteCarlo) {
  constexpr int replicas = 8;
  for (const auto& [samples, factor] : {std::pair{4096, 3}, {65536, 10}}) {
    double square = 0;
    for (int replica = 0; replica < replicas; ++replica)
      square +=
          (sampled(robot_, Quantity::M, "QuasiMonteCarlo", samples, replica) - exact(Quantity::M))
              .squaredNorm();
    EXPECT_LE(std::sqrt(square / replicas) * factor,
              std::sqrt(Law(exact(Quantity::M)).mean / samples));
  }
}

// The first two dimensions of a Sobol sequence are a (0,m,2) net, and every single one a (0,m,1)
// net: each dyadic box of area 2^-m holds one of the first 2^m points. A digital shift keeps that;
// leaving the origin out would not.
TEST(QuasiMonteCarlo, PutsOneSampleIntoEachDyadicBox) {
  constexpr int m = 6, points = 1 << m, dimension = 40;
  MatrixX<double> normals(dimension, points);
  make_sampler("QuasiMonteCarlo", dimension, seed, 0)->fill(0, normals);
  const auto cell = [&](int i, int c, int bits) {
    return static_cast<int>(std::ldexp(std::erfc(-normals(i, c) / std::sqrt(2)) / 2, bits));
  };
  for (int split = 0; split <= m; ++split) {
    std::vector<int> held(points);
    for (int c = 0; c < points; ++c)
      ++held[(cell(0, c, split) << (m - split)) + cell(1, c, m - split)];
    EXPECT_EQ(held, std::vector<int>(points, 1)) << split;
  }
  for (int i = 0; i < dimension; ++i) {
    std::vector<int> held(points);
    for (int c = 0; c < points; ++c) ++held[cell(i, c, m)];
    EXPECT_EQ(held, std::vector<int>(points, 1)) << i;
  }
}

TEST(Antithetic, PairsASampleWithItsNegative) {
  MatrixX<double> pairs(9, 4), half(9, 2);
  make_sampler("Antithetic", 9, seed, 0)->fill(0, pairs);
  make_sampler("MonteCarlo", 9, seed, 0)->fill(0, half);
  for (int c = 0; c < 4; ++c)
    EXPECT_EQ(pairs.col(c), (c % 2 == 0 ? 1.0 : -1.0) * half.col(c / 2)) << c;
}

}  // namespace
}  // namespace kalmarm::test

// Nothing in the timed path allocates: malloc and its relatives are replaced by ones that count.
// All of C++ and Eigen ends there. Not for a binary with sanitizers, which replace them too.
#include <errno.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

#include "algorithms/solver.hpp"
#include "algorithms/structured/derivatives.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/test/models.hpp"

namespace {
bool counting = false;
int allocations = 0;

void count() {
  if (counting) ++allocations;
}
}  // namespace

// glibc's own, under names that are not replaced.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  count();
  return __libc_malloc(size);
}

void* calloc(std::size_t n, std::size_t size) {
  count();
  return __libc_calloc(n, size);
}

void* realloc(void* old, std::size_t size) {
  count();
  return __libc_realloc(old, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  count();
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }

int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out ? 0 : ENOMEM;
}
}

namespace kalmarm::test {
namespace {

class Count {
 public:
  Count() {
    allocations = 0;
    counting = true;
  }
  ~Count() { counting = false; }
};

template <class F>
int allocations_of(const F& f) {
  const Count on;
  f();
  return allocations;
}

TEST(Counter, SeesEveryWayToAllocate) {
  EXPECT_GE(allocations_of([] { delete new int volatile(1); }), 1);
  EXPECT_GE(allocations_of([] { std::free(std::aligned_alloc(64, 64)); }), 1);
  EXPECT_GE(allocations_of([] { MatrixX<double>(40, 40).setZero(); }), 1);
  EXPECT_EQ(allocations_of([] {}), 0);
}

template <class T>
class Allocation : public testing::Test {};

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : "float64";
  }
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Allocation, Precisions, PrecisionName);

TYPED_TEST(Allocation, SolversAllocateOnlyBeforeTheirSecondCall) {
  for (const int n : {36, 200})
    for (const RegisteredVariant<TypeParam>& variant : registered_variants<TypeParam>()) {
      SCOPED_TRACE(variant.name + " on chain:" + std::to_string(n));
      const Model<double> parameters = chain(61, n);
      const Model<TypeParam> model = parameters.template cast<TypeParam>();
      const State<TypeParam> state = random_state(parameters, 62).template cast<TypeParam>();
      const std::unique_ptr<Solver<TypeParam>> solver = variant.make(model);
      VectorX<TypeParam> a(n);
      MatrixX<TypeParam> X(n, n);
      Outcome solved, inverted;
      const auto solve = [&] { solved = solver->acceleration(state.q, state.qd, state.tau, a); };
      const auto invert = [&] { inverted = solver->inverse(state.q, X); };
      solve();
      invert();
      EXPECT_EQ(allocations_of(solve), 0) << "acceleration";
      EXPECT_EQ(allocations_of(invert), 0) << "inverse";
      EXPECT_TRUE(solved && inverted);
    }
}

template <class T, class Form>
void expect_no_allocation_once_made() {
  constexpr int count = 19;
  const Model<double> parameters = floating_base(61);
  const Model<T> model = parameters.template cast<T>();
  const State<T> state = random_state(parameters, 62).template cast<T>();
  const int nq = model.nq(), nv = model.nv();
  VectorX<T> q = state.q.replicate(count, 1), qd = state.qd.replicate(count, 1);
  VectorX<T> tau = state.tau.replicate(count, 1), a(nv), rows(count * nv);
  q[3 * nq] = std::numeric_limits<T>::quiet_NaN();  // judged in full
  std::vector<Outcome> outcomes(count);
  StructuredDynamics<T, Form> one(model);
  StructuredBatch<T, Form> batch(model);
  Outcome solved;
  int failed = 0;
  EXPECT_EQ(allocations_of([&] { solved = one.acceleration(state.q, state.qd, state.tau, a); }), 0);
  EXPECT_EQ(allocations_of([&] {
              failed = batch.acceleration(count, q.data(), qd.data(), tau.data(), rows.data(),
                                          outcomes.data());
            }),
            0);
  EXPECT_TRUE(solved);
  EXPECT_EQ(failed, 1);
}

TYPED_TEST(Allocation, StructuredDynamicsAllocatesOnlyWhenItIsMade) {
  expect_no_allocation_once_made<TypeParam, CovarianceForm>();
  expect_no_allocation_once_made<TypeParam, SquareRootForm>();
}

TYPED_TEST(Allocation, StructuredDerivativesAllocateOnlyWhenTheyAreMade) {
  using T = TypeParam;
  for (const Model<double>& parameters : {floating_base(61), chain(61, 53)}) {
    const Model<T> model = parameters.template cast<T>();
    const State<T> state = random_state(parameters, 62).template cast<T>();
    StructuredDerivatives<T> solver(model);
    MatrixX<T> dq(model.nv(), model.nv()), dqd = dq, dtau = dq;
    VectorX<T> a(model.nv());
    Outcome outcome;
    EXPECT_EQ(allocations_of([&] {
                outcome = solver.derivatives(state.q, state.qd, state.tau, dq, dqd, dtau, a);
              }),
              0);
    EXPECT_TRUE(outcome);
  }
}

}  // namespace
}  // namespace kalmarm::test

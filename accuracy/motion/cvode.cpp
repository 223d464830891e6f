#include "accuracy/motion/cvode.hpp"

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

#include <memory>
#include <new>

#include "accuracy/motion/acceleration.hpp"
#include "accuracy/motion/repeated.hpp"

namespace kalmarm::motion {
namespace {

static_assert(std::is_same_v<realtype, double>);

struct End {
  void operator()(SUNContext context) const { SUNContext_Free(&context); }
  void operator()(N_Vector vector) const { N_VDestroy(vector); }
  void operator()(SUNMatrix matrix) const { SUNMatDestroy(matrix); }
  void operator()(SUNLinearSolver solver) const { SUNLinSolFree(solver); }
  void operator()(void* cvode) const { CVodeFree(&cvode); }
};
template <class Handle>
using Owned = std::unique_ptr<std::remove_pointer_t<Handle>, End>;

int rate(realtype t, N_Vector x, N_Vector out, void* of) {
  auto& rate = *static_cast<StateRate<double>*>(of);
  return rate(t, N_VGetArrayPointer(x), N_VGetArrayPointer(out)) ? 0 : -1;
}

// One that CVODE cannot make is out of memory: its options are right.
void require(bool made) {
  if (!made) throw std::bad_alloc();
}

}  // namespace

bool has_cvode() { return true; }

Simulation by_cvode(const Motion& motion, const Method& method, const Effort& effort) {
  const int nq = motion.robot.nq, nv = motion.robot.nv(), n = nq + nv;
  StateRate<double> f(motion, dynamics_of(method), effort.cap);
  SUNContext made = nullptr;
  require(SUNContext_Create(nullptr, &made) == 0);
  const Owned<SUNContext> context(made);
  const Owned<N_Vector> x(N_VNew_Serial(n, made));
  const Owned<SUNMatrix> matrix(SUNDenseMatrix(n, n, made));
  require(x && matrix);
  const Owned<SUNLinearSolver> solver(SUNLinSol_Dense(x.get(), matrix.get(), made));
  const std::unique_ptr<void, End> cvode(CVodeCreate(CV_BDF, made));
  require(solver && cvode);
  Eigen::Map<VectorX<double>> q(N_VGetArrayPointer(x.get()), nq),
      v(N_VGetArrayPointer(x.get()) + nq, nv);
  const auto begin = [&] {
    f.begin();
    q = motion.q;
    v = motion.v;
  };
  begin();
  require(CVodeInit(cvode.get(), rate, 0, x.get()) == CV_SUCCESS);
  CVodeSetErrHandlerFn(
      cvode.get(), [](int, const char*, const char*, char*, void*) {}, nullptr);
  require(CVodeSetUserData(cvode.get(), &f) == CV_SUCCESS &&
          CVodeSStolerances(cvode.get(), method.step, method.step) == CV_SUCCESS &&
          CVodeSetLinearSolver(cvode.get(), solver.get(), matrix.get()) == CV_SUCCESS &&
          CVodeSetMaxNumSteps(cvode.get(), -1) == CV_SUCCESS &&
          CVodeSetStopTime(cvode.get(), motion.duration) == CV_SUCCESS);
  return repeated(effort, [&] {
    begin();
    require(CVodeReInit(cvode.get(), 0, x.get()) == CV_SUCCESS &&
            CVodeSetStopTime(cvode.get(), motion.duration) == CV_SUCCESS);
    realtype t = 0;
    const int flag = CVode(cvode.get(), motion.duration, x.get(), &t, CV_NORMAL);
    long steps = 0;
    CVodeGetNumSteps(cvode.get(), &steps);
    const bool whole = flag >= 0 && t == motion.duration;
    const bool finite = q.allFinite() && v.allFinite();
    const Status status = f.capped()        ? Status::given_up
                          : whole && finite ? Status::ok
                                            : Status::unstable;
    return Simulation{.status = status,
                      .q = q.cast<long double>(),
                      .v = v.cast<long double>(),
                      .steps = steps,
                      .calls = f.calls()};
  });
}

}  // namespace kalmarm::motion

// Memory for calls. An object of Dynamics serves one thread at a time, so a robot keeps as many as
// were ever called at once: a call takes a free one, or makes one. All are made alike and answer
// alike. A step keeps objects of ImplicitStep in the same way, and so do kinematics and constraints theirs.
#pragma once

#include <functional>
#include <kalmarm/dynamics.hpp>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>
#include <vector>

namespace kalmarm::python {

template <class T, class D = Dynamics<T>>
struct Worker {
  D dynamics;
  std::vector<Outcome> outcomes;  // of rows
  std::vector<T> zeros;           // velocities and accelerations of rows that have none
};

template <class T, class D = Dynamics<T>>
class Workers {
 public:
  using Object = Worker<T, D>;

  // A worker, until its end.
  class Loan {
   public:
    Loan(Workers* from, std::unique_ptr<Object> worker) : from_(from), worker_(std::move(worker)) {}
    Loan(Loan&&) noexcept = default;
    Loan& operator=(Loan&&) = delete;
    ~Loan() {
      if (worker_) from_->give_back(std::move(worker_));
    }
    Object* operator->() const { return worker_.get(); }
    Object& operator*() const { return *worker_; }

   private:
    Workers* from_;
    std::unique_ptr<Object> worker_;
  };

  explicit Workers(std::function<D()> make) : make_(std::move(make)) {}

  Loan take() {
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        Loan loan(this, std::move(free_.back()));
        free_.pop_back();
        return loan;
      }
    }
    return {this, std::make_unique<Object>(make_())};
  }

 private:
  void give_back(std::unique_ptr<Object> worker) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(worker));
  }

  std::function<D()> make_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Object>> free_;
};

// Of both precisions: objects D<T> that make.operator()<T>() makes.
template <template <class> class D>
class WorkersOfBoth {
 public:
  template <class Make>
  explicit WorkersOfBoth(const Make& make)
      : of_float_([make] { return make.template operator()<float>(); }),
        of_double_([make] { return make.template operator()<double>(); }) {}

  template <class T>
  Workers<T, D<T>>& of() {
    if constexpr (std::is_same_v<T, float>)
      return of_float_;
    else
      return of_double_;
  }

 private:
  Workers<float, D<float>> of_float_;
  Workers<double, D<double>> of_double_;
};

}  // namespace kalmarm::python

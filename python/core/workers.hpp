// Memory for calls. An object of Dynamics serves one thread at a time, so a robot keeps as many as
// were ever called at once: a call takes a free one, or makes one. All are made from the same model
// and answer alike.
#pragma once

#include <kalmarm/dynamics.hpp>
#include <memory>
#include <mutex>
#include <vector>

namespace kalmarm::python {

template <class T>
struct Worker {
  Dynamics<T> dynamics;
  std::vector<Outcome> outcomes;  // of rows
  std::vector<T> zeros;           // velocities and accelerations of rows that have none
};

template <class T>
class Workers {
 public:
  // A worker, until its end.
  class Loan {
   public:
    Loan(Workers* from, std::unique_ptr<Worker<T>> worker)
        : from_(from), worker_(std::move(worker)) {}
    Loan(Loan&&) noexcept = default;
    Loan& operator=(Loan&&) = delete;
    ~Loan() {
      if (worker_) from_->give_back(std::move(worker_));
    }
    Worker<T>* operator->() const { return worker_.get(); }
    Worker<T>& operator*() const { return *worker_; }

   private:
    Workers* from_;
    std::unique_ptr<Worker<T>> worker_;
  };

  // Both outlive this.
  Workers(const RobotModel& model, const DynamicsOptions& options)
      : model_(model), options_(options) {}

  Loan take() {
    {
      const std::lock_guard lock(mutex_);
      if (!free_.empty()) {
        Loan loan(this, std::move(free_.back()));
        free_.pop_back();
        return loan;
      }
    }
    return {this, std::make_unique<Worker<T>>(Dynamics<T>(model_, options_))};
  }

 private:
  void give_back(std::unique_ptr<Worker<T>> worker) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(worker));
  }

  const RobotModel& model_;
  const DynamicsOptions& options_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker<T>>> free_;
};

}  // namespace kalmarm::python

#include "src/core/thread_pool.h"

#include <algorithm>

namespace gapscope {

int DefaultWorkers() { return static_cast<int>(std::max(1u, std::thread::hardware_concurrency())); }

ThreadPool::ThreadPool(int workers) : workers_(std::max(1, workers)) {
  for (int worker = 1; worker < workers_; ++worker) threads_.emplace_back([this, worker] { Work(worker); });
}

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (auto& thread : threads_) thread.join();
}

void ThreadPool::ForEach(std::size_t count, const std::function<void(std::size_t, int)>& task) {
  if (count == 0) return;
  {
    const std::lock_guard lock(mutex_);
    task_ = &task;
    count_ = count;
    next_ = 0;
    busy_ = workers_;
    failure_ = nullptr;
    ++round_;
  }
  start_.notify_all();
  Drain(0);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
  task_ = nullptr;
  if (failure_) std::rethrow_exception(failure_);
}

void ThreadPool::Work(int worker) {
  unsigned long seen = 0;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      start_.wait(lock, [&] { return stop_ || round_ != seen; });
      if (stop_) return;
      seen = round_;
    }
    Drain(worker);
  }
}

void ThreadPool::Drain(int worker) {
  while (true) {
    std::size_t index;
    {
      const std::lock_guard lock(mutex_);
      if (next_ >= count_) {
        if (--busy_ == 0) done_.notify_all();
        return;
      }
      index = next_++;
    }
    try {
      (*task_)(index, worker);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      next_ = count_;
    }
  }
}

}  // namespace gapscope

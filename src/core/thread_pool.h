// A fixed set of workers for independent tasks. Results go to places that the task index decides, so the output does
// not depend on the number of workers or on who ran what.
#ifndef GAPSCOPE_CORE_THREAD_POOL_H_
#define GAPSCOPE_CORE_THREAD_POOL_H_

#include <condition_variable>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace gapscope {

class ThreadPool {
 public:
  // `workers` >= 1; with one, tasks run on the calling thread.
  explicit ThreadPool(int workers);
  ~ThreadPool();
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  int workers() const { return workers_; }

  // Runs task(index, worker) for index 0..count-1, worker 0..workers()-1 (two tasks with the same worker never run at
  // once), and returns when all are done. The first exception of a task is rethrown. Not reentrant.
  void ForEach(std::size_t count, const std::function<void(std::size_t index, int worker)>& task);

 private:
  void Work(int worker);
  void Drain(int worker);

  const int workers_;
  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  const std::function<void(std::size_t, int)>* task_ = nullptr;
  std::size_t count_ = 0, next_ = 0;
  int busy_ = 0;
  unsigned long round_ = 0;
  bool stop_ = false;
  std::exception_ptr failure_;
};

// The number of workers for `--jobs 0`: the processors that this process may use, at least one.
int DefaultWorkers();

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_THREAD_POOL_H_

// What a fit has computed so far, so that an interrupted one goes on to the same result: every evaluation or iteration
// in order, with a hash of its point and numbers.
#ifndef GAPSCOPE_TUNE_JOURNAL_H_
#define GAPSCOPE_TUNE_JOURNAL_H_

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "src/tune/fit_problem.h"

namespace gapscope {

// FNV-1a.
std::uint64_t Hash(const void* bytes, std::size_t size, std::uint64_t seed = 14695981039346656037ull);

class Journal {
 public:
  // Opens `path`; `key` identifies the job (experiment, logs, options). With `resume`, records of the same job are kept
  // and handed out again; a torn last record is dropped. Otherwise the journal starts empty. Errors: cannot open or
  // write; with `resume`, a journal of another job.
  static Result<std::unique_ptr<Journal>> Open(const std::string& path, std::uint64_t key, bool resume);
  ~Journal();

  // The recorded result of this evaluation, if the job got this far before.
  bool Next(const FitPoint& point, std::vector<double>* record);
  void Append(const FitPoint& point, const std::vector<double>& record);
  std::size_t resumed() const { return resumed_; }

 private:
  Journal() = default;
  std::FILE* file_ = nullptr;
  std::vector<std::pair<std::uint64_t, std::vector<double>>> records_;
  std::size_t next_ = 0, resumed_ = 0;
};

// A linearization as numbers and back.
std::vector<double> Pack(const Linearization& linearization);
Linearization Unpack(const std::vector<double>& numbers);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_JOURNAL_H_

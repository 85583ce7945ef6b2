// What a fit has computed so far, so that an interrupted one goes on to the same result: every evaluation or iteration
// in order, with a hash of its point and numbers.
#ifndef GAPSCOPE_FIT_JOURNAL_H_
#define GAPSCOPE_FIT_JOURNAL_H_

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "src/core/hash.h"
#include "src/fit/normal_equations.h"

namespace gapscope {

// What a call at a point is told by.
Hasher HashOf(const FitPoint& point, Hasher hasher);
// Of one kind, in a word: results of different kinds at one point are not each other's.
inline Hasher CallAt(const std::string& kind, const FitPoint& point) { return HashOf(point, Hasher().Text(kind)); }

class Journal {
 public:
  // Opens `path`; `key` identifies the job: everything that its numbers depend on. With `resume`, records of the same
  // job are kept and handed out again; a torn last record is dropped. Otherwise the journal starts empty. Errors:
  // cannot open or write; with `resume`, a journal of another job.
  static Result<std::unique_ptr<Journal>> Open(const std::string& path, std::uint64_t key, bool resume);
  ~Journal();

  // The recorded result of this call, if the job got this far before. `call`: a hash of what it is given; another one
  // than is recorded next, and what follows is dropped.
  bool Next(Hasher call, std::vector<double>* record);
  void Append(Hasher call, const std::vector<double>& record);
  // Records are left to hand out; the next one is of this call.
  bool replaying() const { return next_ < records_.size(); }
  bool IsNext(Hasher call) const;
  // Brings what was written to the disk itself, so that not even a power cut takes it back.
  Status Sync();
  // Whether all could be written so far; the error names file and reason. A run goes on without: nothing but the way
  // back into it is lost.
  const Status& status() const { return status_; }
  std::size_t resumed() const { return resumed_; }

 private:
  Journal() = default;
  Status Read(std::uint64_t key, std::size_t* good);
  void Write(const void* bytes, std::size_t size);
  void DropRest();
  void Fail();  // by errno

  std::string path_;
  std::FILE* file_ = nullptr;
  Status status_ = Ok();
  std::vector<std::pair<std::uint64_t, std::vector<double>>> records_;
  std::size_t next_ = 0, resumed_ = 0;
};

// As numbers and back; an evaluation without its residuals.
std::vector<double> Pack(const Evaluation& evaluation);
Evaluation UnpackEvaluation(const std::vector<double>& numbers);
std::vector<double> Pack(const Linearization& linearization);
Linearization UnpackLinearization(const std::vector<double>& numbers);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_JOURNAL_H_

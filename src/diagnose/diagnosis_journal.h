// What an interrupted diagnosis goes on from. All that a diagnosis decides follows from the results of its long
// calls: fits, costs and columns. They are kept in order, and a resumed run, which is the same program, takes them from
// here instead of computing them, to the same result.
//
// A folder: calls.bin (Journal), and what is too large for it in files of its own, by the number of the call. The
// Jacobian of a fit is emptied when nothing points to it any more: no later call can ask for it.
#ifndef GAPSCOPE_DIAGNOSE_DIAGNOSIS_JOURNAL_H_
#define GAPSCOPE_DIAGNOSE_DIAGNOSIS_JOURNAL_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "src/fit/gram.h"
#include "src/fit/journal.h"
#include "src/fit/optimizers.h"

namespace gapscope {

class DiagnosisJournal {
 public:
  struct Job {
    std::string folder;
    std::uint64_t key = 0;  // see Journal::Open
    bool resume = false;
    Deadline deadline = {};  // what ends later is cut short, and not recorded
    std::function<void(const std::string&)> warn = {};
  };
  // Without `resume` the folder is emptied. Errors: as Journal::Open.
  static Result<std::unique_ptr<DiagnosisJournal>> Open(Job job);
  // The folder that belongs to a run's folder, and its end when the run's result is written.
  static std::string FolderIn(const std::string& out);
  static void Remove(const std::string& folder);

  // What a run did before it was interrupted is still being handed out.
  bool replaying() const { return calls_->replaying(); }

  // Each gives what `make` returns, or what it returned before the interruption. `call`: of what, in words.
  // The derivatives are kept where the cost is below `keep_below`.
  SolveResult Solve(const std::string& call, const FitPoint& start, double keep_below,
                    const std::function<SolveResult()>& make);
  // Without residuals.
  Evaluation Evaluate(const std::string& call, const FitPoint& point, const std::function<Evaluation()>& make);
  // `columns`: their names.
  GramSystem Gram(const std::string& call, const FitPoint& point, std::vector<std::string> columns,
                  const std::function<GramSystem()>& make);

 private:
  using Numbers = std::vector<double>;
  explicit DiagnosisJournal(Job job) : job_(std::move(job)) {}
  // The call's recorded numbers.
  bool Take(const Hasher& call, Numbers* numbers);
  void Record(const Hasher& call, const Numbers& numbers);
  // Nothing is recorded or forgotten any more: there is no room, or the time is over.
  bool Stopped();
  std::string File(std::size_t number) const;
  void WriteLarge(std::size_t number, const Numbers& numbers);
  // False: they were forgotten, or are lost, which is said.
  bool ReadLarge(std::size_t number, Numbers* numbers);
  void Forget(std::size_t number);
  // That file `number` is emptied with the last pointer to them.
  std::shared_ptr<const Derivatives> Kept(std::size_t number, const std::shared_ptr<const Derivatives>& derivatives);
  void Warn(const std::string& text);

  Job job_;
  std::unique_ptr<Journal> calls_;
  std::size_t count_ = 0;  // of calls so far
  Status large_ = Ok();    // of the files
  bool stopped_ = false, warned_ = false;
};

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DIAGNOSIS_JOURNAL_H_

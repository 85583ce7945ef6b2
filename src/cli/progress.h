// What a long command says while it runs, and how it is told to come to an end.
#ifndef GAPSCOPE_CLI_PROGRESS_H_
#define GAPSCOPE_CLI_PROGRESS_H_

#include <atomic>
#include <chrono>
#include <string>
#include <vector>

#include "src/cli/profile.h"
#include "src/cli/session.h"
#include "src/core/statistics.h"

namespace gapscope::cli {

// A stage of the work and how much of it is done; NaN: not known.
struct ProgressPoint {
  std::string stage;
  double done = kNaN, total = kNaN;
  double best = kNaN;     // cost
  std::size_t steps = 0;  // of the simulator so far, where that is known
};

// On stderr: for people one line that is written over, where stderr is a terminal; with `--progress json` an object a
// line, at most twenty a second of one stage. Nothing with --quiet.
class ProgressLine {
 public:
  // `clock` is told the stages too.
  explicit ProgressLine(const CommonFlags& flags, StageClock* clock = nullptr);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool live() const { return people_ || json_ || (clock_ && clock_->on()); }
  double elapsed_s() const;
  // `text`: for people.
  void Show(const ProgressPoint& point, const std::string& text);

 private:
  bool people_, json_;
  StageClock* clock_;
  std::chrono::steady_clock::time_point begin_, last_;
  std::string stage_;
};

// The line of a command that reads these files now, where that takes a while: 10 MB or more.
void ShowReading(const std::vector<std::string>& files, ProgressLine* line);

// From here on SIGINT, SIGTERM and SIGHUP (where it is not ignored) set what is returned; the second one ends the
// program.
const std::atomic<bool>* CatchInterrupts();

// Whether messages are to be JSON: known before the command line is read, since that may fail.
bool AsksForJsonProgress(int argc, char** argv);
// {"error": {"what", "where", "actual", "allowed", "cure"}}
std::string ErrorLine(const Error& error);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_PROGRESS_H_

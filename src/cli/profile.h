// Where the time of a command goes: --verbose and --profile.
#ifndef GAPSCOPE_CLI_PROFILE_H_
#define GAPSCOPE_CLI_PROFILE_H_

#include <chrono>
#include <string>
#include <vector>

#include "src/cli/session.h"
#include "src/fit/options.h"

namespace gapscope::cli {

// --verbose and --profile.
std::vector<Option> ProfileOptions(CommonFlags& flags);

// Stages follow each other and sub-stages follow each other within a stage; each is told when it begins, on one thread.
// With --verbose stderr has a line for each when it ends, with --profile a table of all at the end. Nothing of it with
// --quiet. A stage that comes again is the same row.
class StageClock {
 public:
  // The first stage is "load".
  explicit StageClock(const CommonFlags& flags);
  ~StageClock();
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

  bool on() const { return verbose_ || profile_; }
  void Enter(const std::string& stage);
  // `steps`: of the simulator, since the command began; 0 where that is not known.
  void EnterPart(const std::string& part, std::size_t steps = 0);
  // What the command computed in all.
  void Count(std::size_t replays, std::size_t steps) { replays_ = replays, steps_ = steps; }

 private:
  using Clock = std::chrono::steady_clock;
  struct Row {
    std::string stage, part;  // part: empty of the stage itself
    double wall_s = 0;
    std::size_t steps = 0;
  };
  std::size_t RowOf(const std::string& stage, const std::string& part);
  void EndPart();
  void EndStage();
  void PrintTable() const;

  bool verbose_, profile_;
  std::vector<Row> rows_;
  std::string stage_, part_;  // under way; empty: none
  Clock::time_point begin_, stage_begin_, part_begin_;
  std::size_t steps_before_ = 0, steps_now_ = 0;  // at the beginning of the part, and as told last
  std::size_t replays_ = 0, steps_ = 0;
};

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_PROFILE_H_

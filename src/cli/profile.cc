#include "src/cli/profile.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "src/cli/print.h"

namespace gapscope::cli {
namespace {

double SecondsSince(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// "12.3 million" takes less room than its digits, and says as much.
std::string StepsText(std::size_t steps) {
  if (steps == 0) return "";
  if (steps < 1'000'000) return fmt::format("{}", steps);
  return fmt::format("{:.1f}e6", static_cast<double>(steps) / 1e6);
}

}  // namespace

std::vector<Option> ProfileOptions(CommonFlags& flags) {
  return {{.flag = "--verbose",
           .value = &flags.verbose,
           .help = "Say on stderr what each stage took, when it ends",
           .more = "Not with --quiet"},
          {.flag = "--profile",
           .value = &flags.profile,
           .help = "At the end a table on stderr: stages and their parts, seconds, shares, simulated steps",
           .more = "Not with --quiet. Stages are those that --progress tells, and what is before and after them"}};
}

StageClock::StageClock(const CommonFlags& flags)
    : verbose_(flags.verbose && !flags.quiet),
      profile_(flags.profile && !flags.quiet),
      begin_(Clock::now()),
      stage_begin_(begin_),
      part_begin_(begin_) {
  if (on()) stage_ = "load", RowOf(stage_, "");
}

StageClock::~StageClock() {
  if (!on()) return;
  EndStage();
  if (profile_) PrintTable();
}

std::size_t StageClock::RowOf(const std::string& stage, const std::string& part) {
  const auto is = [&](const Row& row) { return row.stage == stage && row.part == part; };
  const auto found = std::find_if(rows_.begin(), rows_.end(), is);
  if (found != rows_.end()) return static_cast<std::size_t>(found - rows_.begin());
  // Parts stand below their stage, in the order in which they came.
  auto after = rows_.end();
  while (!part.empty() && after != rows_.begin() && (after - 1)->stage != stage) --after;
  return static_cast<std::size_t>(rows_.insert(after, {.stage = stage, .part = part}) - rows_.begin());
}

void StageClock::EndPart() {
  if (part_.empty()) return;
  Row& row = rows_[RowOf(stage_, part_)];
  const double wall_s = SecondsSince(part_begin_);
  row.wall_s += wall_s;
  if (steps_now_ > steps_before_) row.steps += steps_now_ - steps_before_;
  if (verbose_) Print(stderr, "{}, {}: {:.3f} s\n", stage_, part_, wall_s);
  part_.clear();
}

void StageClock::EndStage() {
  EndPart();
  const double wall_s = SecondsSince(stage_begin_);
  rows_[RowOf(stage_, "")].wall_s += wall_s;
  if (verbose_) Print(stderr, "{}: {:.3f} s\n", stage_, wall_s);
}

void StageClock::Enter(const std::string& stage) {
  if (!on()) return;
  EndStage();
  stage_ = stage;
  stage_begin_ = Clock::now();
  RowOf(stage_, "");
}

void StageClock::EnterPart(const std::string& part, std::size_t steps) {
  if (!on()) return;
  steps_now_ = std::max(steps_now_, steps);
  if (part == part_) return;
  EndPart();
  part_ = part;
  part_begin_ = Clock::now();
  steps_before_ = steps_now_;
  RowOf(stage_, part_);
}

void StageClock::PrintTable() const {
  constexpr int kName = 62, kBar = 24;
  const double all_s = std::max(SecondsSince(begin_), 1e-9);
  std::string text = fmt::format("{:<{}}{:>9}  share{:>{}}\n", "stage", kName, "seconds", "steps", 2 + kBar + 9);
  for (const Row& row : rows_) {
    std::size_t steps = row.steps;
    for (const Row& other : rows_) {
      if (row.part.empty() && other.stage == row.stage) steps += other.steps;
    }
    const double share = std::clamp(row.wall_s / all_s, 0.0, 1.0);
    const std::string name = row.part.empty() ? row.stage : "  " + row.part;
    const std::string bar(static_cast<std::size_t>(std::lround(kBar * share)), row.part.empty() ? '#' : '-');
    std::string line = fmt::format("{:<{}.{}}{:>9.3f} {:>5.0f}%  {:<{}}{:>9}", name, kName, kName, row.wall_s,
                                   100 * share, bar, kBar, StepsText(steps));
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  text += fmt::format("{:<{}}{:>9.3f}", "in all", kName, all_s);
  if (replays_ > 0) text += fmt::format("; {} replays", replays_);
  if (steps_ > 0)
    text += fmt::format("; {} steps, {:.2f} million a second", steps_, 1e-6 * static_cast<double>(steps_) / all_s);
  Print(stderr, "{}\n", text);
}

}  // namespace gapscope::cli

// A diagnosis as its flags ask for it, for the command and for the units of a fleet.
#ifndef GAPSCOPE_CLI_DIAGNOSE_JOB_H_
#define GAPSCOPE_CLI_DIAGNOSE_JOB_H_

#include <string>
#include <vector>

#include "src/cli/profile.h"
#include "src/cli/session.h"
#include "src/report/diagnose_report.h"

namespace gapscope::cli {

struct DiagnoseFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> hold_out, prior, accept, freeze;
  std::string from;
  std::string plugin_fault;  // why candidates that are plugins are left out; empty: they are not
  SearchEffort effort = SearchEffort::kNormal;
  double budget_s = 0, window_s = 0;
  bool resume = false, no_next_experiment = false;
};

// What --from, --with, --set, --params and --prior say is built in; common.out is written. Messages on stderr.
// `clock`: told the stages; null: none.
Result<DiagnoseRun> DiagnoseLogs(const DiagnoseFlags& flags, StageClock* clock = nullptr);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_DIAGNOSE_JOB_H_

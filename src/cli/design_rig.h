// What the designs on an experiment share: its flags, and the rig they are for.
#ifndef GAPSCOPE_CLI_DESIGN_RIG_H_
#define GAPSCOPE_CLI_DESIGN_RIG_H_

#include <memory>
#include <string>
#include <vector>

#include "src/cli/session.h"
#include "src/design/rehearsal.h"

namespace gapscope::cli {

struct RigFlags {
  CommonFlags common;
  std::string experiment, actuator, out;
  std::vector<std::string> value, hold, set, params;
  double amplitude = 0, margin = 0.9, duration_s = 10, rate_hz = 500;
};

std::vector<Option> OptionsOf(RigFlags& flags);

struct DesignRig {
  Experiment experiment;  // with limit signals
  std::shared_ptr<const Model> model;
  std::vector<double> values;
  RehearsalOptions rehearsal;
  std::string unit;  // of the driven command
  std::size_t driven = 0;
};

// Assignments of parameters that effects will add are left for later. Errors: the files; a name that does not exist.
Result<DesignRig> LoadRig(const RigFlags& flags);

// Writes `csv` to --out, if it was given, and says so on stderr unless quiet.
Status WriteInput(const std::string& out, const std::string& csv, bool quiet);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_DESIGN_RIG_H_

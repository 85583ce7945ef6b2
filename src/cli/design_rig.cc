#include "src/cli/design_rig.h"

#include <fmt/core.h>

#include <cstdio>

#include "src/cli/print.h"
#include "src/core/file.h"

namespace gapscope::cli {

std::vector<Option> OptionsOf(RigFlags& flags) {
  const std::vector<Option> own = {
      ExperimentOption(flags.experiment),
      {.flag = "--amplitude",
       .value = &flags.amplitude,
       .unit = "the command's SI unit",
       .range = Above(0, 0),
       .unset = "the largest within the experiment's limits",
       .help = "Of the command",
       .more = "An amplitude that would pass a limit on the nominal model is refused, with the largest one that does "
               "not"},
      {.flag = "--duration", .value = &flags.duration_s, .unit = "s", .range = Above(0), .help = "Length of the input"},
      {.flag = "--rate", .value = &flags.rate_hz, .unit = "Hz", .range = Above(0), .help = "Rows a second"},
      {.flag = "--margin",
       .value = &flags.margin,
       .range = Between(0.01, 1),
       .help = "Share of every limit that may be used",
       .more = "Limits of angles, speeds, torques and commands are the experiment's `limits`"},
      {.flag = "--actuator",
       .value = &flags.actuator,
       .unset = "the experiment's first",
       .help = "Which command is driven"},
      {.flag = "--hold",
       .value = &flags.hold,
       .help = "Another command's constant value: ACTUATOR=VALUE, more than once"},
      {.flag = "--value",
       .value = &flags.value,
       .help = "A number that a log would bring: NAME=VALUE, more than once"}};
  return Join({own,
               ValueOptions(flags.set, flags.params),
               {{.flag = "--out",
                 .value = &flags.out,
                 .unset = "nothing is written",
                 .help = "CSV file of the input, in the experiment's own columns",
                 .more = "Predicted signals and limits stand beside the commands, so that a rig's log can be laid over "
                         "them"}},
               CommonOptions(flags.common)});
}

Result<DesignRig> LoadRig(const RigFlags& flags) {
  DesignRig rig;
  GS_ASSIGN(const Experiment experiment, LoadExperiment(flags.experiment));
  rig.experiment = WithLimitSignals(experiment);
  GS_ASSIGN(rig.model, Model::Load(rig.experiment));
  rig.values = rig.model->Nominal();
  std::vector<std::string> base;
  for (const auto& text : flags.set) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--set"));
    if (!UseWithParameter(assignment.first, *rig.model->rig())) base.push_back(text);
  }
  GS_RETURN_IF_ERROR(OverrideValues(*rig.model, flags.params, base, &rig.values));
  rig.rehearsal.actuator = flags.actuator;
  rig.rehearsal.rate_hz = flags.rate_hz;
  for (const auto& text : flags.hold) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--hold"));
    rig.rehearsal.hold.insert(assignment);
  }
  for (const auto& text : flags.value) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--value"));
    rig.rehearsal.log_values.insert(assignment);
  }
  GS_ASSIGN(rig.driven, DrivenCommand(rig.experiment, rig.rehearsal));
  rig.unit = rig.experiment.commands[rig.driven].unit;
  return rig;
}

Status WriteInput(const std::string& out, const std::string& csv, bool quiet) {
  if (out.empty()) return Ok();
  GS_RETURN_IF_ERROR(WriteFile(out, csv));
  if (!quiet) Print(stderr, "wrote {}\n", out);
  return Ok();
}

}  // namespace gapscope::cli

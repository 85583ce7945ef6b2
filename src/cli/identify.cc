#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/core/collect.h"
#include "src/log/foreign.h"
#include "src/report/identify_report.h"
#include "src/report/json.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

using Method = Result<Identification> (*)(const IdentifyInput&, const IdentifyOptions&);

struct IdentifyFlags {
  CommonFlags common;
  ModelFlags model;
  IdentifyOptions options;
  std::vector<std::string> hold_out;
  double rated_speed_rpm = 0;
  Method method = nullptr;
};

// One CSV per table of points beside the result.
Status WriteIdentification(const std::string& out, const Identification& result, const nlohmann::ordered_json& json) {
  constexpr int kDigits = 10;
  const auto columns = Collect(result.tables, ColumnsOf);  // that the tables point to
  RunFiles files;
  for (std::size_t t = 0; t < columns.size(); ++t) {
    RunTable table{.path = result.tables[t].name + ".csv", .columns = {}, .digits = kDigits};
    for (std::size_t c = 0; c < columns[t].size(); ++c)
      table.columns.push_back({result.tables[t].columns[c], columns[t][c]});
    files.tables.push_back(std::move(table));
  }
  return WriteRun(out, json, files);
}

Result<int> RunIdentify(IdentifyFlags flags) {
  flags.options.rated_speed_rad_per_s = flags.rated_speed_rpm * 2 * std::numbers::pi / 60;
  if (!flags.hold_out.empty()) {
    GS_ASSIGN(const HeldOutLogs split, CombineHeldOut(flags.model.logs, flags.hold_out));
    flags.model.logs = split.all;
    flags.options.held_out = split.held_out;
  }
  GS_ASSIGN(const Session session, LoadSession(flags.model, flags.common));
  if (session.experiment.commands.empty())
    return Error{.what = "the experiment has no command", .where = flags.model.experiment, .cure = "add 'commands:'"};
  PrintFindings(session.recordings, flags.common.quiet);
  GS_ASSIGN(Identification result,
            flags.method({.model = *session.model, .values = session.values, .recordings = session.recordings},
                         flags.options));
  IdentifyRun run{.info = {.seed = flags.common.seed}, .result = std::move(result), .logs = {}};
  for (const auto& recording : session.recordings) run.logs.push_back(recording.log_path);
  const nlohmann::ordered_json json = ToJson(run);
  if (!flags.common.out.empty()) GS_RETURN_IF_ERROR(WriteIdentification(flags.common.out, run.result, json));
  Print(stdout, "{}", flags.common.json ? JsonText(json) : ToTable(run));
  return kDone;
}

}  // namespace

namespace {

struct Entry {
  const char *name, *what, *rig;
  Method method;
};
constexpr Entry kMethods[] = {
    {"pd", "Gains of a position servo and the delay of its torque", "joint", IdentifyPd},
    {"torque-constant", "Torque against current: constant and droop", "joint", IdentifyTorqueConstant},
    {"tn-curve", "Torque against speed: peak, constant power, fastest", "joint", IdentifyTnCurve},
    {"friction", "Dry and viscous friction by direction, from any sliding motion", "qube", IdentifyFriction},
    {"resistance", "Winding resistance from voltage steps with the rotor held", "qube", IdentifyResistance},
    {"current-offset", "Offset of the current sensor at rest", "qube", IdentifyCurrentOffset},
    {"ring-down", "Frequency, viscous and dry friction of a free swing", "qube", IdentifyRingDown},
    {"inertia", "Inertia of the driven joint from accelerations", "qube", IdentifyInertia},
    {"steady", "Equivalent viscous damping from settled speeds", "qube", IdentifySteady},
    {"resonance", "Peak, stiffness and damping of a flexible joint", "flexjoint", IdentifyResonance},
    {"state-space", "State space of a flexible joint by constrained least squares", "flexjoint", IdentifyStateSpace},
    {"cable", "Spring and rest angle of a cable on the driven joint", "qube", IdentifyCable},
};

std::vector<Option> SharedOptions(IdentifyOptions& o) {
  return {{.flag = "--cutoff",
           .value = &o.cutoff_hz,
           .unit = "Hz",
           .range = Above(0, 0),
           .unset = "a twelfth of the sample rate, at most 15",
           .help = "Of the zero-phase low pass",
           .more = "Speeds and accelerations come from positions smoothed by it; the motion must lie well below it"},
          {.flag = "--from",
           .value = &o.from_s,
           .unit = "s",
           .range = AtLeast(0),
           .help = "Use the logs from this time on"},
          {.flag = "--to",
           .value = &o.to_s,
           .unit = "s",
           .range = Above(0, 0),
           .unset = "their end",
           .help = "Use the logs up to this time"},
          {.flag = "--joint",
           .value = &o.joint,
           .unset = "the driven one; of ring-down and resonance the swinging one",
           .help = "Which joint"}};
}

std::vector<Option> CurrentOptions(IdentifyOptions& o) {
  return {{.flag = "--current-column", .value = &o.current_column, .help = "Column of the current"},
          {.flag = "--current-unit", .value = &o.current_unit, .help = "Its unit"}};
}

Option TorqueDelayOption(IdentifyOptions& o) {
  return {.flag = "--torque-delay",
          .value = &o.torque_delay_s,
          .unit = "s",
          .range = Between(0, 1),
          .help = "Of a servo whose torque is logged: which target a logged torque has seen",
          .more = "`identify pd` gives it"};
}

Option FreeInertiaOption(IdentifyOptions& o) {
  return {.flag = "--free-inertia",
          .value = &o.free_inertia,
          .help = "Scale the model's inertial torques to the log",
          .more = "For fast motion, where the model's inertia is not known well; otherwise they are trusted"};
}

// What only one method, or a few, take.
std::vector<Option> OwnOptions(const std::string& method, IdentifyFlags& flags) {
  IdentifyOptions& o = flags.options;
  if (method == "torque-constant" || method == "resistance" || method == "current-offset") return CurrentOptions(o);
  if (method == "pd")
    return {{.flag = "--longest-delay",
             .value = &o.longest_delay_s,
             .unit = "s",
             .range = Above(0),
             .help = "End of the scan of delays"},
            {.flag = "--torque-limit",
             .value = &o.torque_limit,
             .unit = "as the torque is logged",
             .range = Above(0, 0),
             .unset = "runs of equal extreme values",
             .help = "Rows at this torque are left out: the servo was at its limit"}};
  if (method == "tn-curve")
    return {{.flag = "--rated-torque",
             .value = &o.rated_torque_n_m,
             .unit = "N m",
             .range = Above(0, 0),
             .unset = "no comparison",
             .help = "Data sheet's rated torque"},
            {.flag = "--rated-speed-rpm",
             .value = &flags.rated_speed_rpm,
             .unit = "rpm",
             .range = Above(0, 0),
             .unset = "no comparison",
             .help = "Data sheet's rated speed"}};
  if (method == "inertia") return {TorqueDelayOption(o)};
  if (method == "friction" || method == "cable") return {TorqueDelayOption(o), FreeInertiaOption(o)};
  if (method == "steady")
    return {{.flag = "--coulomb",
             .value = &o.coulomb_n_m,
             .unit = "N m",
             .range = AtLeast(0, -1),
             .unset = "fitted",
             .help = "Dry friction, held at this"}};
  if (method == "state-space")
    return {{.flag = "--bounds",
             .value = &o.bounds_share,
             .range = Above(0),
             .help = "Coefficients stay within this share of nominal"},
            {.flag = "--hold-out",
             .value = &flags.hold_out,
             .stands_for = LogsNamed,
             .help = "Score on this log, do not fit it; more than once"}};
  return {};
}

Command MethodCommand(const Entry& entry) {
  auto flags = std::make_shared<IdentifyFlags>();
  flags->method = entry.method;
  return {.name = entry.name,
          .what = entry.what,
          .options = Join({LogOptions(flags->model),
                           OwnOptions(entry.name, *flags),
                           SharedOptions(flags->options),
                           EffectOptions(flags->model),
                           {FolderOption(flags->common, "result.json and the points behind it as CSV")},
                           CommonOptions(flags->common)}),
          .example = fmt::format("gapscope identify {} models/{}/experiment.yaml log.csv", entry.name, entry.rig),
          .run = [flags] { return RunIdentify(*flags); }};
}

}  // namespace

Command IdentifyCommand() {
  Command identify = {.name = "identify",
                      .what = "Parameters by direct identification, without a simulation",
                      .example = "gapscope identify pd models/joint/experiment.yaml chirp.csv"};
  for (const Entry& entry : kMethods) identify.commands.push_back(MethodCommand(entry));
  return identify;
}

}  // namespace gapscope::cli

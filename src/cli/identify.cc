#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/report/identify_report.h"
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
  std::vector<std::vector<std::vector<double>>> columns;  // that the tables point to
  for (const auto& points : result.tables) columns.push_back(ColumnsOf(points));
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
  fmt::print("{}", flags.common.json ? json.dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

void AddIdentify(CLI::App& program, Run& run) {
  CLI::App* identify = program.add_subcommand("identify", "Parameters by direct identification, without a simulation");
  identify->require_subcommand(1);
  identify->footer("Example: gapscope identify pd models/joint/experiment.yaml chirp.csv");
  struct Entry {
    const char *name, *what, *rig;
    Method method;
  };
  const Entry entries[] = {
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
  for (const Entry& entry : entries) {
    auto flags = std::make_shared<IdentifyFlags>();
    flags->method = entry.method;
    IdentifyOptions& o = flags->options;
    CLI::App* command = identify->add_subcommand(entry.name, entry.what);
    AddModelFlags(*command, flags->model, true);
    AddCommonFlags(*command, flags->common, true);
    command
        ->add_option("--cutoff", o.cutoff_hz,
                     "Of the zero-phase low pass, Hz (default: a twelfth of the sample rate, at most 15)")
        ->check(FinitePositive());
    command->add_option("--from", o.from_s, "Use the logs from this time on, s")->check(FiniteIn(0, 1e9));
    command->add_option("--to", o.to_s, "Use the logs up to this time, s")->check(FinitePositive());
    command->add_option("--joint", o.joint,
                        "Which joint (default: the driven one; ring-down, resonance: the swinging one)");
    const std::string name = entry.name;
    if (name == "torque-constant" || name == "resistance" || name == "current-offset") {
      command->add_option("--current-column", o.current_column, "Column of the current")->capture_default_str();
      command->add_option("--current-unit", o.current_unit, "Its unit")->capture_default_str();
    }
    if (name == "pd") {
      command->add_option("--longest-delay", o.longest_delay_s, "End of the scan, s")
          ->check(FinitePositive())
          ->capture_default_str();
      command
          ->add_option("--torque-limit", o.torque_limit,
                       "Rows at this torque are left out (default: runs of equal extreme values)")
          ->check(FinitePositive());
    }
    if (name == "tn-curve") {
      command->add_option("--rated-torque", o.rated_torque_n_m, "Data sheet's, N m")->check(FinitePositive());
      command->add_option("--rated-speed-rpm", flags->rated_speed_rpm, "Data sheet's")->check(FinitePositive());
    }
    if (name == "inertia" || name == "friction" || name == "cable") {
      command
          ->add_option("--torque-delay", o.torque_delay_s,
                       "Of a servo whose torque is logged, s (from identify pd): which target a logged torque has seen")
          ->check(FiniteIn(0, 1));
    }
    if (name == "friction" || name == "cable")
      command->add_flag("--free-inertia", o.free_inertia,
                        "Scale the model's inertial torques to the log: for fast motion, where the model's inertia is "
                        "not known well");
    if (name == "steady")
      command->add_option("--coulomb", o.coulomb_n_m, "Dry friction, N m (default: fitted)")->check(FiniteIn(0, 1e6));
    if (name == "state-space") {
      command->add_option("--bounds", o.bounds_share, "Coefficients stay within this share of nominal")
          ->check(FinitePositive())
          ->capture_default_str();
      command->add_option("--hold-out", flags->hold_out, "Score on this log, do not fit it")->allow_extra_args(false);
    }
    command->footer(
        fmt::format("Example: gapscope identify {} models/{}/experiment.yaml log.csv", entry.name, entry.rig));
    command->callback([flags, &run] { run = [flags] { return RunIdentify(*flags); }; });
  }
}

}  // namespace gapscope::cli

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "src/cli/bundle.h"
#include "src/cli/commands.h"
#include "src/cli/diagnose_job.h"
#include "src/cli/print.h"
#include "src/cli/profile.h"
#include "src/core/option_words.h"
#include "src/diagnose/policy.h"
#include "src/log/foreign.h"
#include "src/report/diagnose_report.h"
#include "src/report/json.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

// What the command takes beside the job.
struct CommandFlags : DiagnoseFlags {
  std::vector<std::string> plugins;
  std::string bundle, expect;
  bool bundle_digests = false;
};

std::vector<Option> DecidingOptions(CommandFlags& flags);

// With --bundle: what the run reads, before it is read.
Result<std::optional<Bundle>> BundleOf(const CommandFlags& flags) {
  if (flags.bundle.empty() && flags.bundle_digests)
    return Error{.what = "no bundle to leave the logs out of", .where = "--bundle-digests", .cure = "--bundle FILE"};
  if (flags.bundle.empty()) return std::optional<Bundle>();
  if (!flags.bundle.ends_with(".zip"))
    return Error{.what = "not a bundle's name", .where = "--bundle", .actual = flags.bundle, .allowed = "FILE.zip"};
  if (!flags.from.empty())
    return Error{.what = "a bundle holds no earlier diagnosis",
                 .where = "--bundle",
                 .actual = "--from " + flags.from,
                 .cure = "state what it found with --with and --set"};
  GS_ASSIGN(const Experiment experiment, LoadExperiment(flags.model.experiment));
  GS_ASSIGN(const HeldOutLogs logs, CombineHeldOut(flags.model.logs, flags.hold_out));
  BundleInputs inputs{.logs = logs.all, .others = flags.model.params, .digests_only = flags.bundle_digests};
  inputs.others.insert(inputs.others.end(), flags.plugins.begin(), flags.plugins.end());
  GS_ASSIGN(Bundle bundle, Bundle::Of(experiment, inputs));
  return std::optional(std::move(bundle));
}

// The command that gives this result from a bundle: what decides the digits, and nothing of this machine's.
std::vector<std::string> ReplayWords(const CommandFlags& given, const Bundle& bundle) {
  CommandFlags flags = given;
  flags.resume = false;
  flags.model.experiment = bundle.Moved(flags.model.experiment);
  for (auto* paths : {&flags.model.logs, &flags.model.params, &flags.hold_out, &flags.plugins}) {
    for (std::string& path : *paths) path = bundle.Moved(path);
  }
  std::vector<std::string> words = WordsOf(DecidingOptions(flags));
  words.insert(words.begin(), "diagnose");
  words.push_back(fmt::format("--seed={}", flags.common.seed));
  for (const std::string& plugin : flags.plugins) words.push_back("--plugin=" + plugin);
  return words;
}

Status WriteBundle(const CommandFlags& flags, const Bundle& bundle, const DiagnoseRun& run) {
  if (!run.diagnosis.interrupted) return bundle.Write(flags.bundle, ReplayWords(flags, bundle), ToJson(run));
  Print(stderr, "warning: {} is not written: an interrupted run cannot be repeated\n", flags.bundle);
  return Ok();
}

// With --expect: are the digits those of `expected`?
int StatusOf(const CommandFlags& flags, const nlohmann::ordered_json& expected, const DiagnoseRun& run) {
  if (flags.expect.empty()) return kDone;
  const nlohmann::ordered_json got = ToJson(run);
  const std::string differences = Differences(expected, got);
  if (differences.empty()) {
    if (!flags.common.quiet) Print(stderr, "gapscope: the same digits as {}\n", flags.expect);
    return kDone;
  }
  Print(stderr, "gapscope: other digits than {}\n{}", flags.expect, differences);
  const auto versions = expected.contains("versions") ? expected["versions"] : nlohmann::ordered_json();
  if (versions != got["versions"])
    Print(stderr, "it was made by {}, this is {}\n", versions.dump(), got["versions"].dump());
  return kBelowThreshold;
}

Result<int> RunDiagnose(const CommandFlags& flags) {
  StageClock clock(flags.common);
  nlohmann::ordered_json expected;
  if (!flags.expect.empty()) {
    GS_ASSIGN(expected, ReadJson(flags.expect));
    if (TextIn(expected, "schema") != kDiagnosisSchema)
      return Error{.what = "not a diagnosis", .where = "--expect " + flags.expect, .allowed = kDiagnosisSchema};
  }
  GS_ASSIGN(const std::optional<Bundle> bundle, BundleOf(flags));
  GS_ASSIGN(const DiagnoseRun run, DiagnoseLogs(flags, &clock));
  if (bundle) GS_RETURN_IF_ERROR(WriteBundle(flags, *bundle, run));
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return StatusOf(flags, expected, run);
}

// What the search knows beforehand, and how far it goes.
std::vector<Option> SearchOptions(CommandFlags& flags) {
  return {
      {.flag = "--hold-out",
       .value = &flags.hold_out,
       .stands_for = LogsNamed,
       .help = "A log to judge by, not to fit; more than once",
       .more = "Without it whole logs are held out where there are several, blocks of time where there is one; the "
               "result says which"},
      {.flag = "--prior",
       .value = &flags.prior,
       .help = "What is known of an effect: EFFECT=P or EFFECT@PLACE=P, P from 0 to 1, more than once",
       .more =
           "Multiplies the odds that the logs give: 0.9 says nine to one before the logs are seen, 0.5 (every other "
           "effect's) nothing. The result has both, `prior` and `evidence`"},
      {.flag = "--from",
       .value = &flags.from,
       .help = "Go on from an earlier diagnosis of the same experiment and logs: its folder",
       .more =
           "The effects that it found become known, as with --with and --set; what is missing beside them is looked "
           "for. --accept takes some of them"},
      {.flag = "--accept",
       .value = &flags.accept,
       .unset = "all effects of its final model",
       .help = "A statement of --from, by number or EFFECT@PLACE, more than once"},
      {.flag = "--freeze",
       .value = &flags.freeze,
       .help = "Hold a parameter at its value, more than once",
       .more =
           "Of the base model, or of a known effect (--with, --from): what is measured better than logs can tell is "
           "not fitted"},
      {.flag = "--budget",
       .value = &flags.budget_s,
       .unit = "s",
       .range = Above(0, 0),
       .unset = "no limit of time",
       .help = "Time; the best verdict so far when it is spent",
       .more = "Without it the work is limited by --effort alone, and the verdict is the same on any machine. Of a "
               "resumed run: from its own start on"},
      {.flag = "--effort",
       .value = ChoiceOf(flags.effort),
       .help = "How much work the search may take",
       .more = fmt::format("Work is counted in simulated steps: 0.3, 1 and 4 times {} replays of the training windows",
                           kDiagnosePolicy.search.replays)},
      WindowOption(flags.window_s),
      {.flag = "--no-next-experiment",
       .value = &flags.no_next_experiment,
       .help = "Design no next experiment: a good part of a short run"},
      {.flag = "--resume",
       .value = &flags.resume,
       .help = "Go on with the interrupted run in --out, to the same result",
       .more = "Fits and columns of a run are kept in --out/diagnosis.journal until its result is written"}};
}

std::vector<Option> BundleOptions(CommandFlags& flags) {
  return {{.flag = "--bundle",
           .value = &flags.bundle,
           .unset = "none",
           .help = "FILE.zip for all that this diagnosis read, its command, versions and result",
           .more = "`unzip FILE.zip && sh run.sh` runs it again on any machine and compares the digits "
                   "(docs/how-to/bundle.md)"},
          {.flag = "--bundle-digests",
           .value = &flags.bundle_digests,
           .help = "Of the logs, put only the digests into the bundle",
           .more = "Whoever runs it again puts the logs into their places; run.sh checks that they are the same"},
          {.flag = "--expect",
           .value = &flags.expect,
           .unset = "nothing is compared",
           .help = "A result.json of this diagnosis: exit status 1 where the digits differ",
           .more = "Compared is all but wall time and versions; stderr tells the first differences"}};
}

// With the seed, those that decide what the result says.
std::vector<Option> DecidingOptions(CommandFlags& flags) {
  return Join({LogOptions(flags.model), EffectOptions(flags.model), SearchOptions(flags)});
}

std::vector<Option> OptionsOf(CommandFlags& flags) {
  return Join({DecidingOptions(flags),
               BundleOptions(flags),
               {FolderOption(flags.common, "result.json, report.html, model.xml and next_experiment.csv")},
               ProfileOptions(flags.common),
               CommonOptions(flags.common)});
}

bool HasPluginCandidates(const std::string& path) {
  const auto experiment = LoadExperiment(path);
  return experiment.ok() &&
         std::ranges::any_of(experiment.value().candidates, [](const OwnEffect& own) { return !own.plugin.empty(); });
}

}  // namespace

Command DiagnoseCommand() {
  auto flags = std::make_shared<CommandFlags>();
  return {.name = "diagnose",
          .what = "Where the gap lies, which unmodelled effect causes it, how far it shrinks",
          .options = OptionsOf(*flags),
          .example = "gapscope diagnose models/qube/experiment.yaml a.csv b.csv c.csv --hold-out d.csv --out diagnosis",
          .run = [flags] { return RunDiagnose(*flags); },
          .plugins = &flags->plugins,
          .leave_out_plugins =
              [flags](const std::string& crash) {
                if (flags->plugins.empty() || !HasPluginCandidates(flags->model.experiment)) return false;
                flags->plugin_fault = crash.empty() ? "" : "the diagnosis crashed with it: " + crash;
                flags->resume = flags->resume && crash.empty();
                return true;
              }};
}

}  // namespace gapscope::cli

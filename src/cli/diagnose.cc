#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "src/cli/bundle.h"
#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/core/option_words.h"
#include "src/diagnose/diagnosis_journal.h"
#include "src/diagnose/policy.h"
#include "src/report/diagnose_report.h"
#include "src/report/read_diagnosis.h"
#include "src/report/read_run.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

struct DiagnoseFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> hold_out, prior, accept, freeze;
  std::string from;
  SearchEffort effort = SearchEffort::kNormal;
  double budget_s = 0, window_s = 0;
  bool resume = false, no_next_experiment = false;
  std::vector<std::string> plugins;
  std::string bundle, expect;
  bool bundle_digests = false;
};

std::vector<Option> DecidingOptions(DiagnoseFlags& flags);

// What each effect of the final model does along a log, beside what is missing without it.
Result<std::vector<EffectCurve>> CurvesOf(const Diagnosis& diagnosis, const Recording& recording,
                                          const ScaleTable& scales) {
  constexpr std::size_t kBins = 40;
  std::vector<EffectCurve> all;
  const Model& model = *diagnosis.model;
  const auto with = EstimateResidualTorque(model, diagnosis.values, recording);
  for (const FoundEffect& found : diagnosis.effects) {
    std::vector<EffectUse> rest = model.effects();
    std::erase(rest, found.use);
    GS_ASSIGN(const auto without, Model::Build(model.rig(), rest, scales));
    const auto values = Collect(without->parameters(), [&](const Parameter& p) {
      return diagnosis.values[static_cast<std::size_t>(model.IndexOf(p.name))];
    });
    auto curve = CompareTorques(EstimateResidualTorque(*without, values, recording), with, kBins);
    if (curve) all.push_back({Words(found.use), *std::move(curve)});
  }
  return all;
}

// `log_values`: of the first log, for the MJCF.
Status WriteDiagnosis(const std::string& out, const Experiment& experiment, const DataSplit& data,
                      const std::map<std::string, double>& log_values, const DiagnoseRun& run, ThreadPool& pool) {
  const Diagnosis& diagnosis = run.diagnosis;
  GS_ASSIGN(const auto bare, Model::Build(diagnosis.model->rig()));
  RunFiles files;
  const ScaleTable scales = EstimateScales(*bare, data.train);
  GS_ASSIGN(files.model_xml, diagnosis.model->ToXml(diagnosis.values, log_values, scales));
  const ReportLogs logs{data.train, data.held_out};
  ReportSource source = SourceOf(experiment, logs);
  source.content = PageOf(run);
  source.predictions = Predict(experiment, logs,
                               {{"nominal", diagnosis.refit_model, diagnosis.nominal_values},
                                {"refitted", diagnosis.refit_model, diagnosis.refit_values},
                                {"diagnosed", diagnosis.model, diagnosis.values}},
                               pool);
  GS_ASSIGN(source.curves, CurvesOf(diagnosis, data.held_out.front(), scales));
  source.model = diagnosis.refit_model.get();
  source.values = diagnosis.nominal_values;
  source.parameters = diagnosis.model->parameters();
  files.report = &source;
  files.next_experiment = diagnosis.next.input_csv;
  return WriteRun(out, ToJson(run), files);
}

// What is known of the base model before the search.
struct Known {
  std::vector<std::string> with;  // EFFECT@PLACE
  std::map<std::string, double> values;
};

std::set<std::filesystem::path> FilesOf(const std::vector<std::string>& paths) {
  std::set<std::filesystem::path> files;
  std::error_code failure;
  for (const auto& path : paths) files.insert(std::filesystem::weakly_canonical(path, failure));
  return files;
}

// An earlier diagnosis must be of this experiment and these logs: sizes that other data gave are --set's.
Status CheckSameData(const EarlierDiagnosis& earlier, const DiagnoseFlags& flags) {
  if (FilesOf({earlier.model.experiment}) != FilesOf({flags.model.experiment}))
    return Error{.what = "a diagnosis of another experiment",
                 .where = "--from " + flags.from,
                 .actual = earlier.model.experiment,
                 .allowed = flags.model.experiment};
  std::vector<std::string> given = flags.model.logs, then = earlier.train_logs;
  given.insert(given.end(), flags.hold_out.begin(), flags.hold_out.end());
  then.insert(then.end(), earlier.held_out_logs.begin(), earlier.held_out_logs.end());
  if (FilesOf(given) != FilesOf(then))
    return Error{.what = "a diagnosis of other logs",
                 .where = "--from " + flags.from,
                 .actual = Join(then),
                 .allowed = Join(given),
                 .cure = "give the same logs, or state what is known with --with and --set"};
  return Ok();
}

// The accepted statements of an earlier diagnosis; without --accept all that its final model has.
Result<Known> AcceptEarlier(const DiagnoseFlags& flags) {
  Known known;
  if (flags.from.empty()) {
    if (flags.accept.empty()) return known;
    return Error{
        .what = "nothing to accept from", .where = "--accept", .cure = "name the earlier diagnosis with --from"};
  }
  GS_ASSIGN(const auto json, ReadJson(flags.from));
  GS_ASSIGN(const EarlierDiagnosis earlier, ReadDiagnosis(json, flags.from));
  GS_RETURN_IF_ERROR(CheckSameData(earlier, flags));
  std::vector<std::size_t> accepted;
  for (const auto& word : flags.accept) {
    GS_ASSIGN(const std::size_t place, FindStatement(earlier, word, "--accept"));
    if (earlier.statements[place].parameters.empty())
      return Error{.what = "no size was found for " + earlier.statements[place].use.Text(),
                   .where = "--accept " + word,
                   .allowed = "a statement whose effect is in the final model",
                   .cure = "add it with --with, and --set its size"};
    accepted.push_back(place);
  }
  for (std::size_t i = 0; i < earlier.statements.size() && flags.accept.empty(); ++i) {
    if (!earlier.statements[i].parameters.empty()) accepted.push_back(i);
  }
  for (const std::size_t place : accepted) {
    const std::string name = earlier.statements[place].use.Text();
    known.with.push_back(name);
    for (const auto& [parameter, value] : earlier.model.values) {
      if (parameter.starts_with(name + ".")) known.values[parameter] = value;
    }
  }
  return known;
}

// What --from, --with, --set and --params say of the base model, the later ones over the earlier.
Status AddKnown(const DiagnoseFlags& flags, const Experiment& experiment, const DataSplit& data,
                DiagnoseOptions* options) {
  GS_ASSIGN(Known known, AcceptEarlier(flags));
  const ModelFlags& model = flags.model;
  known.with.insert(known.with.end(), model.with.begin(), model.with.end());
  if (known.with.empty() && model.set.empty() && model.params.empty() && flags.freeze.empty()) return Ok();
  GS_ASSIGN(const auto bare, Model::Load(experiment));
  GS_ASSIGN(options->known, ParseEffects(known.with, *bare->rig()));
  GS_ASSIGN(const auto base, Model::Build(bare->rig(), options->known, EstimateScales(*bare, data.train)));
  std::vector<double> given(base->parameters().size(), kNaN);
  GS_RETURN_IF_ERROR(OverrideValues(*base, model.params, model.set, &given));
  for (const auto& name : flags.freeze) {
    GS_ASSIGN(const int index, base->Find(name, "--freeze"));
    options->frozen.insert(base->parameters()[static_cast<std::size_t>(index)].name);
  }
  options->values = std::move(known.values);
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (std::isfinite(given[i])) options->values[base->parameters()[i].name] = given[i];
  }
  return Ok();
}

Result<DiagnoseOptions> OptionsOf(const DiagnoseFlags& flags, const Experiment& experiment) {
  DiagnoseOptions options{.budget_s = flags.budget_s,
                          .effort = flags.effort,
                          .window_s = flags.window_s > 0 ? flags.window_s : experiment.replay.window_s,
                          .seed = flags.common.seed,
                          .resume = flags.resume,
                          .next_experiment = !flags.no_next_experiment};
  for (const auto& text : flags.prior) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--prior"));
    options.priors.insert_or_assign(assignment.first, assignment.second);
  }
  if (!flags.common.out.empty()) options.journal = DiagnosisJournal::FolderIn(flags.common.out);
  options.warn = [](const std::string& text) { fmt::print(stderr, "warning: {}\n", text); };
  return options;
}

// With --bundle: what the run reads, before it is read.
Result<std::optional<Bundle>> BundleOf(const DiagnoseFlags& flags, const Experiment& experiment,
                                       const std::vector<std::string>& logs) {
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
  BundleInputs inputs{.logs = logs, .others = flags.model.params, .digests_only = flags.bundle_digests};
  inputs.others.insert(inputs.others.end(), flags.plugins.begin(), flags.plugins.end());
  GS_ASSIGN(Bundle bundle, Bundle::Of(experiment, inputs));
  return std::optional(std::move(bundle));
}

// The command that gives this result from a bundle: what decides the digits, and nothing of this machine's.
std::vector<std::string> ReplayWords(const DiagnoseFlags& given, const Bundle& bundle) {
  DiagnoseFlags flags = given;
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

Status WriteBundle(const DiagnoseFlags& flags, const Bundle& bundle, const DiagnoseRun& run) {
  if (!run.diagnosis.interrupted) return bundle.Write(flags.bundle, ReplayWords(flags, bundle), ToJson(run));
  fmt::print(stderr, "warning: {} is not written: an interrupted run cannot be repeated\n", flags.bundle);
  return Ok();
}

// With --expect: are the digits those of `expected`?
int StatusOf(const DiagnoseFlags& flags, const nlohmann::ordered_json& expected, const DiagnoseRun& run) {
  if (flags.expect.empty()) return kDone;
  const std::string differences = Differences(expected, ToJson(run));
  if (differences.empty()) {
    if (!flags.common.quiet) fmt::print(stderr, "gapscope: the same digits as {}\n", flags.expect);
    return kDone;
  }
  fmt::print(stderr, "gapscope: other digits than {}\n{}", flags.expect, differences);
  const auto versions = expected.value("versions", nlohmann::ordered_json::object());
  if (const auto own = ToJson(run)["versions"]; versions != own)
    fmt::print(stderr, "it was made by {}, this is {}\n", versions.dump(), own.dump());
  return kBelowThreshold;
}

Result<int> RunDiagnose(const DiagnoseFlags& flags) {
  if (flags.resume && flags.common.out.empty())
    return Error{
        .what = "nothing to resume from", .where = "--resume", .cure = "name the interrupted run's folder with --out"};
  StageClock clock(flags.common);
  nlohmann::ordered_json expected;
  if (!flags.expect.empty()) {
    GS_ASSIGN(expected, ReadJson(flags.expect));
  }
  ThreadPool pool(WorkersOf(flags.common));
  GS_ASSIGN(Experiment experiment, LoadExperiment(flags.model.experiment));
  if (!flags.model.while_column.empty()) experiment.replay.while_column = flags.model.while_column;
  GS_ASSIGN(const HeldOutLogs logs, CombineHeldOut(flags.model.logs, flags.hold_out));
  GS_ASSIGN(const std::optional<Bundle> bundle, BundleOf(flags, experiment, logs.all));
  GS_ASSIGN(auto recordings, LoadRecordings(experiment, logs.all, pool));
  PrintFindings(recordings, flags.common.quiet);
  const auto log_values = recordings.front().values;
  const DataSplit data = SplitData(std::move(recordings), logs.held_out);
  GS_ASSIGN(DiagnoseOptions options, OptionsOf(flags, experiment));
  GS_RETURN_IF_ERROR(AddKnown(flags, experiment, data, &options));
  options.stop = CatchInterrupts();
  clock.Enter("diagnose");
  auto diagnosed = [&] {
    ProgressLine line(flags.common, &clock);
    if (line.live())
      options.progress = [&line](const DiagnoseProgress& p) {
        line.Show({.stage = p.stage,
                   .done = static_cast<double>(p.steps),
                   .total = p.most_steps > 0 ? static_cast<double>(p.most_steps) : kNaN,
                   .steps = p.steps},
                  p.stage);
      };
    return Diagnose(experiment, data, options, pool);
  }();
  if (!diagnosed.ok()) return diagnosed.error();
  clock.Enter("write");
  clock.Count(diagnosed.value().work.replays, diagnosed.value().work.steps);
  PrintLeftOut(*diagnosed.value().model->rig());
  const DiagnoseRun run{.info = {.seed = flags.common.seed}, .diagnosis = std::move(diagnosed).value()};
  if (!flags.common.out.empty()) {
    GS_RETURN_IF_ERROR(WriteDiagnosis(flags.common.out, experiment, data, log_values, run, pool));
    // An interrupted search can go on.
    if (!run.diagnosis.interrupted) DiagnosisJournal::Remove(options.journal);
  }
  if (bundle) GS_RETURN_IF_ERROR(WriteBundle(flags, *bundle, run));
  fmt::print("{}", flags.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return StatusOf(flags, expected, run);
}

// What the search knows beforehand, and how far it goes.
std::vector<Option> SearchOptions(DiagnoseFlags& flags) {
  return {
      {.flag = "--hold-out",
       .value = &flags.hold_out,
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

std::vector<Option> BundleOptions(DiagnoseFlags& flags) {
  return {{.flag = "--bundle",
           .value = &flags.bundle,
           .unset = "none",
           .help = "FILE.zip for all that this diagnosis read, its command, versions and result",
           .more = "`unzip FILE.zip && sh run.sh` runs it again on any machine and compares the digits "
                   "(docs/diagnosis.md)"},
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
std::vector<Option> DecidingOptions(DiagnoseFlags& flags) {
  return Join({LogOptions(flags.model), EffectOptions(flags.model), SearchOptions(flags)});
}

std::vector<Option> OptionsOf(DiagnoseFlags& flags) {
  return Join({DecidingOptions(flags),
               BundleOptions(flags),
               {FolderOption(flags.common, "result.json, report.html, model.xml and next_experiment.csv")},
               ProfileOptions(flags.common),
               CommonOptions(flags.common)});
}

}  // namespace

Command DiagnoseCommand() {
  auto flags = std::make_shared<DiagnoseFlags>();
  return {.name = "diagnose",
          .what = "Where the gap lies, which unmodelled effect causes it, how far it shrinks",
          .options = OptionsOf(*flags),
          .example = "gapscope diagnose models/qube/experiment.yaml a.csv b.csv c.csv --hold-out d.csv --out diagnosis",
          .run = [flags] { return RunDiagnose(*flags); },
          .plugins = &flags->plugins};
}

}  // namespace gapscope::cli

#include <fmt/core.h>
#include <unistd.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/session.h"
#include "src/diagnose/diagnosis_journal.h"
#include "src/diagnose/policy.h"
#include "src/report/diagnose_report.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

struct DiagnoseFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> hold_out, prior;
  SearchEffort effort = SearchEffort::kNormal;
  double budget_s = 0, window_s = 0;
  bool resume = false;
};

// `log_values`: of the first log, for the MJCF.
Status WriteDiagnosis(const std::string& out, const Experiment& experiment, const DataSplit& data,
                      const std::map<std::string, double>& log_values, const DiagnoseRun& run, ThreadPool& pool) {
  const Diagnosis& diagnosis = run.diagnosis;
  GS_ASSIGN(const auto bare, Model::Build(diagnosis.model->rig()));
  RunFiles files;
  GS_ASSIGN(files.model_xml, diagnosis.model->ToXml(diagnosis.values, log_values, EstimateScales(*bare, data.train)));
  const ReportLogs logs{data.train, data.held_out};
  ReportSource source = SourceOf(experiment, logs);
  source.content = PageOf(run);
  source.predictions = Predict(experiment, logs,
                               {{"nominal", diagnosis.refit_model, diagnosis.nominal_values},
                                {"refitted", diagnosis.refit_model, diagnosis.refit_values},
                                {"diagnosed", diagnosis.model, diagnosis.values}},
                               pool);
  source.model = diagnosis.refit_model.get();
  source.values = diagnosis.nominal_values;
  source.parameters = diagnosis.model->parameters();
  files.report = &source;
  return WriteRun(out, ToJson(run), files);
}

// What --with, --set and --params say of the base model.
Status AddKnown(const ModelFlags& flags, const Experiment& experiment, const DataSplit& data,
                DiagnoseOptions* options) {
  if (flags.with.empty() && flags.set.empty() && flags.params.empty()) return Ok();
  GS_ASSIGN(const auto bare, Model::Load(experiment));
  GS_ASSIGN(options->known, ParseEffects(flags.with, *bare->rig()));
  GS_ASSIGN(const auto base, Model::Build(bare->rig(), options->known, EstimateScales(*bare, data.train)));
  std::vector<double> given(base->parameters().size(), kNaN);
  GS_RETURN_IF_ERROR(OverrideValues(*base, flags.params, flags.set, &given));
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
                          .resume = flags.resume};
  for (const auto& text : flags.prior) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--prior"));
    options.priors.insert_or_assign(assignment.first, assignment.second);
  }
  if (!flags.common.out.empty()) options.journal = DiagnosisJournal::FolderIn(flags.common.out);
  options.warn = [](const std::string& text) { fmt::print(stderr, "warning: {}\n", text); };
  return options;
}

Result<int> RunDiagnose(const DiagnoseFlags& flags) {
  if (flags.resume && flags.common.out.empty())
    return Error{
        .what = "nothing to resume from", .where = "--resume", .cure = "name the interrupted run's folder with --out"};
  ThreadPool pool(flags.common.jobs > 0 ? flags.common.jobs : DefaultWorkers());
  GS_ASSIGN(Experiment experiment, LoadExperiment(flags.model.experiment));
  if (!flags.model.while_column.empty()) experiment.replay.while_column = flags.model.while_column;
  GS_ASSIGN(const HeldOutLogs logs, CombineHeldOut(flags.model.logs, flags.hold_out));
  GS_ASSIGN(auto recordings, LoadRecordings(experiment, logs.all, pool));
  PrintFindings(recordings, flags.common.quiet);
  const auto log_values = recordings.front().values;
  const DataSplit data = SplitData(std::move(recordings), logs.held_out);
  GS_ASSIGN(DiagnoseOptions options, OptionsOf(flags, experiment));
  GS_RETURN_IF_ERROR(AddKnown(flags.model, experiment, data, &options));
  const bool live = !flags.common.quiet && isatty(2);
  if (live) options.progress = [](const std::string& text) { fmt::print(stderr, "\r\033[K{}", text); };
  auto diagnosed = Diagnose(experiment, data, options, pool);
  if (live) fmt::print(stderr, "\r\033[K");
  if (!diagnosed.ok()) return diagnosed.error();
  const DiagnoseRun run{.info = {.seed = flags.common.seed}, .diagnosis = std::move(diagnosed).value()};
  if (!flags.common.out.empty()) {
    GS_RETURN_IF_ERROR(WriteDiagnosis(flags.common.out, experiment, data, log_values, run, pool));
    DiagnosisJournal::Remove(options.journal);
  }
  fmt::print("{}", flags.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

Command DiagnoseCommand() {
  auto flags = std::make_shared<DiagnoseFlags>();
  const std::vector<Option> own = {
      {.flag = "--hold-out",
       .value = &flags->hold_out,
       .help = "A log to judge by, not to fit; more than once",
       .more = "Without it whole logs are held out where there are several, blocks of time where there is one; the "
               "result says which"},
      {.flag = "--prior",
       .value = &flags->prior,
       .help = "What is known of an effect: EFFECT=P or EFFECT@PLACE=P, P from 0 to 1, more than once",
       .more =
           "Multiplies the odds that the logs give: 0.9 says nine to one before the logs are seen, 0.5 (every other "
           "effect's) nothing. The result has both, `prior` and `evidence`"},
      {.flag = "--budget",
       .value = &flags->budget_s,
       .unit = "s",
       .range = Above(0, 0),
       .unset = "no limit of time",
       .help = "Time; the best verdict so far when it is spent",
       .more = "Without it the work is limited by --effort alone, and the verdict is the same on any machine. Of a "
               "resumed run: from its own start on"},
      {.flag = "--effort",
       .value = ChoiceOf(flags->effort),
       .help = "How much work the search may take",
       .more = fmt::format("Work is counted in simulated steps: 0.3, 1 and 4 times {} replays of the training windows",
                           kDiagnosePolicy.search.replays)},
      WindowOption(flags->window_s),
      {.flag = "--resume",
       .value = &flags->resume,
       .help = "Go on with the interrupted run in --out, to the same result",
       .more = "Fits and columns of a run are kept in --out/diagnosis.journal until its result is written"}};
  return {.name = "diagnose",
          .what = "Where the gap lies, which unmodelled effect causes it, how far it shrinks",
          .options = Join({LogOptions(flags->model),
                           EffectOptions(flags->model),
                           own,
                           {FolderOption(flags->common, "result.json, report.html and model.xml")},
                           CommonOptions(flags->common)}),
          .example = "gapscope diagnose models/qube/experiment.yaml a.csv b.csv c.csv --hold-out d.csv --out diagnosis",
          .run = [flags] { return RunDiagnose(*flags); }};
}

}  // namespace gapscope::cli

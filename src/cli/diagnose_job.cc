#include "src/cli/diagnose_job.h"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/diagnose/diagnosis_journal.h"
#include "src/report/read_diagnosis.h"
#include "src/report/read_run.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

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
  source.by_windows = diagnosis.by_windows;
  source.content = PageOf(run);
  source.predictions = Predict(experiment, logs,
                               {{"nominal", diagnosis.refit_model, diagnosis.nominal_values},
                                {"refitted", diagnosis.refit_model, diagnosis.refit_values},
                                {"diagnosed", diagnosis.model, diagnosis.values}},
                               pool);
  GS_ASSIGN(source.curves, CurvesOf(diagnosis, data.held_out.front(), scales));
  source.model = diagnosis.model.get();
  source.values = diagnosis.values;
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
  options.warn = [](const std::string& text) { Print(stderr, "warning: {}\n", text); };
  return options;
}

}  // namespace

Result<DiagnoseRun> DiagnoseLogs(const DiagnoseFlags& flags, StageClock* clock) {
  if (flags.resume && flags.common.out.empty())
    return Error{
        .what = "nothing to resume from", .where = "--resume", .cure = "name the interrupted run's folder with --out"};
  ThreadPool pool(WorkersOf(flags.common));
  GS_ASSIGN(Experiment experiment, LoadExperiment(flags.model.experiment));
  if (!flags.model.while_column.empty()) experiment.replay.while_column = flags.model.while_column;
  for (OwnEffect& own : experiment.candidates) {
    if (!own.plugin.empty()) own.fault = flags.plugin_fault;
  }
  GS_ASSIGN(const HeldOutLogs logs, CombineHeldOut(flags.model.logs, flags.hold_out));
  auto loaded = [&] {
    ProgressLine line(flags.common);
    ShowReading(logs.all, &line);
    return LoadRecordings(experiment, logs.all, pool);
  }();
  GS_ASSIGN(auto recordings, std::move(loaded));
  PrintFindings(recordings, flags.common.quiet);
  const auto log_values = recordings.front().values;
  const DataSplit data = SplitData(std::move(recordings), logs.held_out);
  GS_ASSIGN(DiagnoseOptions options, OptionsOf(flags, experiment));
  GS_RETURN_IF_ERROR(AddKnown(flags, experiment, data, &options));
  options.stop = CatchInterrupts();
  if (clock) clock->Enter("diagnose");
  auto diagnosed = [&] {
    ProgressLine line(flags.common, clock);
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
  if (clock) {
    clock->Enter("write");
    clock->Count(diagnosed.value().work.replays, diagnosed.value().work.steps);
  }
  PrintLeftOut(*diagnosed.value().model->rig());
  DiagnoseRun run{.info = {.seed = flags.common.seed}, .diagnosis = std::move(diagnosed).value()};
  if (!flags.common.out.empty()) {
    GS_RETURN_IF_ERROR(WriteDiagnosis(flags.common.out, experiment, data, log_values, run, pool));
    // An interrupted search can go on.
    if (!run.diagnosis.interrupted) DiagnosisJournal::Remove(options.journal);
  }
  return run;
}

}  // namespace gapscope::cli

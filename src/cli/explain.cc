#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/report/explain_report.h"
#include "src/report/json.h"
#include "src/report/read_diagnosis.h"
#include "src/report/read_run.h"
#include "src/report/write_run.h"

namespace gapscope::cli {
namespace {

struct ExplainFlags {
  CommonFlags common;
  std::string diagnosis, statement;
};

// The page draws the held-out logs' windows by the model with the effect and by the one without it.
Status WriteExplanation(const ExplainFlags& flags, const EarlierDiagnosis& earlier, const ExplainRun& run) {
  ThreadPool pool(WorkersOf(flags.common));
  GS_ASSIGN(Experiment experiment, LoadExperiment(earlier.model.experiment));
  experiment.replay.while_column = earlier.while_column;
  experiment.replay.mode = ReplayMode::kWindows;
  GS_ASSIGN(const auto recordings, LoadRecordings(experiment, earlier.held_out_logs, pool));
  GS_ASSIGN(const auto bare, Model::Load(experiment));
  const ScaleTable scales = EstimateScales(*bare, recordings);
  std::vector<ReportModel> models;
  for (const auto& [label, named] :
       {std::pair("without it", &run.statement.sets->without), std::pair("with it", &run.statement.sets->with)}) {
    GS_ASSIGN(ResultModel model, BuildRunModel(bare->rig(), *named, flags.diagnosis, scales));
    models.push_back({label, std::move(model.model), std::move(model.values)});
  }
  const std::vector<Recording> none;
  const ReportLogs logs{none, recordings};
  ReportSource source = SourceOf(experiment, logs);
  source.content = PageOf(run);
  source.predictions = Predict(experiment, logs, models, pool);
  RunFiles files;
  files.report = &source;
  return WriteRun(flags.common.out, ToJson(run), files);
}

Result<int> RunExplain(const ExplainFlags& flags) {
  GS_ASSIGN(const auto json, ReadJson(flags.diagnosis));
  GS_ASSIGN(const EarlierDiagnosis earlier, ReadDiagnosis(json, flags.diagnosis));
  GS_ASSIGN(const std::size_t place, FindStatement(earlier, flags.statement, "STATEMENT"));
  const ExplainRun run{
      .info = {}, .diagnosis = flags.diagnosis, .number = place + 1, .statement = earlier.statements[place]};
  if (!flags.common.out.empty()) {
    if (!run.statement.sets) {
      return Error{.what = "nothing to draw: " + run.statement.use.Text() + " was not refitted",
                   .where = "--out",
                   .cure = "leave --out away, or take a statement that has `numbers`"};
    }
    GS_RETURN_IF_ERROR(WriteExplanation(flags, earlier, run));
  }
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToText(run));
  return kDone;
}

}  // namespace

Command ExplainCommand() {
  auto flags = std::make_shared<ExplainFlags>();
  const std::vector<Option> own = {
      {.flag = "diagnosis",
       .value = &flags->diagnosis,
       .required = true,
       .help = "Folder that diagnose --out wrote",
       .more = "Or its result.json, of this version of the program"},
      {.flag = "statement",
       .value = &flags->statement,
       .required = true,
       .help = "EFFECT@PLACE, or the statement's number",
       .more = "Numbers count from 1 on, in the order of `statements`; the console's table of a diagnosis has them"}};
  return {.name = "explain",
          .what = "The evidence of one statement of a diagnosis in full: numbers, rivals, where it shows",
          .options = Join({own,
                           {FolderOption(flags->common,
                                         "result.json and report.html, which draws the held-out windows "
                                         "with the effect and without it")},
                           CommonOptions(flags->common)}),
          .example = "gapscope explain diagnosis coulomb_friction@arm --out why",
          .run = [flags] { return RunExplain(*flags); }};
}

}  // namespace gapscope::cli

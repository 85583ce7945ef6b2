#include <fmt/core.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/cli/uncertain.h"
#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/export/randomize.h"
#include "src/export/target.h"
#include "src/log/npz_archive.h"
#include "src/report/export_report.h"
#include "src/report/json.h"
#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

struct ExportFlags {
  CommonFlags common;
  ResultSource source;
  std::string target = "mujoco";
  double time_step_s = 0;
  int draws = 0;
  std::optional<DrawsFrom> draws_from;

  std::string Path(const std::string& file) const { return (std::filesystem::path(common.out) / file).string(); }
};

Status Measure(const TargetInput& input, ExportRun* run, ThreadPool& pool) {
  std::error_code failed;
  for (const std::string& log : run->logs) {
    if (!std::filesystem::exists(log, failed)) {
      run->unmeasured = "the log " + log + " is not there";
      return Ok();
    }
  }
  if (run->logs.empty()) {
    run->unmeasured = "the result names no logs";
    return Ok();
  }
  GS_ASSIGN(const auto recordings, LoadRecordings(input.model.experiment(), run->logs, pool));
  const ExportedFile file = FileOf(input.exported, TargetOf(run->target).mjcf ? run->out : "");
  GS_ASSIGN(run->errors, MeasureFidelity(input.model, input.values, file, recordings, pool));
  return Ok();
}

// randomization.json and .npz.
Status WriteRandomization(const ExportFlags& flags, const ExportRun& run) {
  NpzArchive archive;
  archive.Add("parameters", {run.draws, run.randomization.ranges.size()}, run.randomization.drawn);
  for (const DrawnField& field : run.randomization.fields) archive.Add(field.name, field.shape, field.values);
  GS_RETURN_IF_ERROR(WriteFile(flags.Path("randomization.npz"), archive.Finish()));
  return WriteFile(flags.Path("randomization.json"), JsonText(RandomizationJson(run)));
}

// What is written beside fidelity.json: all of it is made before any of it is written.
Status WriteFiles(const ExportFlags& flags, const TargetInput& input, ExportRun* run) {
  const ExportTarget& target = TargetOf(flags.target);
  if (target.mujoco_3_11) SayAsMujoco311(input.exported.spec.get());
  GS_ASSIGN(const std::string xml, SpecToXml(*input.exported.spec, input.model.experiment().model_path));
  std::vector<TargetFile> files;
  if (target.files) {
    GS_ASSIGN(files, target.files(input));
  }
  if (target.mjcf) files.insert(files.begin(), {input.mjcf, xml});
  for (const TargetFile& file : files) {
    GS_RETURN_IF_ERROR(WriteFile(flags.Path(file.name), file.text));
    run->files.push_back(flags.Path(file.name));
  }
  run->out = run->files.front();
  run->files.erase(run->files.begin());
  return run->draws > 0 ? WriteRandomization(flags, *run) : Ok();
}

Choice TargetChoice(std::string* target) {
  return {.names = Collect(Targets(), &ExportTarget::name),
          .set = [target](const std::string& name) { *target = name; },
          .get = [target] { return *target; }};
}

Status CheckDraws(const ExportFlags& flags, const ExportTarget& target) {
  if (flags.draws > 0 && !target.mjcf)
    return Error{.what = target.what + " has no arrays to draw",
                 .where = "--to " + target.name + " --draws",
                 .allowed = "an engine that reads MJCF",
                 .cure = "leave --draws out"};
  if (flags.draws == 0 && flags.draws_from)
    return Error{.what = "--draws-from says what --draws draws, and that is not there", .cure = "add --draws N"};
  return Ok();
}

Result<int> RunExport(const ExportFlags& flags) {
  GS_ASSIGN(const nlohmann::ordered_json json, ReadJson(flags.source.path));
  GS_ASSIGN(const ResultModel loaded, LoadWholeResult(json, flags.source));
  const Model& model = *loaded.model;
  const ExportTarget& target = TargetOf(flags.target);
  NativeFeatures features = target.has;
  features.time_step_s = flags.time_step_s;
  const MakeExport make = [&](std::span<const double> values) {
    if (target.make) return target.make(model, values);
    return target.plugins ? model.Export(values, nullptr, {}, flags.time_step_s)
                          : model.ExportNative(values, nullptr, features);
  };
  GS_RETURN_IF_ERROR(CheckDraws(flags, target));
  Uncertain uncertain;
  if (flags.draws > 0) {
    GS_ASSIGN(uncertain, UncertainOf(model, loaded.values, json, flags.source.path, flags.draws_from));
  }
  GS_ASSIGN(const ExportedModel exported, make(loaded.values));
  ExportRun run{.info = {.seed = flags.common.seed},
                .result = flags.source.path,
                .target = flags.target,
                .what = target.what,
                .time_step_s = exported.spec->option.timestep,
                .effects = exported.native,
                .delay_steps = exported.delay_steps,
                .sent = exported.sent,
                .left_out = exported.left_out,
                .logs = JudgedBy(json)};
  if (flags.draws > 0) {
    run.draws = static_cast<std::size_t>(flags.draws);
    run.draws_from = uncertain.parameters.from;
    run.fitted_alone = uncertain.logs;
    run.not_of_each = uncertain.not_of_each;
    run.alike = uncertain.alike;
    GS_ASSIGN(run.randomization,
              Randomize(model, uncertain.values, uncertain.parameters, make, run.draws, flags.common.seed));
  }
  const TargetInput input{.model = model,
                          .values = loaded.values,
                          .exported = exported,
                          .randomization = run.draws > 0 ? &run.randomization : nullptr,
                          .mjcf = "model.xml"};
  GS_RETURN_IF_ERROR(WriteFiles(flags, input, &run));
  ThreadPool pool(WorkersOf(flags.common));
  GS_RETURN_IF_ERROR(Measure(input, &run, pool));
  const std::string text = JsonText(ToJson(run));
  GS_RETURN_IF_ERROR(WriteFile(flags.Path("fidelity.json"), text));
  Print(stdout, "{}", flags.common.json ? text : ToTable(run));
  return kDone;
}

}  // namespace

Command ExportCommand() {
  auto flags = std::make_shared<ExportFlags>();
  const std::vector<Option> own = {
      {.flag = "result",
       .value = &flags->source.path,
       .required = true,
       .help = "Folder that diagnose, tune or replay wrote with --out, or its result.json"},
      {.flag = "--to", .value = TargetChoice(&flags->target), .help = "The engine that is to run it"},
      {.flag = "--out",
       .value = &flags->common.out,
       .required = true,
       .help = "Folder for model.xml, what the engine needs beside it, and fidelity.json"},
      {.flag = "--timestep",
       .value = &flags->time_step_s,
       .range = Above(0, 0),
       .unset = "the MJCF's",
       .help = "Time step of the written MJCF, s"},
      {.flag = "--draws",
       .value = &flags->draws,
       .range = Between(0, 100000),
       .unset = "none",
       .help = "Of a tune: also randomization.json, the 95 % range of each parameter in numbers of the MJCF, and "
               "randomization.npz, so many joint draws of all that vary",
       .more = "After --each-log of four logs or more they are of how the logs differ, else of what the fit leaves "
               "open"},
      {.flag = "--draws-from",
       .value = ChoiceOf(flags->draws_from),
       .unset = "logs where the result has them, else covariance",
       .help = "What the draws are of: one fit's covariance; its intervals, each parameter uniform; how logs differ; "
               "the fits to each log themselves",
       .more = "logs and fits need a tune with --each-log, of four and of two logs or more. Parameters that go "
               "together are drawn together in all four"},
      WhileOption(flags->source.while_column),
      {.flag = "--experiment",
       .value = &flags->source.experiment,
       .unset = "the one that the result names",
       .help = "Experiment file whose MJCF it is"}};
  return {.name = "export",
          .what = "Write a result as an MJCF for another engine, and measure what that loses",
          .options = Join({own, CommonOptions(flags->common)}),
          .example = "gapscope export out/demo --to mjx --out out/mjx",
          .run = [flags] { return RunExport(*flags); }};
}

}  // namespace gapscope::cli

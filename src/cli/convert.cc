#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/joint_states.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/log/foreign.h"
#include "src/log/log.h"
#include "src/log/npz_writer.h"
#include "src/report/json.h"

namespace gapscope::cli {
namespace {

enum class TableForm { kNpz, kMcap };

}  // namespace
}  // namespace gapscope::cli

namespace gapscope {

template <>
std::span<const EnumName<cli::TableForm>> EnumNames<cli::TableForm>() {
  static constexpr EnumName<cli::TableForm> kNames[] = {{cli::TableForm::kNpz, "npz"}, {cli::TableForm::kMcap, "mcap"}};
  return kNames;
}

}  // namespace gapscope

namespace gapscope::cli {
namespace {

struct ConvertFlags {
  CommonFlags common;
  std::vector<std::string> files;
  std::string source;
  TableForm form = TableForm::kNpz;
};

std::string PathOf(const ConvertFlags& flags, const std::string& name) {
  return (std::filesystem::path(flags.common.out) / (name + "." + NameOf(flags.form))).string();
}

// "runs/a.mcap" becomes OUT/a.npz, "dataset#3" OUT/dataset_3.npz.
std::string TableOf(const ConvertFlags& flags, const std::string& file) {
  std::filesystem::path place(file);
  if (!place.has_filename()) place = place.parent_path();
  std::string name = place.has_extension() ? place.stem().string() : place.filename().string();
  for (char& c : name) c = c == '#' || c == ':' ? '_' : c;
  return PathOf(flags, name);
}

// Of what each target is made: `taken` of those before.
Status Claim(const std::string& target, const std::string& file, std::map<std::string, std::string>* taken) {
  const auto [other, fresh] = taken->emplace(target, file);
  if (fresh) return Ok();
  return Error{.what = "two logs of one name",
               .where = target,
               .actual = other->second + ", " + file,
               .cure = "convert them into folders of their own"};
}

using ConvertedJson = nlohmann::ordered_json;

// What stands at `target` now, for people and for --json.
void TellWritten(const ConvertFlags& flags, const std::string& target, const Log& log, ConvertedJson* json) {
  json->at("logs").push_back(
      {{"log", log.path}, {"table", target}, {"rows", log.rows()}, {"columns", log.ColumnNames()}});
  if (!flags.common.json) Print(stdout, "{}: {} rows of {} columns\n", target, log.rows(), log.columns.size());
  if (flags.common.quiet) return;
  for (const Finding& finding : log.findings) Print(stderr, "{}: {}\n", log.path, finding.text);
}

Status WriteTables(const ConvertFlags& flags, ConvertedJson* json) {
  std::map<std::string, std::string> targets;
  for (const std::string& file : flags.files) GS_RETURN_IF_ERROR(Claim(TableOf(flags, file), file, &targets));
  for (const auto& [target, file] : targets) {
    GS_ASSIGN(Log log, ReadLog(file, {.source = flags.source}));
    GS_RETURN_IF_ERROR(WriteNpz(target, log));
    log.path = file;  // with its episode
    TellWritten(flags, target, log, json);
  }
  return Ok();
}

// All results are read before any file is written.
Status WriteViews(const ConvertFlags& flags, ConvertedJson* json) {
  if (!flags.source.empty())
    return Error{.what = "a result has no parts to take", .where = "--source --to mcap", .cure = "leave --source out"};
  ThreadPool pool(WorkersOf(flags.common));
  std::vector<Log> views;
  std::map<std::string, std::string> targets;
  for (const std::string& result : flags.files) {
    GS_ASSIGN(std::vector<Log> of_result, JointStatesOf(result, pool));
    for (Log& view : of_result) {
      GS_RETURN_IF_ERROR(Claim(PathOf(flags, view.path), result, &targets));
      views.push_back(std::move(view));
    }
  }
  for (const Log& view : views) {
    const std::string target = PathOf(flags, view.path);
    GS_RETURN_IF_ERROR(WriteMcap(target, view));
    TellWritten(flags, target, view, json);
  }
  return Ok();
}

Result<int> RunConvert(const ConvertFlags& flags) {
  if (flags.common.out.empty()) return Error{.what = "no folder", .where = "--out", .cure = "--out FOLDER"};
  ConvertedJson json = {{"schema", "gapscope.convert/1"}, {"logs", ConvertedJson::array()}};
  GS_RETURN_IF_ERROR(flags.form == TableForm::kMcap ? WriteViews(flags, &json) : WriteTables(flags, &json));
  if (flags.common.json) Print(stdout, "{}", JsonText(json));
  return kDone;
}

}  // namespace

Command ConvertCommand() {
  auto flags = std::make_shared<ConvertFlags>();
  Option folder = FolderOption(flags->common, "the tables, NAME.npz, or the views, NAME.mcap");
  folder.required = true;
  return {
      .name = "convert",
      .what = "Logs of any format as NPZ tables, which every command reads to the last bit; results for viewers",
      .options = Join({{{.flag = "files",
                         .value = &flags->files,
                         .stands_for = LogsNamed,
                         .required = true,
                         .help = "Logs; of a LeRobot dataset all episodes, or dataset#3. For mcap results of replay, "
                                 "tune or diagnose",
                         .more = "docs/reference/formats.md tells the formats"},
                        folder,
                        {.flag = "--to",
                         .value = ChoiceOf(flags->form),
                         .help = "npz: each log as a table; mcap: each log of a result, measured beside predicted, "
                                 "for PlotJuggler, Foxglove and Rerun",
                         .more = "The joints' states are on /real/joint_states and /sim/joint_states; it needs the "
                                 "Python package"},
                        {.flag = "--source",
                         .value = &flags->source,
                         .unset = "all of it",
                         .help = "What to take of a file, as JSON: {\"topics\": [\"/joint_states\"]}",
                         .more = "The keys that an experiment has under 'log: source'; docs/reference/formats.md"}},
                       PrintOptions(flags->common)}),
      .example = "gapscope convert run.mcap --out tables",
      .run = [flags] { return RunConvert(*flags); }};
}

}  // namespace gapscope::cli

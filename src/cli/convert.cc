#include <fmt/core.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/session.h"
#include "src/log/log.h"
#include "src/log/npz_writer.h"

namespace gapscope::cli {
namespace {

struct ConvertFlags {
  CommonFlags common;
  std::vector<std::string> files;
  std::string source;
};

// "runs/a.mcap" becomes OUT/a.npz, "dataset#3" OUT/dataset_3.npz.
Result<std::map<std::string, std::string>> TargetsOf(const ConvertFlags& flags) {
  std::map<std::string, std::string> taken;  // the file of each target
  for (const std::string& file : flags.files) {
    std::filesystem::path place(file);
    if (!place.has_filename()) place = place.parent_path();
    std::string name = place.has_extension() ? place.stem().string() : place.filename().string();
    for (char& c : name) c = c == '#' || c == ':' ? '_' : c;
    const std::string target = (std::filesystem::path(flags.common.out) / (name + ".npz")).string();
    if (const auto [other, fresh] = taken.emplace(target, file); !fresh)
      return Error{.what = "two logs of one name",
                   .where = target,
                   .actual = other->second + ", " + file,
                   .cure = "convert them into folders of their own"};
  }
  return taken;
}

Result<int> RunConvert(const ConvertFlags& flags) {
  if (flags.common.out.empty()) return Error{.what = "no folder", .where = "--out", .cure = "--out FOLDER"};
  GS_ASSIGN(const auto targets, TargetsOf(flags));
  nlohmann::ordered_json json = {{"schema", "gapscope.convert/1"}, {"logs", nlohmann::ordered_json::array()}};
  for (const auto& [target, file] : targets) {
    GS_ASSIGN(const Log log, ReadLog(file, {.source = flags.source}));
    GS_RETURN_IF_ERROR(WriteNpz(target, log));
    json["logs"].push_back({{"log", file}, {"table", target}, {"rows", log.rows()}, {"columns", log.ColumnNames()}});
    if (!flags.common.json) fmt::print("{}: {} rows of {} columns\n", target, log.rows(), log.columns.size());
    if (flags.common.quiet) continue;
    for (const Finding& finding : log.findings) fmt::print(stderr, "{}: {}\n", file, finding.text);
  }
  if (flags.common.json) fmt::print("{}\n", json.dump(2));
  return kDone;
}

}  // namespace

Command ConvertCommand() {
  auto flags = std::make_shared<ConvertFlags>();
  Option folder = FolderOption(flags->common, "the tables, NAME.npz");
  folder.required = true;
  return {.name = "convert",
          .what = "Logs of any format as NPZ tables, which every command reads to the last bit",
          .options = Join({{{.flag = "files",
                             .value = &flags->files,
                             .required = true,
                             .help = "Logs; of a LeRobot dataset an episode, dataset#3",
                             .more = "docs/formats.md tells the formats"},
                            folder,
                            {.flag = "--source",
                             .value = &flags->source,
                             .unset = "all of it",
                             .help = "What to take of a file, as JSON: {\"topics\": [\"/joint_states\"]}",
                             .more = "The keys that an experiment has under 'log: source'; docs/formats.md"}},
                           PrintOptions(flags->common)}),
          .example = "gapscope convert run.mcap --out tables",
          .run = [flags] { return RunConvert(*flags); }};
}

}  // namespace gapscope::cli

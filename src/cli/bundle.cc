#include "src/cli/bundle.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "src/cli/html.h"
#include "src/core/digest.h"
#include "src/core/file.h"
#include "src/log/log_files.h"
#include "src/log/text.h"
#include "src/log/zip_writer.h"
#include "src/model/mjcf_files.h"
#include "src/report/json.h"
#include "src/report/version.h"

namespace gapscope::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

constexpr const char* kScript = R"sh(#!/bin/sh
# Runs the diagnosis of this folder again and compares: exit status 0, the same digits; 1, others; 2, it did not run.
# GAPSCOPE names the program; words behind `sh run.sh` are further options (--json, --out FOLDER).
set -eu
here=$(CDPATH= cd "$(dirname "$0")" && pwd)
cd "$here"
sha256sum --quiet --check SHA256SUMS >&2 || {
  echo "gapscope bundle: a file is missing or not the one that was diagnosed; bundle.json lists them all" >&2
  exit 2
}
mkdir -p {FROM} && cd {FROM}
exec "${GAPSCOPE:-gapscope}" {COMMAND} --expect "$here/result.json" "$@"
)sh";

constexpr const char* kReadMe = R"(A diagnosis by gapscope, to be run again: sh run.sh

run.sh       checks the files against SHA256SUMS, runs the command and compares with result.json
bundle.json  the command as it was given, versions, and every file with its digest
result.json  what the diagnosis said
files/       experiment file, MJCF and what it includes, logs; logs whose digests alone were taken belong here too

The same version of gapscope and of MuJoCo gives the same digits (docs/how-to/bundle.md).
)";

// Lexically, so that a file beside a symbolic link stays beside it, where that names the same file.
fs::path PlaceOf(const std::string& path) {
  std::error_code failed;
  const fs::path normal = fs::absolute(path, failed).lexically_normal();
  return fs::equivalent(normal, path, failed) ? normal : fs::weakly_canonical(path, failed);
}

// The deepest folder above both.
fs::path FolderAbove(const fs::path& a, const fs::path& b) {
  fs::path common;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end() && *i == *j; ++i, ++j) common /= *i;
  return common;
}

// Where a text says an absolute path, and how: `model: /...` of an experiment, file="/..." or meshdir="/..." of an
// MJCF; empty: nowhere. Not a regular expression: the library's recurse, a long line would end the program.
std::string AbsolutePathIn(const std::string& text) {
  constexpr std::string_view kBlank = " \t\r\n\f\v", kQuotes = "\"'";
  const auto after_blanks = [&](std::size_t at) { return std::min(text.find_first_not_of(kBlank, at), text.size()); };
  const auto is = [&](std::size_t at, std::string_view one_of) {
    return at < text.size() && one_of.find(text[at]) != std::string_view::npos;
  };
  for (const std::string key : {"model", "file", "dir"}) {
    const bool yaml = key == "model";
    for (std::size_t at = text.find(key); at != std::string::npos; at = text.find(key, at + 1)) {
      const std::size_t before = at == 0 ? std::string::npos : text.find_last_not_of(" \t\r", at - 1);
      if (yaml && before != std::string::npos && text[before] != '\n') continue;
      std::size_t value = after_blanks(at + key.size());
      if (!is(value, yaml ? ":" : "=")) continue;
      value = after_blanks(value + 1);
      const bool quoted = is(value, kQuotes);
      if ((quoted || yaml) && is(value + quoted, "/"))
        return text.substr(at, text.find_first_of(yaml ? "\n" : kQuotes, value + 1) - at);
    }
  }
  return "";
}

// On another machine it would name another file, or none.
Status CheckRelative(const std::string& path) {
  if (!path.ends_with(".xml") && !path.ends_with(".yaml") && !path.ends_with(".yml")) return Ok();
  GS_ASSIGN(const std::string text, ReadFile(path));
  const std::string said = AbsolutePathIn(text);
  if (said.empty()) return Ok();
  return Error{.what = "a path that holds on this machine alone",
               .where = path,
               .actual = Quoted(said, 120),
               .allowed = "paths relative to the file, in what --bundle packs",
               .cure = "write it relative, or leave --bundle out"};
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
  return text;
}

// Every text of it with `from` replaced.
void ReplaceTexts(ordered_json& json, const std::string& from, const std::string& to) {
  if (json.is_string()) json = Replaced(json.get<std::string>(), from, to);
  if (!json.is_structured()) return;
  for (auto& item : json) ReplaceTexts(item, from, to);
}

}  // namespace

Status Bundle::Add(const std::string& path, bool packed) {
  File file{.place = PlaceOf(path), .inside = "", .sha256 = "", .packed = packed};
  const auto same = [&](const File& other) { return other.place == file.place; };
  if (std::any_of(files_.begin(), files_.end(), same)) return Ok();
  GS_ASSIGN(file.sha256, Sha256OfFile(path));
  files_.push_back(std::move(file));
  return Ok();
}

Result<Bundle> Bundle::Of(const Experiment& experiment, const BundleInputs& inputs) {
  Bundle bundle;
  GS_RETURN_IF_ERROR(CheckRelative(experiment.path));
  GS_RETURN_IF_ERROR(bundle.Add(experiment.path, true));
  GS_ASSIGN(const std::vector<std::string> model_files, FilesOfMjcf(experiment.model_path));
  for (const std::string& file : model_files) {
    GS_RETURN_IF_ERROR(CheckRelative(file));
    GS_RETURN_IF_ERROR(bundle.Add(file, true));
  }
  for (const std::string& other : inputs.others) GS_RETURN_IF_ERROR(bundle.Add(other, true));
  for (const std::string& log : inputs.logs) {
    GS_ASSIGN(const auto files, FilesOfLog(log, experiment.read));
    for (const std::string& file : files) GS_RETURN_IF_ERROR(bundle.Add(file, !inputs.digests_only));
  }
  bundle.given_ = inputs.logs;
  bundle.given_.insert(bundle.given_.end(), inputs.others.begin(), inputs.others.end());
  bundle.given_.push_back(experiment.path);
  std::error_code failed;
  const fs::path here = fs::current_path(failed);
  const auto relative = [](const std::string& path) { return fs::path(path).is_relative(); };
  bundle.root_ = bundle.files_.front().place.parent_path();
  for (const File& file : bundle.files_) bundle.root_ = FolderAbove(bundle.root_, file.place.parent_path());
  // Relative paths keep their words where the command runs at the same place to the files.
  const bool some_relative = std::any_of(bundle.given_.begin(), bundle.given_.end(), relative);
  if (some_relative) bundle.root_ = FolderAbove(bundle.root_, here);
  bundle.from_ = some_relative ? here : bundle.root_;
  for (File& file : bundle.files_)
    file.inside = (fs::path("files") / file.place.lexically_relative(bundle.root_)).lexically_normal().string();
  return bundle;
}

std::string Bundle::Moved(const std::string& path) const {
  if (fs::path(path).is_relative()) return path;
  return PlaceOf(path).lexically_relative(from_).string();
}

ordered_json Bundle::Facts(const std::string& command) const {
  ordered_json files = ordered_json::array();
  for (const File& file : files_)
    files.push_back({{"path", file.inside}, {"sha256", file.sha256}, {"packed", file.packed}});
  return {{"schema", "gapscope.bundle/1"},
          {"command", CommandLine()},
          {"replay", command},
          {"files", files},
          {"versions", {{"gapscope", GapscopeVersion()}, {"mujoco", MujocoVersion()}, {"compiler", __VERSION__}}}};
}

Status Bundle::Write(const std::string& zip, const std::vector<std::string>& words, ordered_json result) const {
  if (files_.size() + 8 > ZipWriter::kMostMembers)
    return Error{.what = "a bundle of too many files",
                 .where = "--bundle",
                 .actual = std::to_string(files_.size()),
                 .allowed = "below 65535",
                 .cure = "--bundle-digests, or convert the logs first (gapscope convert)"};
  ZipWriter archive;
  std::string sums;
  for (const File& file : files_) {
    sums += file.sha256 + "  " + file.inside + "\n";
    GS_ASSIGN(const std::string bytes, ReadFile(file.place.string()));
    if (Sha256(bytes) != file.sha256)
      return Error{.what = "a file that has changed while it was diagnosed",
                   .where = file.place.string(),
                   .cure = "run it again when nothing writes to it"};
    if (!file.packed) continue;
    if (archive.size() + bytes.size() > ZipWriter::kMost - (std::size_t{1} << 28))
      return Error{.what = "a bundle above 4 GB", .where = file.place.string(), .cure = "--bundle-digests"};
    archive.Add(file.inside, bytes, ZipWriter::Packing::kDeflated);
  }
  std::string command;
  for (const std::string& word : words) command += (command.empty() ? "" : " ") + ShellQuoted(word);
  // The result names the paths of the bundle, as its replay will.
  std::vector<std::string> given = given_;
  std::sort(given.begin(), given.end(), [](const auto& a, const auto& b) { return a.size() > b.size(); });
  for (const std::string& path : given) {
    if (Moved(path) != path) ReplaceTexts(result, path, Moved(path));
  }
  const std::string from = (fs::path("files") / from_.lexically_relative(root_)).lexically_normal().string();
  const auto add = [&](const char* name, const std::string& text) {
    archive.Add(name, text, ZipWriter::Packing::kDeflated);
  };
  add("run.sh", Replaced(Replaced(kScript, "{FROM}", ShellQuoted(from)), "{COMMAND}", command));
  add("README.txt", kReadMe);
  add("SHA256SUMS", sums);
  add("bundle.json", JsonText(Facts(command)));
  add("result.json", JsonText(result));
  return WriteFile(zip, archive.Finish());
}

std::string Differences(const ordered_json& expected, const ordered_json& got) {
  constexpr std::size_t kMostLines = 5;
  // Read from text both: a whole number is no other number than its double.
  auto before = nlohmann::json::parse(expected.dump()), after = nlohmann::json::parse(got.dump());
  for (auto* json : {&before, &after}) {
    if (json->is_object()) json->erase("wall_s"), json->erase("versions");
  }
  const nlohmann::json changes = nlohmann::json::diff(before, after);
  std::string text;
  for (std::size_t i = 0; i < std::min(changes.size(), kMostLines); ++i) {
    const std::string place = changes[i]["path"];
    const nlohmann::json::json_pointer at(place);
    const auto value = [&](const nlohmann::json& json) {
      return json.contains(at) ? json[at].dump(-1, ' ', false, nlohmann::json::error_handler_t::replace).substr(0, 60)
                               : std::string("nothing");
    };
    text += fmt::format("{}: {}, expected {}\n", place, value(after), value(before));
  }
  if (changes.size() > kMostLines) text += fmt::format("and {} more\n", changes.size() - kMostLines);
  return text;
}

}  // namespace gapscope::cli

#include <fmt/core.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/report/html_report.h"
#include "src/report/render_report.h"
#include "src/video/video.h"

namespace gapscope::cli {
namespace {

struct RenderFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> compare;
  std::string log, out, view = "fixed", layout = "overlay", gl = "auto", size = "1280x720", mode;
  double speed = 1, from_s = 0, to_s = -1, at_s = -1, frames_per_s = 30, window_s = 0;
};

const std::vector<std::string> kViews = {"fixed", "tracking", "top"}, kLayouts = {"overlay", "side"},
                               kGl = {"auto", "osmesa", "egl"};
template <class Enum>
Enum ValueOf(const std::vector<std::string>& names, const std::string& name) {
  return static_cast<Enum>(std::find(names.begin(), names.end(), name) - names.begin());
}

std::atomic<bool> interrupted = false;
void Interrupt(int) { interrupted = true; }

Status ReadSize(const std::string& text, int& width, int& height) {
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, width);
  const auto second = first.ptr < end && *first.ptr == 'x'
                          ? std::from_chars(first.ptr + 1, end, height)
                          : std::from_chars_result{first.ptr, std::errc::invalid_argument};
  const bool good = first.ec == std::errc() && second.ec == std::errc() && second.ptr == end;
  if (good && width >= 320 && height >= 240 && width <= 7680 && height <= 4320 && width % 2 == 0 && height % 2 == 0)
    return Ok();
  return Error{.what = "not a size of a picture",
               .where = "--size",
               .actual = "'" + text + "'",
               .allowed = "WIDTHxHEIGHT, both even, 320x240 .. 7680x4320"};
}

// "tuned=out/t" is labelled "tuned"; a path alone by its folder's name.
std::pair<std::string, std::string> LabelAndPath(const std::string& text) {
  const std::size_t equal = text.find('=');
  if (equal != std::string::npos && equal > 0 && text.find('/') > equal)
    return {text.substr(0, equal), text.substr(equal + 1)};
  std::filesystem::path path = std::filesystem::path(text).lexically_normal();
  if (path.filename().empty()) path = path.parent_path();
  if (path.filename() == "result.json" && path.has_parent_path()) path = path.parent_path();
  return {path.filename().string(), text};
}

Result<std::vector<VideoModel>> ModelsOf(const RenderFlags& flags, const Session& session) {
  std::vector<VideoModel> models;
  for (const auto& text : flags.compare) {
    if (text == "nominal") {
      GS_ASSIGN(const auto nominal, Model::Build(session.model->rig()));
      models.push_back({"nominal", nominal, nominal->Nominal()});
      continue;
    }
    const auto [label, path] = LabelAndPath(text);
    const ScaleTable scales = EstimateScales(*session.model, session.recordings);
    GS_ASSIGN(ResultModel result, LoadResultModel(session.model->rig(), path, scales));
    models.push_back({label, std::move(result.model), std::move(result.values)});
  }
  const bool changed = !flags.model.with.empty() || !flags.model.set.empty() || !flags.model.params.empty();
  if (changed || models.empty()) {
    std::string label = changed ? "" : "nominal";
    for (const auto& use : session.model->effects()) label += (label.empty() ? "" : ", ") + use.effect;
    models.push_back({label.empty() ? "changed" : label, session.model, session.values});
  }
  if (models.size() > 4)
    return Error{.what = "too many models for one picture",
                 .where = "--compare",
                 .actual = std::to_string(models.size()),
                 .allowed = "four at most"};
  return models;
}

RenderRun RunOf(const RenderFlags& flags, const std::vector<VideoModel>& models, const VideoOptions& options,
                const VideoSummary& summary) {
  RenderRun run{.info = {.seed = flags.common.seed},
                .out = flags.out,
                .log = flags.log,
                .frames = summary.frames,
                .width = options.width,
                .height = options.height,
                .frames_per_s = options.frames_per_s,
                .first_s = summary.first_s,
                .last_s = summary.last_s,
                .video_s = summary.length_s,
                .gl = GlBackendName(summary.gl),
                .wall_s = summary.wall_s};
  for (std::size_t m = 0; m < models.size(); ++m) run.models.push_back({models[m].label, summary.errors[m]});
  return run;
}

Result<int> RunRender(RenderFlags flags) {
  VideoOptions options{.out = flags.out,
                       .view = ValueOf<View>(kViews, flags.view),
                       .layout = ValueOf<Layout>(kLayouts, flags.layout),
                       .gl = ValueOf<GlBackend>(kGl, flags.gl),
                       .speed = flags.speed,
                       .from_s = flags.from_s,
                       .to_s = flags.to_s,
                       .at_s = flags.at_s,
                       .frames_per_s = flags.frames_per_s};
  GS_RETURN_IF_ERROR(ReadSize(flags.size, options.width, options.height));
  flags.model.logs = {flags.log};
  GS_ASSIGN(const Session session, LoadSession(flags.model, flags.common));
  PrintFindings(session.recordings, flags.common.quiet);
  options.mode = flags.mode.empty()        ? session.experiment.replay.mode
                 : flags.mode == "windows" ? ReplayMode::kWindows
                                           : ReplayMode::kFreeRun;
  options.window_s = flags.window_s > 0 ? flags.window_s : session.experiment.replay.window_s;
  GS_ASSIGN(const auto models, ModelsOf(flags, session));

  struct sigaction action{};
  action.sa_handler = Interrupt;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &action, nullptr);
  options.stop = &interrupted;
  const bool live = !flags.common.quiet && isatty(2);
  if (live)
    options.progress = [](std::size_t done, std::size_t all) {
      fmt::print(stderr, "\r\033[Kframe {} of {}", done, all);
    };
  auto rendered = RenderVideo(session.recordings.front(), models, options, *session.pool);
  if (live) fmt::print(stderr, "\r\033[K");
  if (!rendered.ok()) return rendered.error();
  const VideoSummary& summary = rendered.value();
  RenderRun run = RunOf(flags, models, options, summary);
  const std::filesystem::path out = flags.out;
  if (out.extension() == ".mp4") {
    const std::string report = (out.parent_path() / "report.html").string();
    GS_ASSIGN(const bool shown, AttachVideo(report, out.filename().string()));
    if (shown) run.shown_in = report;
  }
  if (!flags.common.quiet && !summary.note.empty()) fmt::print(stderr, "gapscope: {}\n", summary.note);
  fmt::print("{}", flags.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

void AddRender(CLI::App& program, Run& run) {
  auto flags = std::make_shared<RenderFlags>();
  CLI::App* command = program.add_subcommand(
      "render", "Draw the measured mechanism against the simulated one: a video, a GIF or a still");
  command->add_option("experiment", flags->model.experiment, "Experiment file (YAML)")->required();
  command->add_option("log", flags->log, "Hardware log")->required();
  command->add_option("--out", flags->out, "VIDEO.mp4, MOVING.gif or STILL.png")->required();
  command
      ->add_option("--compare", flags->compare,
                   "A model to show, more than once: nominal, or the folder (or LABEL=FOLDER) that replay, tune or "
                   "diagnose wrote")
      ->allow_extra_args(false);
  AddEffectFlags(*command, flags->model);
  command
      ->add_option("--layout", flags->layout,
                   "overlay: the measured mechanism translucent over the simulated one; side: beside it")
      ->check(CLI::IsMember(kLayouts))
      ->capture_default_str();
  command->add_option("--view", flags->view, "fixed, tracking or top")
      ->check(CLI::IsMember(kViews))
      ->capture_default_str();
  command->add_option("--speed", flags->speed, "Seconds of the log per second of video: 0.25 is slow motion")
      ->check(FinitePositive())
      ->capture_default_str();
  command->add_option("--from", flags->from_s, "Where to begin, s of the log")->check(FiniteNonNegative());
  command->add_option("--to", flags->to_s, "Where to end, s of the log (default: its end)")->check(FinitePositive());
  command->add_option("--at", flags->at_s, "Time of a still, s of the log (default: of the greatest error)")
      ->check(FiniteNonNegative());
  command->add_option("--size", flags->size, "WIDTHxHEIGHT in pixels, even")->capture_default_str();
  command->add_option("--fps", flags->frames_per_s, "Frames per second")
      ->check(FiniteIn(1, 240))
      ->capture_default_str();
  command->add_option("--mode", flags->mode, "free_run or windows (default: the experiment's)")
      ->check(CLI::IsMember({"free_run", "windows"}));
  command->add_option("--window", flags->window_s, "Length of a window, s")->check(FinitePositive());
  command->add_option("--gl", flags->gl, "OpenGL: osmesa (in memory), egl (without a surface), auto (OSMesa, else EGL)")
      ->check(CLI::IsMember(kGl))
      ->capture_default_str();
  AddCommonFlags(*command, flags->common, false);
  command->footer(
      "Example: gapscope render models/qube/experiment.yaml log.csv --compare nominal --compare out/tuned --speed 0.5 "
      "--out video.mp4");
  command->callback([flags, &run] { run = [flags] { return RunRender(*flags); }; });
}

}  // namespace gapscope::cli

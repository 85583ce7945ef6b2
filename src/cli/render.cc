#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/result_model.h"
#include "src/cli/session.h"
#include "src/report/html_report.h"
#include "src/report/json.h"
#include "src/report/render_report.h"
#include "src/video/video.h"

namespace gapscope::cli {
namespace {

struct RenderFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> compare;
  std::string log, out, size = "1280x720";
  View view = View::kFixed;
  Layout layout = Layout::kOverlay;
  GlBackend gl = GlBackend::kAuto;
  std::optional<ReplayMode> mode;
  double speed = 1, from_s = 0, to_s = -1, at_s = -1, frames_per_s = 30, window_s = 0;
};

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
                .gl = NameOf(summary.gl),
                .wall_s = summary.wall_s};
  for (std::size_t m = 0; m < models.size(); ++m) run.models.push_back({models[m].label, summary.errors[m]});
  return run;
}

Result<int> RunRender(RenderFlags flags) {
  StageClock clock(flags.common);
  VideoOptions options{.out = flags.out,
                       .view = flags.view,
                       .layout = flags.layout,
                       .gl = flags.gl,
                       .speed = flags.speed,
                       .from_s = flags.from_s,
                       .to_s = flags.to_s,
                       .at_s = flags.at_s,
                       .frames_per_s = flags.frames_per_s};
  GS_RETURN_IF_ERROR(ReadSize(flags.size, options.width, options.height));
  flags.model.logs = {flags.log};
  GS_ASSIGN(const Session session, LoadSession(flags.model, flags.common));
  PrintFindings(session.recordings, flags.common.quiet);
  options.mode = flags.mode.value_or(session.experiment.replay.mode);
  options.window_s = flags.window_s > 0 ? flags.window_s : session.experiment.replay.window_s;
  GS_ASSIGN(const auto models, ModelsOf(flags, session));

  options.stop = CatchInterrupts();
  clock.Enter("render");
  auto rendered = [&] {
    ProgressLine line(flags.common, &clock);
    if (line.live())
      options.progress = [&line](std::size_t done, std::size_t all) {
        line.Show({"frames", static_cast<double>(done), static_cast<double>(all)},
                  fmt::format("frame {} of {}", done, all));
      };
    return RenderVideo(session.recordings.front(), models, options, *session.pool);
  }();
  if (!rendered.ok()) return rendered.error();
  clock.Enter("write");
  const VideoSummary& summary = rendered.value();
  RenderRun run = RunOf(flags, models, options, summary);
  const std::filesystem::path out = flags.out;
  if (out.extension() == ".mp4") {
    const std::string report = (out.parent_path() / "report.html").string();
    GS_ASSIGN(const bool shown, AttachVideo(report, out.filename().string()));
    if (shown) run.shown_in = report;
  }
  if (!flags.common.quiet && !summary.note.empty()) Print(stderr, "gapscope: {}\n", summary.note);
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

}  // namespace

namespace {

// Which part of the log, and how it is drawn.
std::vector<Option> PictureOptions(RenderFlags& flags) {
  return {{.flag = "--layout",
           .value = ChoiceOf(flags.layout),
           .help = "overlay: the measured mechanism translucent over the simulated one; side: beside it"},
          {.flag = "--view",
           .value = ChoiceOf(flags.view),
           .help = "The camera",
           .more = "fixed: all of the motion in view; tracking: it follows the mechanism; top: from above"},
          {.flag = "--speed",
           .value = &flags.speed,
           .range = Above(0),
           .help = "Seconds of the log per second of video: 0.25 is slow motion"},
          {.flag = "--from",
           .value = &flags.from_s,
           .unit = "s",
           .range = AtLeast(0),
           .help = "Where to begin, on the log's clock"},
          {.flag = "--to",
           .value = &flags.to_s,
           .unit = "s",
           .range = Above(0, -1),
           .unset = "the log's end",
           .help = "Where to end, on the log's clock"},
          {.flag = "--at",
           .value = &flags.at_s,
           .unit = "s",
           .range = AtLeast(0, -1),
           .unset = "where the first model's error is greatest",
           .help = "Time of a still, on the log's clock"},
          {.flag = "--size",
           .value = &flags.size,
           .unit = "pixels",
           .help = "WIDTHxHEIGHT, both even, 320x240 .. 7680x4320"},
          {.flag = "--fps", .value = &flags.frames_per_s, .range = Between(1, 240), .help = "Frames per second"},
          {.flag = "--mode",
           .value = ChoiceAmong(flags.mode, std::vector{ReplayMode::kFreeRun, ReplayMode::kWindows}),
           .unset = "the experiment's",
           .help = "How the log is simulated",
           .more = "As of replay"},
          WindowOption(flags.window_s),
          {.flag = "--gl",
           .value = ChoiceOf(flags.gl),
           .help = "OpenGL: osmesa (in memory), egl (without a surface), auto (OSMesa, else EGL)"}};
}

}  // namespace

Command RenderCommand() {
  auto flags = std::make_shared<RenderFlags>();
  const std::vector<Option> own = {
      ExperimentOption(flags->model.experiment),
      {.flag = "log", .value = &flags->log, .required = true, .help = "Hardware log"},
      {.flag = "--out",
       .value = &flags->out,
       .required = true,
       .help = "VIDEO.mp4, MOVING.gif or STILL.png",
       .more = "A video beside a report.html is shown in it"},
      {.flag = "--compare",
       .value = &flags->compare,
       .help = "A model to show: nominal, or a folder that replay, tune or diagnose wrote; more than once",
       .more = "LABEL=FOLDER gives it a label of its own. Four models at most"},
      WhileOption(flags->model.while_column)};
  return {.name = "render",
          .what = "Draw the measured mechanism against the simulated one: a video, a GIF or a still",
          .options = Join({own, PictureOptions(*flags), EffectOptions(flags->model), ProfileOptions(flags->common),
                           CommonOptions(flags->common)}),
          .example =
              "gapscope render models/qube/experiment.yaml log.csv --compare nominal --compare out/tuned --speed 0.5 "
              "--out video.mp4",
          .run = [flags] { return RunRender(*flags); }};
}

}  // namespace gapscope::cli

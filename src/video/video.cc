#include "src/video/video.h"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <numeric>
#include <optional>
#include <tuple>

#include "replay/initial_state.h"
#include "src/compare/score.h"
#include "src/core/statistics.h"
#include "src/video/cairo_library.h"
#include "src/video/canvas.h"
#include "src/video/encoder.h"

namespace gapscope {
namespace {

constexpr double kMaxFrames = 1e6;

// What is drawn of one model.
struct Actor {
  ModelPtr drawn;
  PoseTrack predicted, measured;
  LogReplay replay;
  double error = 0;
  std::vector<double> errors;  // by signal
};

Result<Actor> Rehearse(const Recording& recording, const VideoModel& model, const VideoOptions& options,
                       ThreadPool& pool) {
  ReplayOptions replay{.mode = options.mode, .window_s = options.window_s, .values = model.values, .keep_poses = true};
  ReplayResult result = Replay(*model.model, {recording}, replay, pool);
  Actor actor{.drawn = nullptr,
              .predicted = {},
              .measured = {},
              .replay = std::move(result.logs.front()),
              .error = 0,
              .errors = {}};
  GS_ASSIGN(actor.drawn, model.model->CompileForDrawing(model.values, recording.values));
  StandHeldBodies(*model.model, recording, model.values, actor.drawn.get());
  actor.predicted = PredictedPoses(*model.model, model.values, recording, actor.replay);
  actor.measured = MeasuredPoses(*model.model, model.values, recording, actor.predicted);
  std::vector<SignalScore> scores;
  for (const auto& signal : actor.replay.signals) {
    const SignalScore score =
        ScoreSignal(signal.signal, actor.replay.time_s, signal.measured, signal.predicted, signal.resolution);
    if (signal.scored) scores.push_back(score);
    actor.errors.push_back(std::isnan(score.nrmse) ? kInfinity : score.nrmse);
  }
  actor.error = actor.replay.outcome == Outcome::kDiverged ? INFINITY : CombinedError(scores);
  return actor;
}

// What is scored first, angles before the rest; where they are too many to show, the first model's worst first.
std::vector<std::size_t> OrderOf(const Recording& recording, const Actor& first) {
  std::vector<std::size_t> order(recording.measured.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto rank = [&](std::size_t s) {
    const MeasuredSpec& spec = recording.measured[s].spec;
    const double error = order.size() > kSignalsBelow ? first.errors[s] : 0;
    return std::tuple(!spec.scored, !TraitsOf(spec.kind).gives_angle, -error);
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
  return order;
}

PageTraces TracesOf(const Recording& recording, const Experiment& experiment, const std::vector<Actor>& actors) {
  PageTraces traces{.time_s = recording.time_s, .signals = {}, .commands = {}};
  for (const std::size_t s : OrderOf(recording, actors.front())) {
    const MeasuredSpec& spec = recording.measured[s].spec;
    traces.signals.push_back({.name = spec.signal,
                              .unit = spec.unit,
                              .moves = TraitsOf(spec.kind).gives_angle,
                              .measured = recording.measured[s].values,
                              .predicted = {}});
    for (const Actor& actor : actors) traces.signals.back().predicted.push_back(actor.replay.signals[s].predicted);
  }
  for (std::size_t c = 0; c < recording.commands.size(); ++c) {
    const auto& command = recording.commands[c];
    // An input that nothing was logged for says nothing.
    if (command.column)
      traces.commands.push_back(
          {.name = command.actuator, .unit = experiment.commands[c].unit, .values = command.values});
  }
  return traces;
}

// When the mechanisms stand furthest apart: the greatest error of a position, in units of its own spread.
double TimeOfGreatestError(const PageTraces& traces, double from, double to) {
  double greatest = -1, at = from;
  for (const auto& signal : traces.signals) {
    if (!signal.moves) continue;
    const double spread = std::max(MomentsOf(signal.measured).deviation, 1e-12);
    for (std::size_t r = 0; r < traces.time_s.size(); ++r) {
      const double t = traces.time_s[r], error = std::abs(signal.measured[r] - signal.predicted.front()[r]) / spread;
      if (t >= from && t <= to && error > greatest) greatest = error, at = t;
    }
  }
  return at;
}

// Frames arrive from workers in any order within a few, and leave in order.
class InOrder {
 public:
  // Waits until all frames before `index` are taken, then runs `take`; false: somebody failed.
  template <class Take>
  bool Pass(std::size_t index, const Take& take) {
    std::unique_lock lock(mutex_);
    turn_.wait(lock, [&] { return next_ == index || error_; });
    if (error_) return false;
    if (Status status = take(); !status.ok()) error_ = status.error();
    ++next_;
    turn_.notify_all();
    return !error_;
  }
  void Fail(Error error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
    turn_.notify_all();
  }
  const std::optional<Error>& error() const { return error_; }

 private:
  std::mutex mutex_;
  std::condition_variable turn_;
  std::size_t next_ = 0;
  std::optional<Error> error_;
};

struct Stage {
  const std::vector<Actor>& actors;
  const Page& page;
  const Framing& framing;
  Layout layout;
};

// One worker's means to draw frames. Members end in reverse order: scenes before the context they live in.
class Painter {
 public:
  static Result<std::unique_ptr<Painter>> Make(const Stage& stage) {
    std::unique_ptr<Painter> made(new Painter(stage));
    GS_ASSIGN(made->context_, GlContext::Make());
    GS_ASSIGN(made->scene_, Scene::Make(*stage.actors.front().drawn, stage.framing, stage.page.scene_width(),
                                        stage.page.scene_height()));
    return made;
  }

  Status Paint(double time_s, Picture& frame) {
    std::size_t panel = 0;
    pictures_.resize(stage_.page.panels());
    const auto draw = [&](std::span<const Mechanism> mechanisms) {
      return scene_->Draw(mechanisms, pictures_[panel++]);
    };
    const bool side = stage_.layout == Layout::kSide;
    for (std::size_t a = 0; a < stage_.actors.size(); ++a) {
      const Actor& actor = stage_.actors[a];
      const std::size_t nq = static_cast<std::size_t>(actor.drawn->nq);
      // Where a simulation ran away its last pose stays.
      poses_.resize(2 * stage_.actors.size());
      auto &predicted = poses_[2 * a], &measured = poses_[2 * a + 1];
      if (predicted.empty()) predicted.assign(actor.drawn->qpos0, actor.drawn->qpos0 + nq);
      measured.resize(nq);
      const double held = actor.replay.outcome == Outcome::kDiverged && time_s > actor.replay.diverged_at_s
                              ? actor.replay.diverged_at_s
                              : time_s;
      if (!PoseAt(*actor.drawn, actor.predicted, time_s, predicted))
        PoseAt(*actor.drawn, actor.predicted, held, predicted);
      if (!PoseAt(*actor.drawn, actor.measured, time_s, measured)) measured = predicted;
      const Mechanism simulated{.model = actor.drawn.get(), .qpos = predicted};
      const Mechanism real{.model = actor.drawn.get(),
                           .qpos = measured,
                           .look = side ? Look::kSolid : Look::kGhost,
                           .ghost_rgb = MeasuredColour()};
      const Mechanism both[] = {simulated, real};
      if (side && a == 0) GS_RETURN_IF_ERROR(draw(std::span(both + 1, 1)));
      GS_RETURN_IF_ERROR(draw(std::span(both, side ? 1 : 2)));
    }
    stage_.page.Compose(pictures_, time_s, frame);
    return Ok();
  }

 private:
  explicit Painter(const Stage& stage) : stage_(stage) {}
  Stage stage_;
  std::unique_ptr<GlContext> context_;
  std::unique_ptr<Scene> scene_;
  std::vector<Picture> pictures_;
  std::vector<std::vector<double>> poses_;
};

// Draws all frames with the pool's workers; `take` gets them in order.
Status PaintAll(const Stage& stage, const std::vector<double>& times, const VideoOptions& options, ThreadPool& pool,
                const std::function<Status(const Picture&)>& take) {
  InOrder order;
  std::atomic<std::size_t> next = 0;
  // Contexts take turns in Mesa's rasteriser, which has threads of its own: two painters keep it busy, more would wait.
  const std::size_t workers = std::min<std::size_t>({static_cast<std::size_t>(pool.workers()), times.size(), 2});
  // One task a worker, which makes its context and takes frames until none is left: a context belongs to its thread.
  pool.ForEach(workers, [&](std::size_t, int) {
    std::unique_ptr<Painter> painter;
    Picture frame;
    while (true) {
      const std::size_t index = next.fetch_add(1);
      if (index >= times.size()) return;
      if (!painter) {
        auto made = Painter::Make(stage);
        if (!made.ok()) return order.Fail(made.error());
        painter = std::move(made).value();
      }
      if (options.stop && options.stop->load())
        return order.Fail({.what = "interrupted: nothing was written", .where = options.out});
      if (Status painted = painter->Paint(times[index], frame); !painted.ok()) return order.Fail(painted.error());
      const bool go_on = order.Pass(index, [&]() -> Status {
        GS_RETURN_IF_ERROR(take(frame));
        if (options.progress) options.progress(index + 1, times.size());
        return Ok();
      });
      if (!go_on) return;
    }
  });
  if (const auto& error = order.error()) return *error;
  return Ok();
}

// What can be asked of a recording: `to_s` becomes its end where it is later, or not given.
Status Validate(const Recording& recording, const Model& model, VideoOptions* options) {
  const std::string extension = std::filesystem::path(options->out).extension().string();
  if (extension != ".png" && extension != ".mp4" && extension != ".gif")
    return Error{.what = "unknown kind of picture",
                 .where = "--out " + options->out,
                 .actual = "'" + extension + "'",
                 .allowed = ".mp4, .gif, .png"};
  if (model.free_starts().empty() && std::none_of(recording.measured.begin(), recording.measured.end(),
                                                  [](const auto& q) { return TraitsOf(q.spec.kind).gives_angle; })) {
    return Error{.what = "no position is measured: there is no real mechanism to draw", .where = recording.log_path};
  }
  const double end = recording.time_s.back();
  if (options->to_s < 0) options->to_s = end;
  options->to_s = std::min(options->to_s, end);
  if (!(options->from_s >= 0 && options->from_s < options->to_s)) {
    return Error{.what = "nothing of the log lies between --from and --to",
                 .where = recording.log_path,
                 .actual = fmt::format("{:g} .. {:g} s", options->from_s, options->to_s),
                 .allowed = fmt::format("within 0 .. {:g} s", end)};
  }
  if ((options->to_s - options->from_s) / options->speed * options->frames_per_s > kMaxFrames)
    return Error{.what = "more than a million frames",
                 .where = options->out,
                 .cure = "raise --speed, or cut with --from and --to"};
  return Ok();
}

Result<std::vector<Actor>> RehearseAll(const Recording& recording, const std::vector<VideoModel>& models,
                                       const VideoOptions& options, ThreadPool& pool) {
  std::vector<Actor> actors;
  for (const auto& model : models) {
    GS_ASSIGN(Actor actor, Rehearse(recording, model, options, pool));
    actors.push_back(std::move(actor));
  }
  return actors;
}

Page ComposePage(const Recording& recording, const std::vector<VideoModel>& models, const std::vector<Actor>& actors,
                 const VideoOptions& options, PageTraces traces) {
  const PageOptions page{.width = options.width,
                         .height = options.height,
                         .from_s = options.from_s,
                         .to_s = options.to_s,
                         .speed = options.speed,
                         .title = std::filesystem::path(recording.log_path).filename().string(),
                         .side_by_side = options.layout == Layout::kSide};
  std::vector<PageModel> labels;
  for (std::size_t m = 0; m < models.size(); ++m) {
    const LogReplay& replay = actors[m].replay;
    labels.push_back({.label = models[m].label,
                      .error = actors[m].error,
                      .diverged_at_s = replay.outcome == Outcome::kDiverged ? replay.diverged_at_s : -1});
  }
  return Page(page, std::move(traces), std::move(labels));
}

Framing FrameActors(const std::vector<Actor>& actors, const Page& page, View view) {
  std::vector<const PoseTrack*> tracks;
  for (const Actor& actor : actors) tracks.insert(tracks.end(), {&actor.measured, &actor.predicted});
  // Models may differ in joints, not in what is drawn: the first one's frames all.
  if (std::any_of(actors.begin(), actors.end(),
                  [&](const Actor& a) { return a.drawn->nq != actors.front().drawn->nq; }))
    tracks.resize(2);
  return FrameMotion(*actors.front().drawn, tracks, view,
                     static_cast<double>(page.scene_width()) / page.scene_height());
}

Status WriteStill(const Stage& stage, double at_s, const VideoOptions& options, ThreadPool& pool,
                  VideoSummary* summary) {
  Picture picture;
  GS_RETURN_IF_ERROR(PaintAll(stage, {at_s}, options, pool, [&](const Picture& frame) {
    picture = frame;
    return Ok();
  }));
  GS_RETURN_IF_ERROR(WritePng(options.out, picture));
  summary->frames = 1;
  summary->first_s = summary->last_s = at_s;
  return Ok();
}

Status WriteFilm(const Stage& stage, const VideoOptions& options, ThreadPool& pool, VideoSummary* summary) {
  const std::vector<double> times = FrameTimes(options);
  GS_ASSIGN(const auto encoder,
            Encoder::Start(options.out, options.out.ends_with(".gif") ? VideoFormat::kGif : VideoFormat::kMp4,
                           options.width, options.height, options.frames_per_s));
  GS_RETURN_IF_ERROR(
      PaintAll(stage, times, options, pool, [&](const Picture& frame) { return encoder->Write(frame); }));
  GS_RETURN_IF_ERROR(encoder->Finish());
  summary->frames = times.size();
  summary->first_s = times.front();
  summary->last_s = times.back();
  summary->length_s = static_cast<double>(times.size()) / options.frames_per_s;
  return Ok();
}

}  // namespace

template <>
std::span<const EnumName<Layout>> EnumNames<Layout>() {
  static constexpr EnumName<Layout> kNames[] = {{Layout::kOverlay, "overlay"}, {Layout::kSide, "side"}};
  return kNames;
}

std::vector<double> FrameTimes(const VideoOptions& options) {
  std::vector<double> times;
  const double step = options.speed / options.frames_per_s;
  // Multiplied, not added up: frame k is where it should be.
  for (std::size_t k = 0;; ++k) {
    const double t = options.from_s + static_cast<double>(k) * step;
    if (t > options.to_s + 1e-9 * step) break;
    times.push_back(t);
  }
  return times;
}

Result<VideoSummary> RenderVideo(const Recording& recording, const std::vector<VideoModel>& models,
                                 const VideoOptions& asked, ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  GS_CHECK(!models.empty());
  VideoOptions options = asked;
  GS_RETURN_IF_ERROR(Validate(recording, *models.front().model, &options));
  GS_RETURN_IF_ERROR(OpenCairo());
  VideoSummary summary;
  GS_ASSIGN(summary.gl, OpenGl(options.gl, pool.workers(), &summary.note));
  GS_ASSIGN(const std::vector<Actor> actors, RehearseAll(recording, models, options, pool));
  for (const Actor& actor : actors) summary.errors.push_back(actor.error);
  PageTraces traces = TracesOf(recording, models.front().model->experiment(), actors);
  const double at = options.at_s >= 0 ? std::min(options.at_s, recording.time_s.back())
                                      : TimeOfGreatestError(traces, options.from_s, options.to_s);
  const Page page = ComposePage(recording, models, actors, options, std::move(traces));
  const Framing framing = FrameActors(actors, page, options.view);
  const Stage stage{actors, page, framing, options.layout};
  if (options.out.ends_with(".png")) {
    GS_RETURN_IF_ERROR(WriteStill(stage, at, options, pool, &summary));
  } else {
    GS_RETURN_IF_ERROR(WriteFilm(stage, options, pool, &summary));
  }
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace gapscope

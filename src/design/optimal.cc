#include "src/design/optimal.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr int kRoughJacobians = 2, kJacobians = 8;  // of an imitation: each is a replay per parameter
// Rivals are simulations that are compared with each other.
constexpr StepKind kRivalSteps = StepKind::kQuick;

Error TimeIsOver() { return {.what = "the time that was asked for is over", .where = "--budget"}; }

// Library inputs made as large as all models' limits allow. An entry without a value keeps no limit at any amplitude.
Result<std::vector<std::optional<InputScore>>> SizeInputs(const std::vector<const Hypothesis*>& models,
                                                          const OptimalOptions& options, ThreadPool& pool) {
  const Experiment& experiment = models.front()->model->experiment();
  GS_ASSIGN(const std::size_t driven, DrivenCommand(experiment, options.rehearsal));
  double highest = CommandLimit(experiment, experiment.commands[driven].actuator);
  if (options.amplitude > 0) highest = highest > 0 ? std::min(highest, options.amplitude) : options.amplitude;
  if (!(highest > 0)) {
    return Error{.what = "no limit of the command is stated",
                 .where = experiment.path,
                 .cure = "add 'limits: [{actuator: " + experiment.commands[driven].actuator +
                         ", command: NUMBER}]' to it, or --amplitude"};
  }
  const std::vector<LibraryInput> library = InputLibrary(options.duration_s, options.rehearsal.rate_hz);
  // Checks what every input shares before the work is spread.
  GS_RETURN_IF_ERROR([&]() -> Status {
    GS_ASSIGN(const auto wave, SampleWaveform(library.front().wave, options.rehearsal.rate_hz));
    GS_ASSIGN([[maybe_unused]] const auto input, MakeInput(experiment, options.rehearsal, wave));
    return Ok();
  }());
  std::vector<std::optional<InputScore>> sized(library.size());
  pool.ForEach(library.size(), [&](std::size_t i, int) {
    if (IsLate(options.deadline)) return;
    const auto wave = SampleWaveform(library[i].wave, options.rehearsal.rate_hz);
    if (!wave.ok()) return;
    std::vector<std::unique_ptr<Simulator>> simulators;
    std::vector<ModelAndValues> trials;
    for (const Hypothesis* h : models) {
      simulators.push_back(std::make_unique<Simulator>(*h->model, options.time_step_s));
      trials.push_back({h->model.get(), simulators.back().get(), h->values});
    }
    // The base model lacks what the offset is against.
    trials.front().lacks = {.command = driven, .value = options.rehearsal.offset};
    // One model after the other: most of them are content with what the one before allowed.
    double largest = highest;
    for (const auto& trial : trials) {
      const auto allowed = LargestAmplitude({trial}, options.rehearsal, wave.value(), largest, options.margin);
      if (!allowed.ok()) return;
      largest = allowed.value();
    }
    InputScore score{.wave = library[i].wave, .amplitude = largest * library[i].share};
    std::vector<double> values = wave.value();
    for (double& value : values) value *= score.amplitude;
    auto input = MakeInput(experiment, options.rehearsal, values);
    score.rehearsal = Rehearse(*models.front()->model, *simulators.front(), std::move(input).value(),
                               models.front()->values, trials.front().lacks);
    sized[i] = std::move(score);
  });
  if (std::none_of(sized.begin(), sized.end(), [](const auto& s) { return s.has_value(); })) {
    if (IsLate(options.deadline)) return TimeIsOver();
    return Error{.what = "no input of the library keeps the limits",
                 .where = experiment.path,
                 .cure = "see 'limits:', or give --duration"};
  }
  return sized;
}

// A fit with more Jacobians only lowers a score: the best input is found once no rougher score is above it. Those that
// still are, highest first, at most `count`.
std::vector<InputScore*> WorthRefining(std::vector<std::optional<InputScore>>& sized, std::size_t count) {
  double best = -kInfinity;
  for (const auto& score : sized) {
    if (score && score->refined) best = std::max(best, score->score);
  }
  std::vector<InputScore*> worth;
  for (auto& score : sized) {
    if (score && !score->refined && score->score > best) worth.push_back(&*score);
  }
  std::stable_sort(worth.begin(), worth.end(), [](const auto* a, const auto* b) { return a->score > b->score; });
  worth.resize(std::min(worth.size(), count));
  return worth;
}

void SortByScore(std::vector<std::optional<InputScore>>& sized, OptimalDesign* design) {
  for (auto& score : sized) {
    if (score) design->inputs.push_back(std::move(*score));
  }
  std::stable_sort(design->inputs.begin(), design->inputs.end(), [](const InputScore& a, const InputScore& b) {
    return a.refined != b.refined ? a.refined : a.score > b.score;
  });
}

// A deviation of coordinate k as a share of its value, or of its range where the value is zero.
double Relative(const SearchSpace& space, std::size_t k, double deviation) {
  const Coordinate& c = space.coordinates()[k];
  if (c.logarithmic) return deviation;
  const double value = space.start()[static_cast<std::size_t>(c.parameter)];
  return value != 0 ? deviation * c.scale / std::abs(value) : deviation / (c.high - c.low);
}

// Each rival's log on this input, imitated by every other one.
void Separate(const std::vector<Hypothesis>& rivals, const OptimalOptions& options, int jacobians, InputScore* score) {
  const Recording& input = score->rehearsal.recording;
  std::vector<double> floors = options.floors.empty() ? FloorsOf(input) : options.floors;
  floors.resize(input.measured.size(), 1);  // of limits, which are not scored
  score->per_target.clear();
  score->score = kInfinity;
  for (const Hypothesis& truth : rivals) {
    Simulator simulator(*truth.model, options.time_step_s);
    simulator.set_steps(kRivalSteps);
    const Rehearsal foretold = Rehearse(*truth.model, simulator, input, truth.values);
    for (const Hypothesis& imitation : rivals) {
      if (&truth == &imitation) continue;
      if (Holds(imitation, truth)) {
        score->per_target.push_back(0);
        continue;
      }
      const double distance =
          foretold.worst < kInfinity
              ? ForetoldFit(imitation, {foretold.recording, floors, options.window_s, options.time_step_s, kRivalSteps,
                                        options.max_windows, options.coupling})
                    .Misfit(jacobians, options.deadline)
              : kInfinity;
      // What cannot be simulated separates nothing.
      score->per_target.push_back(std::isfinite(distance) ? distance : 0);
      score->score = std::min(score->score, score->per_target.back());
    }
  }
}

}  // namespace

bool Holds(const Hypothesis& rival, const Hypothesis& other) {
  const auto &mine = rival.model->effects(), &others = other.model->effects();
  const auto holds = [&](const EffectUse& richer, const EffectUse& simpler) {
    if (richer == simpler) return true;
    const auto& contains = EffectOf(richer, *rival.model->rig()).contains;
    return richer.on == simpler.on && std::ranges::find(contains, simpler.effect, &Contained::effect) != contains.end();
  };
  const bool all = std::ranges::all_of(others, [&](const EffectUse& simpler) {
    return std::ranges::any_of(mine, [&](const EffectUse& richer) { return holds(richer, simpler); });
  });
  return all && mine != others;
}

std::vector<LibraryInput> InputLibrary(double duration_s, double rate_hz) {
  const double top = std::min(10.0, rate_hz / 8), low = 1 / duration_s;
  const auto wave = [&](WaveShape shape, double from, double to) {
    return Waveform{.shape = shape,
                    .duration_s = duration_s,
                    .low_hz = std::min(from, top),
                    .high_hz = std::min(to, top),
                    .seed = 1};
  };
  const auto mirrored = [](Waveform of) {
    of.mirrored = true;
    return of;
  };
  return {
      {wave(WaveShape::kChirp, 0.1, 10), 1},
      {wave(WaveShape::kChirp, 0.1, 10), 0.25},
      {wave(WaveShape::kMultisine, low, 3), 1},
      {wave(WaveShape::kMultisine, low, 10), 1},
      {wave(WaveShape::kSteps, 0.5, 0.5), 1},
      {wave(WaveShape::kSteps, 2, 2), 1},
      {mirrored(wave(WaveShape::kSquare, 0.5, 0.5)), 1},
      {wave(WaveShape::kSquare, 1 / 0.63, 1 / 0.63), 1},
      {mirrored(wave(WaveShape::kTriangle, 2 * low, low)), 1},
      {wave(WaveShape::kTriangle, 2 * low, low), 0.25},
  };
}

Result<OptimalDesign> DesignForParameters(const Hypothesis& base, const std::vector<int>& parameters,
                                          const OptimalOptions& options, ThreadPool& pool) {
  OptimalDesign design;
  const std::vector<int> free = base.model->FreeParameters();
  std::vector<std::size_t> wanted;  // in `free`
  for (const int index : parameters) {
    const auto found = std::find(free.begin(), free.end(), index);
    const Parameter& p = base.model->parameters()[static_cast<std::size_t>(index)];
    if (found == free.end())
      return Error{.what = "the parameter is frozen",
                   .where = "--parameter " + p.name,
                   .cure = "give it bounds and no 'frozen: true' in " + base.model->experiment().path};
    wanted.push_back(static_cast<std::size_t>(found - free.begin()));
    design.targets.push_back(p.name);
  }
  GS_ASSIGN(auto sized, SizeInputs({&base}, options, pool));
  pool.ForEach(sized.size(), [&](std::size_t i, int) {
    if (!sized[i]) return;
    const Recording& log = sized[i]->rehearsal.recording;
    ForetoldFit fit(base, {log, FloorsOf(log), 0, options.time_step_s});
    const std::vector<double> deviations = fit.Deviations(wanted);
    if (deviations.empty()) {
      sized[i].reset();
      return;
    }
    double sum = 0;
    for (const std::size_t k : wanted) {
      sized[i]->per_target.push_back(Relative(fit.problem().space(), k, deviations[k]));
      sum += std::log(sized[i]->per_target.back());
    }
    sized[i]->score = -sum / static_cast<double>(wanted.size());
    sized[i]->refined = true;
  });
  SortByScore(sized, &design);
  if (design.inputs.empty())
    return Error{.what = "no input of the library can be simulated", .where = base.model->experiment().path};
  return design;
}

Result<OptimalDesign> DesignForRivals(const Hypothesis& base, const std::vector<Hypothesis>& rivals,
                                      const OptimalOptions& options, ThreadPool& pool) {
  GS_CHECK(rivals.size() >= 2);
  OptimalDesign design;
  std::vector<const Hypothesis*> models = {&base};
  for (const Hypothesis& truth : rivals) {
    models.push_back(&truth);
    for (const Hypothesis& imitation : rivals) {
      if (&truth != &imitation) design.targets.push_back(truth.name + " against " + imitation.name);
    }
  }
  GS_ASSIGN(auto sized, SizeInputs(models, options, pool));
  pool.ForEach(sized.size(), [&](std::size_t i, int) {
    if (!sized[i]) return;
    IsLate(options.deadline) ? sized[i].reset() : Separate(rivals, options, kRoughJacobians, &*sized[i]);
  });
  for (auto next = WorthRefining(sized, options.batch); !next.empty(); next = WorthRefining(sized, options.batch)) {
    if (IsLate(options.deadline)) break;
    pool.ForEach(next.size(), [&](std::size_t i, int) {
      Separate(rivals, options, kJacobians, next[i]);
      next[i]->refined = true;
    });
  }
  SortByScore(sized, &design);
  if (design.inputs.empty()) return TimeIsOver();
  return design;
}

std::string CommandFor(const std::string& experiment, const RehearsalOptions& rehearsal, const InputScore& input) {
  const Waveform& w = input.wave;
  std::string text = fmt::format("gapscope design {} {} --duration {:g} --rate {:g} --amplitude {:.6g}",
                                 w.shape == WaveShape::kChirp ? "sweep" : NameOf(w.shape), experiment, w.duration_s,
                                 rehearsal.rate_hz, input.amplitude);
  switch (w.shape) {
    case WaveShape::kChirp:
    case WaveShape::kMultisine:
      text += fmt::format(" --low-hz {:.6g} --high-hz {:.6g}", w.low_hz, w.high_hz);
      break;
    case WaveShape::kSteps:
      text += fmt::format(" --hold-s {:.6g} --seed {}", 1 / (2 * w.low_hz), w.seed);
      break;
    default:
      text += fmt::format(" --period {:.6g}", 1 / w.low_hz);
  }
  if (w.mirrored) text += " --mirror";
  if (!rehearsal.actuator.empty()) text += " --actuator " + rehearsal.actuator;
  if (rehearsal.offset != 0) text += fmt::format(" --offset {:.6g}", rehearsal.offset);
  for (const auto& [flag, values] : {std::pair{"--value", &rehearsal.log_values}, {"--hold", &rehearsal.hold}}) {
    for (const auto& [name, value] : *values) text += fmt::format(" {} {}={:g}", flag, name, value);
  }
  return text;
}

}  // namespace gapscope

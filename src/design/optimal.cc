#include "src/design/optimal.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace gapscope {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOffset_rad = 0.01;  // of a sensor's zero, known beforehand
constexpr double kShiftHalfSamples = 1;

// Inverse variances of what is known beforehand, in the order of a Jacobian's columns.
Eigen::VectorXd PriorWeights(const Hypothesis& hypothesis, Eigen::Index columns) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(columns);
  const Eigen::Index parameters = static_cast<Eigen::Index>(hypothesis.free.size());
  for (Eigen::Index i = 0; i < parameters; ++i) {
    const double prior = hypothesis.free[static_cast<std::size_t>(i)].prior;
    if (prior > 0) weights[i] = 1 / (prior * prior);
  }
  weights[parameters] = 1 / (kShiftHalfSamples * kShiftHalfSamples);
  weights.tail(columns - parameters - 1).setConstant(1 / (kOffset_rad * kOffset_rad));
  return weights;
}

double RootMeanSquare(const Eigen::VectorXd& residual) {
  return std::sqrt(residual.squaredNorm() / static_cast<double>(residual.size()));
}

// How far the imitation stays from `truth`, root mean square in floors, after Gauss-Newton steps. `jacobians`: how many
// are made by replays; steps beyond that use the last one with Broyden's rank-one corrections (Broyden, "A class of
// methods for solving nonlinear simultaneous equations", Math. Comp. 19, 1965).
double Imitate(const Hypothesis& rival, Predictor& predictor, const Recording& input, const Eigen::VectorXd& truth,
               const std::vector<double>& floors, double rows_per_sample, int jacobians) {
  constexpr int kSteps = 10;
  std::vector<double> values = rival.values;
  double shift_s = 0;
  Eigen::VectorXd at = predictor.Predict(input, values, shift_s, floors);
  if (at.size() != truth.size()) return kInfinity;
  const Eigen::Index parameters = static_cast<Eigen::Index>(rival.free.size());
  const double half_sample = 0.5 * input.timeline.median_step_s;
  Eigen::MatrixXd jacobian = predictor.Jacobian(input, values, shift_s, floors, at);
  double best = RootMeanSquare(at - truth), damping = 1e-3;
  if (jacobian.size() == 0) return best;
  const Eigen::VectorXd weights = PriorWeights(rival, jacobian.cols());
  const Eigen::Index zeros = jacobian.cols() - parameters - 1;
  Eigen::VectorXd offsets = Eigen::VectorXd::Zero(zeros);
  int made = 1, failures = 0;
  for (int iteration = 0; iteration < kSteps; ++iteration) {
    // What the priors already hold against moving farther.
    Eigen::VectorXd moved(jacobian.cols());
    for (Eigen::Index i = 0; i < parameters; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      moved[i] =
          rival.ToSearch(k, values[rival.free[k].parameter]) - rival.ToSearch(k, rival.values[rival.free[k].parameter]);
    }
    moved[parameters] = shift_s / half_sample;
    moved.tail(zeros) = offsets;
    const Eigen::VectorXd residual = at + jacobian.rightCols(zeros) * offsets - truth;
    const Eigen::MatrixXd normal = jacobian.transpose() * jacobian / rows_per_sample;
    const Eigen::VectorXd right = jacobian.transpose() * residual / rows_per_sample + weights.cwiseProduct(moved);
    Eigen::MatrixXd damped = normal;
    damped.diagonal() += weights + damping * normal.diagonal() +
                         Eigen::VectorXd::Constant(normal.rows(), 1e-12 * normal.diagonal().maxCoeff());
    Eigen::VectorXd step = -damped.ldlt().solve(right);
    if (!step.allFinite()) return best;
    // Bounds: what would leave them stops there.
    std::vector<double> next = values;
    for (Eigen::Index i = 0; i < parameters; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const auto& free = rival.free[k];
      const double x = rival.ToSearch(k, values[free.parameter]);
      step[i] = std::clamp(x + step[i], free.low, free.high) - x;
      next[free.parameter] = rival.ToValue(k, x + step[i]);
    }
    step[parameters] =
        std::clamp(moved[parameters] + step[parameters], -kShiftHalfSamples, kShiftHalfSamples) - moved[parameters];
    const double next_shift = shift_s + step[parameters] * half_sample;
    const Eigen::VectorXd next_offsets = offsets + step.tail(zeros);
    const Eigen::VectorXd predicted = predictor.Predict(input, next, next_shift, floors);
    const double distance = predicted.size() == truth.size()
                                ? RootMeanSquare(predicted + jacobian.rightCols(zeros) * next_offsets - truth)
                                : kInfinity;
    if (predicted.size() == at.size()) {
      // The zero offsets' columns are exact: only the rest is corrected.
      const Eigen::VectorXd replayed = step.head(parameters + 1);
      if (replayed.squaredNorm() > 0)
        jacobian.leftCols(parameters + 1) += (predicted - at - jacobian.leftCols(parameters + 1) * replayed) *
                                             replayed.transpose() / replayed.squaredNorm();
    }
    if (distance < best) {
      const bool done = distance > 0.99 * best;
      values = next, shift_s = next_shift, offsets = next_offsets, at = predicted, best = distance;
      damping = std::max(damping * 0.1, 1e-6);
      failures = 0;
      if (!done) continue;
      if (made >= jacobians) break;
    } else if (++failures < 3) {
      damping = std::max(damping * 30, 1e-2);
      continue;
    } else if (made >= jacobians) {
      break;
    }
    jacobian = predictor.Jacobian(input, values, shift_s, floors, at);
    if (jacobian.size() == 0) return best;
    ++made, failures = 0, damping = 1e-3;
  }
  return best;
}

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
    const auto wave = SampleWaveform(library[i].wave, options.rehearsal.rate_hz);
    if (!wave.ok()) return;
    std::vector<std::unique_ptr<Simulator>> simulators;
    std::vector<ModelAndValues> trials;
    for (const Hypothesis* h : models) {
      simulators.push_back(std::make_unique<Simulator>(*h->model, 0));
      trials.push_back({h->model.get(), simulators.back().get(), h->values});
    }
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
    score.rehearsal =
        Rehearse(*models.front()->model, *simulators.front(), std::move(input).value(), models.front()->values);
    sized[i] = std::move(score);
  });
  if (std::none_of(sized.begin(), sized.end(), [](const auto& s) { return s.has_value(); })) {
    return Error{.what = "no input of the library keeps the limits",
                 .where = experiment.path,
                 .cure = "see 'limits:', or give --duration"};
  }
  return sized;
}

double RowsPerSample(const OptimalOptions& options) {
  return std::max(1.0, kNoiseCorrelation_s * options.rehearsal.rate_hz);
}

void SortByScore(std::vector<std::optional<InputScore>>& sized, OptimalDesign* design) {
  for (auto& score : sized) {
    if (score) design->inputs.push_back(std::move(*score));
  }
  std::stable_sort(design->inputs.begin(), design->inputs.end(), [](const InputScore& a, const InputScore& b) {
    return a.refined != b.refined ? a.refined : a.score > b.score;
  });
}

}  // namespace

std::vector<LibraryInput> InputLibrary(double duration_s, double rate_hz) {
  const double top = std::min(10.0, rate_hz / 8), low = 1 / duration_s;
  const auto wave = [&](WaveShape shape, double from, double to) {
    return Waveform{.shape = shape,
                    .duration_s = duration_s,
                    .low_hz = std::min(from, top),
                    .high_hz = std::min(to, top),
                    .seed = 1};
  };
  return {
      {wave(WaveShape::kChirp, 0.1, 10), 1},         {wave(WaveShape::kChirp, 0.1, 10), 0.25},
      {wave(WaveShape::kMultisine, low, 3), 1},      {wave(WaveShape::kMultisine, low, 10), 1},
      {wave(WaveShape::kSteps, 0.5, 0.5), 1},        {wave(WaveShape::kSteps, 2, 2), 1},
      {wave(WaveShape::kSquare, 0.5, 0.5), 1},       {wave(WaveShape::kSquare, 1 / 0.63, 1 / 0.63), 1},
      {wave(WaveShape::kTriangle, 2 * low, low), 1}, {wave(WaveShape::kTriangle, 2 * low, low), 0.25},
  };
}

Result<OptimalDesign> DesignForParameters(const Hypothesis& base, const std::vector<int>& parameters,
                                          const OptimalOptions& options, ThreadPool& pool) {
  OptimalDesign design;
  std::vector<Eigen::Index> columns;
  for (const int index : parameters) {
    const auto found =
        std::find_if(base.free.begin(), base.free.end(), [&](const auto& f) { return f.parameter == index; });
    const Parameter& p = base.model->parameters()[static_cast<std::size_t>(index)];
    if (found == base.free.end())
      return Error{.what = "the parameter is frozen",
                   .where = "--parameter " + p.name,
                   .cure = "give it bounds and no 'frozen: true' in " + base.model->experiment().path};
    columns.push_back(found - base.free.begin());
    design.targets.push_back(p.name);
  }
  GS_ASSIGN(auto sized, SizeInputs({&base}, options, pool));
  pool.ForEach(sized.size(), [&](std::size_t i, int) {
    if (!sized[i]) return;
    Predictor predictor(base, 0);
    const Recording& input = sized[i]->rehearsal.recording;
    const std::vector<double> floors = FloorsOf(input);
    const Eigen::VectorXd at = predictor.Predict(input, base.values, 0, floors);
    const Eigen::MatrixXd jacobian =
        at.size() > 0 ? predictor.Jacobian(input, base.values, 0, floors, at) : Eigen::MatrixXd();
    if (jacobian.size() == 0) {
      sized[i].reset();
      return;
    }
    Eigen::MatrixXd information = jacobian.transpose() * jacobian / RowsPerSample(options);
    Eigen::VectorXd weights = PriorWeights(base, jacobian.cols());
    for (const Eigen::Index c : columns) weights[c] = 0;  // what is asked for is not assumed
    information.diagonal() += weights;
    // A direction that the input does not show at all gets a very small information instead of none.
    information.diagonal().array() += 1e-9;
    const Eigen::MatrixXd covariance =
        information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
    double sum = 0;
    for (const Eigen::Index c : columns) {
      const auto& free = base.free[static_cast<std::size_t>(c)];
      const double value = base.values[free.parameter];
      const double deviation = std::sqrt(std::max(covariance(c, c), 0.0));
      const double relative = free.logarithmic ? deviation
                              : value != 0     ? deviation / std::abs(value)
                                               : deviation / (free.high - free.low);
      sized[i]->per_target.push_back(relative);
      sum += std::log(relative);
    }
    sized[i]->score = -sum / static_cast<double>(columns.size());
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
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  // truth, imitation
  for (std::size_t i = 0; i < rivals.size(); ++i) {
    models.push_back(&rivals[i]);
    for (std::size_t j = 0; j < rivals.size(); ++j) {
      if (i == j) continue;
      pairs.emplace_back(i, j);
      design.targets.push_back(rivals[i].name + " against " + rivals[j].name);
    }
  }
  GS_ASSIGN(auto sized, SizeInputs(models, options, pool));
  const auto separate = [&](InputScore& score, bool refine) {
    const Recording& input = score.rehearsal.recording;
    const std::vector<double> floors = FloorsOf(input);
    std::vector<std::unique_ptr<Predictor>> predictors;
    std::vector<Eigen::VectorXd> truths;
    for (const auto& rival : rivals) {
      predictors.push_back(std::make_unique<Predictor>(rival, 0));
      truths.push_back(predictors.back()->Predict(input, rival.values, 0, floors));
    }
    score.per_target.clear();
    score.score = kInfinity;
    for (const auto& [truth, imitation] : pairs) {
      const double distance = truths[truth].size() == 0
                                  ? 0
                                  : Imitate(rivals[imitation], *predictors[imitation], input, truths[truth], floors,
                                            RowsPerSample(options), refine ? 4 : 1);
      score.per_target.push_back(std::isfinite(distance) ? distance : 0);
      score.score = std::min(score.score, score.per_target.back());
    }
    score.refined = refine;
  };
  pool.ForEach(sized.size(), [&](std::size_t i, int) {
    if (sized[i]) separate(*sized[i], false);
  });
  std::vector<std::size_t> order(sized.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t i) { return !sized[i]; });
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sized[a]->score > sized[b]->score; });
  order.resize(std::min(order.size(), options.refined));
  pool.ForEach(order.size(), [&](std::size_t i, int) { separate(*sized[order[i]], true); });
  SortByScore(sized, &design);
  return design;
}

}  // namespace gapscope

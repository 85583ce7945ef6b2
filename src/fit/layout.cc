#include "src/fit/layout.h"

#include <algorithm>
#include <cmath>

#include "replay/initial_state.h"
#include "src/compare/score.h"
#include "src/core/statistics.h"
#include "src/experiment/orientation.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

double Weight(const FitOptions& options, const Recording::Measured& measured, const Moments& moments,
              double deviation) {
  if (!measured.spec.scored) return 0;
  if (!options.weights.empty()) return options.weights[measured.index];
  return 1 / (options.normalization == Normalization::kDeviation ? deviation : std::hypot(deviation, moments.mean));
}

// What is scored: signals of the motion, and those that follow from forces.
struct ScoredSignals {
  std::vector<const Recording::Measured*> motion, forces;
};

ScoredSignals FindScored(const std::vector<Recording>& recordings, const FitLayout& layout) {
  ScoredSignals scored;
  for (std::size_t l = 0; l < recordings.size(); ++l) {
    for (std::size_t s = 0; s < recordings[l].measured.size(); ++s) {
      const Recording::Measured& measured = recordings[l].measured[s];
      if (!(layout.signals[l][s].weight > 0)) continue;
      const bool of_motion = TraitsOf(measured.spec.kind).stage == SignalStage::kState;
      (of_motion ? scored.motion : scored.forces).push_back(&measured);
    }
  }
  return scored;
}

// Whether they come late by times of the model's: commands that are late by one more time would be the same motion.
bool AreLate(const Model& model, const std::vector<const Recording::Measured*>& motion) {
  return !motion.empty() &&
         std::ranges::all_of(motion, [&](const auto* signal) { return model.source(signal->index).delay >= 0; });
}

// Joints that no position or speed of the log is of, in the model's order. Not those that an effect added or an
// equality ties to another joint: they start with what they are tied to.
std::vector<int> UnseenJoints(const Model& model, const Recording& recording) {
  const mjModel& m = model.compiled();
  std::vector<char> known(static_cast<std::size_t>(m.njnt), 0);
  for (int j = 0; j < m.njnt; ++j)
    known[j] = static_cast<char>(m.jnt_type[j] != mjJNT_HINGE && m.jnt_type[j] != mjJNT_SLIDE);
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    const SignalTraits& traits = TraitsOf(source.kind);
    if (traits.gives_angle || traits.gives_speed) known[source.joint] = 1;
  }
  for (const auto& [joint, from] : model.mirrored_joints()) known[joint] = 1;
  for (int e = 0; e < m.neq; ++e) {
    if (m.eq_type[e] != mjEQ_JOINT) continue;
    for (const int joint : {m.eq_obj1id[e], m.eq_obj2id[e]}) {
      if (joint >= 0) known[joint] = 1;
    }
  }
  std::vector<int> unseen;
  for (int j = 0; j < m.njnt; ++j) {
    if (!known[j]) unseen.push_back(j);
  }
  return unseen;
}

// Whether the signal is of an orientation that a free body starts from.
bool StartsABody(const Model& model, std::size_t measured) {
  const int index = static_cast<int>(measured);
  return std::ranges::any_of(model.free_starts(), [&](const FreeStart& start) {
    return start.rotation >= 0 && index >= start.rotation && index < start.rotation + kTurns;
  });
}

// What the log's own start counts, as so many samples of the signal that gives it.
double PriorOf(const SignalLayout& signal) {
  return std::sqrt(kFitPolicy.state_prior_samples) * (signal.weight > 0 ? signal.weight : 1 / signal.deviation);
}

// The six of a free body: as well known as its pose's signals say, half of it not at all where half is not measured.
void AddBody(const FreeStart& start, const Recording& recording, const std::vector<SignalLayout>& signals,
             UnseenStates* states, std::vector<double>* prior) {
  const int rotation = FindMeasured(recording, start.rotation);
  if (rotation < 0 && FindMeasured(recording, start.position[0]) < 0) return;
  for (int i = 0; i < 6; ++i) {
    const bool turns = i >= 3;
    const int signal = turns ? (rotation < 0 ? -1 : rotation + i - 3) : FindMeasured(recording, start.position[i]);
    states->dofs.push_back({.dof = start.dof + i, .signal = signal});
    const double unseen = 1 / (turns ? kFitPolicy.unseen_prior_rad : kFitPolicy.unseen_prior_m);
    prior->push_back(signal >= 0 ? PriorOf(signals[static_cast<std::size_t>(signal)]) : unseen);
    prior->push_back(signal >= 0 ? prior->back() * kFitPolicy.speed_prior_s : unseen / kFitPolicy.unseen_rad_per_s);
  }
}

// The window's states of joints that are not measured, and what is known of them.
UnseenStates AddUnseen(const Model& model, const Recording& recording, const std::vector<SignalLayout>& signals,
                       std::vector<double>* prior) {
  const mjModel& m = model.compiled();
  UnseenStates states{.first = static_cast<Eigen::Index>(prior->size()), .dofs = {}};
  for (const int joint : UnseenJoints(model, recording)) {
    const bool slides = m.jnt_type[joint] == mjJNT_SLIDE;
    double deviation = slides ? kFitPolicy.unseen_prior_m : kFitPolicy.unseen_prior_rad;
    const double speed = deviation * kFitPolicy.unseen_rad_per_s;
    if (m.jnt_limited[joint])
      deviation = std::min(deviation, (m.jnt_range[2 * joint + 1] - m.jnt_range[2 * joint]) / 2);
    states.dofs.push_back({.dof = m.jnt_dofadr[joint]});
    prior->push_back(1 / deviation);
    prior->push_back(1 / speed);
  }
  for (const FreeStart& start : model.free_starts()) AddBody(start, recording, signals, &states, prior);
  return states;
}

// One log's signals, and the bounds of the offsets that it brings.
void AddLog(const Model& model, const Recording& recording, const FitOptions& options, FitLayout* layout,
            std::vector<double>* low, std::vector<double>* high) {
  std::vector<SignalLayout> signals(recording.measured.size());
  std::vector<double> prior;
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    const auto& measured = recording.measured[s];
    const Moments moments = MomentsOf(measured.values);
    const double deviation = std::max(moments.deviation, measured.spec.resolution);
    if (!(deviation > 0)) continue;
    signals[s].deviation = deviation;
    signals[s].weight = Weight(options, measured, moments, deviation);
    if (!TraitsOf(measured.spec.kind).has_zero) continue;
    if (options.fit_offsets) {
      signals[s].offset = static_cast<int>(low->size());
      low->push_back(-kFitPolicy.offset_bound_rad / deviation);
      high->push_back(kFitPolicy.offset_bound_rad / deviation);
    }
    signals[s].moves_start = TraitsOf(measured.spec.kind).gives_angle || StartsABody(model, measured.index);
    if (options.fit_states && TraitsOf(measured.spec.kind).gives_angle) {
      signals[s].joint_state = static_cast<int>(prior.size());
      const double weight = PriorOf(signals[s]);
      prior.push_back(weight);
      prior.push_back(weight * kFitPolicy.speed_prior_s);
    }
  }
  layout->unseen.push_back(options.fit_states ? AddUnseen(model, recording, signals, &prior) : UnseenStates{});
  // What only some effects bring comes last: each motor side beside its load.
  for (std::size_t i = 0; i < model.mirrored_joints().size() && options.fit_states; ++i) {
    prior.push_back(1 / kFitPolicy.motor_side_prior_rad);
    prior.push_back(1 / kFitPolicy.motor_side_prior_rad * kFitPolicy.speed_prior_s);
  }
  layout->signals.push_back(std::move(signals));
  layout->state_priors.push_back(Eigen::Map<Eigen::VectorXd>(prior.data(), static_cast<Eigen::Index>(prior.size())));
}

}  // namespace

FitLayout MakeLayout(const Model& model, const std::vector<Recording>& recordings, const FitOptions& options,
                     const SearchSpace& space) {
  FitLayout layout{.parameters = space.size()};
  std::vector<double> low(space.low().begin(), space.low().end()), high(space.high().begin(), space.high().end());
  double step = kInfinity;
  for (const Recording& recording : recordings) {
    step = std::min(step, recording.timeline.median_step_s);
    AddLog(model, recording, options, &layout, &low, &high);
  }
  layout.shift_scale_s = options.shift_range_s > 0 ? options.shift_range_s : step;
  const auto add_shift = [&](Eigen::Index* index) {
    *index = static_cast<Eigen::Index>(low.size());
    low.push_back(-1);
    high.push_back(1);
  };
  const ScoredSignals scored = FindScored(recordings, layout);
  if (options.fit_shift && !model.DelaysEveryCommand() && !AreLate(model, scored.motion))
    add_shift(&layout.command_shift);
  if (options.fit_shift && !scored.forces.empty()) add_shift(&layout.force_shift);
  layout.low = Eigen::Map<Eigen::VectorXd>(low.data(), static_cast<Eigen::Index>(low.size()));
  layout.high = Eigen::Map<Eigen::VectorXd>(high.data(), static_cast<Eigen::Index>(high.size()));
  return layout;
}

std::vector<std::pair<Eigen::Index, Eigen::Index>> SharedNuisances(const FitLayout& from, const FitLayout& to) {
  std::vector<std::pair<Eigen::Index, Eigen::Index>> shared;
  const auto add = [&](Eigen::Index a, Eigen::Index b) {
    if (a >= 0 && b >= 0) shared.emplace_back(a, b);
  };
  for (std::size_t l = 0; l < to.signals.size(); ++l) {
    for (std::size_t s = 0; s < to.signals[l].size(); ++s) add(from.signals[l][s].offset, to.signals[l][s].offset);
  }
  if (from.shift_scale_s != to.shift_scale_s) return shared;
  add(from.command_shift, to.command_shift);
  add(from.force_shift, to.force_shift);
  return shared;
}

double FitLayout::Offset(const Eigen::VectorXd& y, std::size_t log, std::size_t signal) const {
  const SignalLayout& layout = signals[log][signal];
  return layout.offset < 0 ? 0 : y[layout.offset] * layout.deviation;
}

double FitLayout::UnitCost() const {
  double unit = 0;
  for (const auto& log : signals) {
    for (const auto& signal : log) unit = std::max(unit, signal.weight * signal.deviation);
  }
  return unit * unit;
}

}  // namespace gapscope

#include "src/fit/coupling.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/fit/policy.h"

namespace gapscope {
namespace {

// Adds the squares of one window's column, per signal of the experiment.
template <typename Column>
void AddSquares(const FitProblem& problem, const FitWindow& window, const Column& column,
                std::vector<double>* squares) {
  const auto& measured = problem.recordings()[window.log].measured;
  for (std::size_t s = 0; s < measured.size(); ++s)
    (*squares)[measured[s].index] +=
        column.segment(static_cast<Eigen::Index>(s) * window.scored(), window.scored()).squaredNorm();
}

MovedSignals Moved(const std::vector<double>& squares) {
  double all = 0;
  for (const double square : squares) all += square;
  MovedSignals moved;
  if (!(all > 0)) return moved;
  for (const double square : squares)
    moved.push_back(static_cast<char>(square > kFitPolicy.touches * kFitPolicy.touches * all));
  return moved;
}

bool Share(const MovedSignals& a, const MovedSignals& b) {
  if (a.empty() || b.empty()) return true;
  for (std::size_t s = 0; s < a.size(); ++s) {
    if (a[s] && b[s]) return true;
  }
  return false;
}

}  // namespace

std::vector<std::vector<std::size_t>> ApartGroups(const std::vector<MovedSignals>& moved) {
  std::vector<std::vector<std::size_t>> groups;
  std::vector<MovedSignals> taken;  // of each group; empty: all
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const auto found = std::find_if(taken.begin(), taken.end(), [&](const auto& of) { return !Share(moved[i], of); });
    if (found == taken.end()) {
      groups.push_back({i});
      taken.push_back(moved[i]);
      continue;
    }
    groups[static_cast<std::size_t>(found - taken.begin())].push_back(i);
    for (std::size_t s = 0; s < moved[i].size(); ++s) (*found)[s] = static_cast<char>((*found)[s] || moved[i][s]);
  }
  return groups;
}

std::vector<std::size_t> NumberParts(std::size_t count, const std::vector<std::vector<std::size_t>>& groups) {
  std::vector<std::size_t> parts(count);
  std::iota(parts.begin(), parts.end(), std::size_t{0});
  for (const auto& group : groups) {
    for (const std::size_t thing : group)
      std::ranges::replace(parts, std::size_t{parts[thing]}, std::size_t{parts[group.front()]});
  }
  std::map<std::size_t, std::size_t> numbers;
  for (std::size_t& part : parts) part = numbers.try_emplace(part, numbers.size()).first->second;
  return parts;
}

void KeepMoved(const Recording& recording, const FitWindow& window, const MovedSignals& moved,
               Eigen::Ref<Eigen::VectorXd> column) {
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    if (!moved[recording.measured[s].index])
      column.segment(static_cast<Eigen::Index>(s) * window.scored(), window.scored()).setZero();
  }
}

Coupling Coupling::Measure(FitProblem& problem, const FitPoint& point, std::span<const ProbeTorque> torques,
                           Work* work) {
  Coupling coupling;
  const Derivatives at = problem.Differentiate(point, {.step = 0.01, .steps = StepKind::kQuick});
  *work += at.work;
  if (!at.valid) return coupling;
  const FitLayout& layout = problem.layout();
  const auto& windows = problem.windows();
  const std::size_t signals = problem.model().sources().size();
  for (std::size_t i = 0; i < problem.space().coordinates().size(); ++i) {
    std::vector<double> squares(signals, 0.0);
    for (std::size_t w = 0; w < windows.size(); ++w)
      AddSquares(problem, windows[w], at.jacobians[w].col(static_cast<Eigen::Index>(i)), &squares);
    coupling.of_parameter_[problem.space().parameter(problem.space().coordinates()[i]).name] = Moved(squares);
  }
  std::map<std::size_t, std::vector<double>> of_state;
  for (std::size_t w = 0; w < windows.size(); ++w) {
    const auto& measured = problem.recordings()[windows[w].log].measured;
    for (std::size_t s = 0; s < measured.size(); ++s) {
      const int state = layout.signals[windows[w].log][s].joint_state;
      if (state < 0) continue;
      std::vector<double>& squares = of_state.try_emplace(measured[s].index, signals, 0.0).first->second;
      for (const int column : {state, state + 1})
        AddSquares(problem, windows[w], at.jacobians[w].col(layout.low.size() + column), &squares);
    }
  }
  for (const auto& [signal, squares] : of_state) coupling.of_state_[signal] = Moved(squares);

  for (const ProbeTorque& torque : torques) {
    const char* name = mj_id2name(&problem.model().compiled(), mjOBJ_JOINT, torque.joint);
    if (!name || coupling.of_joint_.contains(name)) continue;
    problem.SetProbes({torque});
    const Evaluation there = problem.Evaluate(point, Keep::kResiduals, {}, at.steps());
    problem.SetProbes({});
    *work += there.work;
    if (!std::isfinite(there.cost)) continue;
    std::vector<double> squares(signals, 0.0);
    for (std::size_t w = 0; w < windows.size(); ++w)
      AddSquares(problem, windows[w], Eigen::VectorXd(there.residuals[w] - at.base()[w]), &squares);
    coupling.of_joint_[name] = Moved(squares);
  }
  coupling.FindLimbs(signals);
  return coupling;
}

void Coupling::FindLimbs(std::size_t signals) {
  std::vector<std::vector<std::size_t>> groups;
  for (const auto& [joint, moved] : of_joint_) {
    groups.emplace_back();
    for (std::size_t s = 0; s < signals; ++s) {
      if (moved.empty() || moved[s]) groups.back().push_back(s);
    }
  }
  if (groups.empty()) return;
  // What no joint moves is not scored: it is no limb of its own.
  for (std::size_t s = 0; s < signals; ++s) {
    if (std::ranges::none_of(groups, [&](const auto& group) { return std::ranges::find(group, s) != group.end(); }))
      groups.front().push_back(s);
  }
  limbs_ = NumberParts(signals, groups);
  if (limb_count() == 1) limbs_.clear();
}

std::vector<char> Coupling::LimbsOf(const MovedSignals& moved) const {
  std::vector<char> limbs(limb_count(), static_cast<char>(moved.empty()));
  for (std::size_t s = 0; s < moved.size(); ++s) {
    if (moved[s]) limbs[LimbOf(s)] = static_cast<char>(true);
  }
  return limbs;
}

std::size_t Coupling::limb_count() const { return limbs_.empty() ? 1 : *std::ranges::max_element(limbs_) + 1; }

MovedSignals Coupling::OfPlace(const std::string& place, const Rig& rig) const {
  if (of_joint_.empty()) return {};
  const auto& measured = rig.experiment().measured;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (measured[i].signal != place) continue;
    MovedSignals alone(measured.size(), 0);
    alone[i] = 1;
    return alone;
  }
  for (const std::string& joint : {place, rig.JointOf(place)}) {
    if (const auto found = of_joint_.find(joint); found != of_joint_.end()) return found->second;
  }
  return {};
}

MovedSignals Coupling::OfParameter(const std::string& name, const Rig& rig) const {
  if (const auto found = of_parameter_.find(name); found != of_parameter_.end()) return found->second;
  const std::size_t at = name.find('@'), dot = name.rfind('.');
  return at < dot && dot != std::string::npos ? OfPlace(name.substr(at + 1, dot - at - 1), rig) : MovedSignals();
}

MovedSignals Coupling::OfState(std::size_t signal) const {
  const auto found = of_state_.find(signal);
  return found == of_state_.end() ? MovedSignals() : found->second;
}

}  // namespace gapscope

// Robots whose joints do not touch each other, so that their motion under servos is known without MuJoCo, and logs of
// them.
#ifndef GAPSCOPE_TESTS_DRAFT_BENCH_H_
#define GAPSCOPE_TESTS_DRAFT_BENCH_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "src/draft/draft.h"
#include "src/experiment/experiment.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {

inline constexpr double kInertia = 0.02;  // kg m^2 of each joint
inline constexpr double kStep_s = 0.004;

// A bar for each name, each on a hinge of its own about a vertical axis; `inside` is written into every joint.
inline std::string Bars(const std::vector<std::string>& names, const std::string& after = "",
                        const std::string& inside = "") {
  std::string text = "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.002\"/><worldbody>";
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += "<body pos=\"" + std::to_string(i) + " 0 0\"><joint name=\"" + names[i] + "\" axis=\"0 0 1\" " + inside +
            "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.02 0.02 0.02\"/></body>";
  }
  return text + "</worldbody>" + after + "</mujoco>";
}

// The target of joint `i`, rad.
inline double TargetOf(std::size_t i, double t) {
  const double k = static_cast<double>(i + 1);
  return 0.4 * std::sin((3 + 1.3 * k) * t + k) + 0.2 * std::sin((7.1 + 0.7 * k) * t);
}

struct Motion {
  std::vector<double> time_s, target, angle, speed, torque;
};

struct MoveOptions {
  int rows = 2500;
  double gravity_n_m = 0;
  double stop_rad = 1e9;  // on both sides, hard and without rebound
};

// kInertia q'' = kp (target held from row to row - q) - kd q' - gravity sin q, by small steps.
inline Motion Move(std::size_t joint, double kp, double kd, const MoveOptions& options = {}) {
  Motion m;
  double q = TargetOf(joint, 0), w = 0;
  constexpr int kParts = 40;
  for (int k = 0; k < options.rows; ++k) {
    const double t = kStep_s * k, u = TargetOf(joint, t);
    m.time_s.push_back(t), m.target.push_back(u), m.angle.push_back(q), m.speed.push_back(w);
    m.torque.push_back(kp * (u - q) - kd * w);
    for (int i = 0; i < kParts; ++i) {
      w += kStep_s / kParts * (kp * (u - q) - kd * w - options.gravity_n_m * std::sin(q)) / kInertia;
      q += kStep_s / kParts * w;
      if (std::abs(q) > options.stop_rad) q = std::copysign(options.stop_rad, q), w = 0;
    }
  }
  return m;
}

struct Named {
  std::string name;
  std::vector<double> values;
};
inline std::vector<double> Times(std::vector<double> values, double factor, double offset = 0) {
  for (double& v : values) v = factor * v + offset;
  return values;
}

class DraftBench : public ::testing::Test {
 protected:
  // The draft of a log with these columns, and maybe of a second one, read back as an experiment. Fails the test when
  // there is none.
  Experiment Drafted(const std::string& mjcf, const std::vector<Named>& columns, const DraftOptions& options = {},
                     const std::vector<Named>& second = {}) {
    const auto draft = TryDraft(mjcf, columns, options, second);
    EXPECT_TRUE(draft.ok()) << (draft.ok() ? "" : draft.error().Text());
    if (!draft.ok()) return {};
    unsure_ = draft.value().unsure;
    text_ = draft.value().Yaml("robot.xml");
    const auto loaded = LoadExperiment(scratch_.Write("experiment.yaml", text_));
    EXPECT_TRUE(loaded.ok()) << loaded.error().Text() << "\n" << text_;
    return loaded.ok() ? loaded.value() : Experiment{};
  }

  Result<Draft> TryDraft(const std::string& mjcf, const std::vector<Named>& first, const DraftOptions& options = {},
                         const std::vector<Named>& second = {}) {
    const std::string model = scratch_.Write("robot.xml", mjcf);
    std::vector<DraftLog> logs;
    for (const std::vector<Named>& columns : {first, second}) {
      if (columns.empty()) continue;
      Log log;
      log.path = "log.csv";
      for (const auto& [name, values] : columns) log.columns.push_back({name, "", values});
      GS_ASSIGN(Timeline timeline, BuildTimeline(log, {}));
      logs.push_back({std::move(log), std::move(timeline)});
    }
    return DraftExperiment(model, logs, options);
  }

  // Of what the draft says of a joint or an actuator; null: nothing.
  static const MeasuredSpec* Measured(const Experiment& e, const std::string& on, SignalKind kind) {
    for (const auto& m : e.measured) {
      if (m.on == on && m.kind == kind) return &m;
    }
    return nullptr;
  }
  static const CommandSpec* Command(const Experiment& e, const std::string& actuator) {
    for (const auto& c : e.commands) {
      if (c.actuator == actuator) return &c;
    }
    return nullptr;
  }
  static std::string ColumnOf(const Experiment& e, const std::string& on, SignalKind kind = SignalKind::kPosition) {
    const MeasuredSpec* m = Measured(e, on, kind);
    return m && !m->columns.empty() ? m->columns.front() : "";
  }
  static std::string CommandOf(const Experiment& e, const std::string& actuator) {
    const CommandSpec* c = Command(e, actuator);
    return c && !c->columns.empty() ? c->columns.front() : "";
  }
  bool IsUnsure(const std::string& of) const {
    return std::ranges::any_of(unsure_, [&](const auto& text) { return text.find(of) != std::string::npos; });
  }

  Scratch scratch_;
  std::vector<std::string> unsure_;
  std::string text_;
};

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_DRAFT_BENCH_H_

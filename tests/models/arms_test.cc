// The arms: MuJoCo against recursive Newton-Euler, by the twin plants of these rigs (tests/twin/arm), which know no
// MuJoCo.
#include <gtest/gtest.h>

#include "tests/models/rig.h"
#include "tests/twin/arm/simulator.h"

namespace gapscope::testing {
namespace {

constexpr double kDuration_s = 2;
constexpr int kSubsteps = 20;
constexpr double kStepError_rad = 1e-5;  // of the models at 5 ms; at 2.5 ms below 1e-6

double LargestDifferenceFromTwin(twin::ArmRig rig) {
  const ModelPtr m = LoadRig(twin::ArmRigName(rig));
  if (m == nullptr) return INFINITY;
  const auto& links = twin::ArmLinks(rig);
  const double h = m->opt.timestep;
  const int steps = static_cast<int>(std::lround(kDuration_s / h));
  const auto target = [&](int k) {
    std::vector<double> u;
    for (std::size_t j = 0; j < links.size(); ++j) {
      const double sign = j % 2 == 0 ? 1 : -1, more = 0.1 * static_cast<double>(j);
      u.push_back(links[j].home_rad + sign * ChirpAndSteps(k * h, 0.4, 0.3 + more, 3 + more, kDuration_s));
    }
    return u;
  };
  std::vector<double> start;
  for (const auto& link : links) start.push_back(link.home_rad);
  const Motion motion = Drive(*m, start, steps, target);

  twin::ArmSimulator simulator(twin::NominalArm(rig), h / kSubsteps);
  simulator.Place(Eigen::Map<Eigen::VectorXd>(start.data(), static_cast<Eigen::Index>(start.size())),
                  twin::JointVector::Zero(static_cast<Eigen::Index>(start.size())));
  twin::ArmCommands commands(links.size());
  double largest = 0, moved = 0;
  for (int k = 0; k < steps; ++k) {
    for (std::size_t j = 0; j < links.size(); ++j) commands[j].Add(k * h, target(k)[j], 0, 0);
    for (int i = 0; i < kSubsteps; ++i) simulator.Step(commands);
    for (std::size_t j = 0; j < links.size(); ++j) {
      const double q = simulator.q()[static_cast<Eigen::Index>(j)];
      largest = std::fmax(largest, std::abs(q - motion.q[static_cast<std::size_t>(k)][j]));
      moved = std::fmax(moved, std::abs(q - start[j]));
    }
  }
  EXPECT_GT(moved, 0.3);
  return largest;
}

TEST(ArmModelTest, TwoJointsFollowNewtonEuler) {
  EXPECT_LT(LargestDifferenceFromTwin(twin::ArmRig::kArm2), kStepError_rad);
}

TEST(ArmModelTest, SixJointsFollowNewtonEuler) {
  EXPECT_LT(LargestDifferenceFromTwin(twin::ArmRig::kArm6), kStepError_rad);
}

}  // namespace
}  // namespace gapscope::testing

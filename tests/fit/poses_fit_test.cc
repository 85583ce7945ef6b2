// Fits of measured poses: a free symmetric top, and a hinge whose orientation is logged by a sensor mounted askew.
#include <gtest/gtest.h>

#include <cmath>

#include "src/experiment/orientation.h"
#include "src/fit/fit_problem.h"
#include "src/fit/optimizers.h"
#include "tests/experiment/scratch.h"
#include "tests/replay/spinning_top.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPosePeriod_s = 0.004;

class PosesFitTest : public ::testing::Test {
 protected:
  void Load(const std::string& measured) {
    scratch_.Write("robot.xml", SpinningTop::kMjcf);
    rig_.experiment = LoadExperiment(scratch_.Write("experiment.yaml",
                                                    "model: robot.xml\nlog: {time: {column: t, unit: s}}\n" + measured))
                          .value();
    rig_.model = Model::Load(rig_.experiment).value();
  }
  // A log by closed forms: the top, and the arm that turns at 2 rad/s. Orientations are turned by `mount`.
  void Record(const Vector3d& mount) {
    std::string csv = "t,x,y,z,qw,qx,qy,qz,angle,aw,ax,ay,az\n";
    for (int k = 0; k < 251; ++k) {
      const double t = k * kPosePeriod_s, angle = 0.3 + 2 * t;
      const Vector3d p = top_.Marker(t);
      const Quaterniond q = top_.MarkerTurn(t) * SpinningTop::Exp(mount),
                        a = SpinningTop::Exp(angle * Vector3d::UnitZ()) * SpinningTop::Exp(mount);
      for (const double x : {t, p[0], p[1], p[2], q.w(), q.x(), q.y(), q.z(), angle, a.w(), a.x(), a.y(), a.z()}) {
        char number[40];
        std::snprintf(number, sizeof number, "%.13g", x);
        csv += (csv.back() == '\n' ? "" : ",") + std::string(number);
      }
      csv += "\n";
    }
    logs_ = {LoadRecording(rig_.experiment, scratch_.Write("log.csv", csv)).value()};
  }

  Scratch scratch_;
  SpinningTop top_;
  Rig rig_;
  std::vector<Recording> logs_;
  ThreadPool pool_{1};
};

TEST_F(PosesFitTest, TheMountOfASensorIsFoundForEachLog) {
  const Vector3d mount(0.05, -0.12, 0.2);
  Load(
      "measured:\n  - {signal: angle, column: angle, joint: hinge, unit: rad}\n"
      "  - {signal: turn, sensor: arm_turn, columns_of_elements: [aw, ax, ay, az]}\n");
  Record(mount);
  FitProblem problem(*rig_.model, logs_, {.window_s = 0.25, .fit_shift = false}, rig_.Values(), pool_);
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-10});
  // A turn about the hinge's own axis is the angle's zero as well: nothing tells the two apart, but together they are
  // the mount.
  const double angle_zero = problem.layout().Offset(found.point.y, 0, 0);
  const Eigen::AngleAxisd expected(SpinningTop::Exp(angle_zero * Vector3d::UnitZ()) * SpinningTop::Exp(mount));
  for (int e = 0; e < 3; ++e)
    EXPECT_NEAR(problem.layout().Offset(found.point.y, 0, static_cast<std::size_t>(1 + e)),
                expected.angle() * expected.axis()[e], 1e-5)
        << e;
}

const char kPose[] = R"(measured:
  - {signal: place, sensor: place, columns_of_elements: [x, y, z]}
  - {signal: turn, sensor: turn, columns_of_elements: [qw, qx, qy, qz]}
  - {signal: angle, column: angle, joint: hinge, unit: rad}
)";

// Two states of the hinge, then twelve of the body: at the true pose and motion once they are solved.
TEST_F(PosesFitTest, AFreeBodysStatesAreOnTheManifoldOfPoses) {
  Load(kPose);
  Record(Vector3d::Zero());
  FitProblem problem(*rig_.model, logs_, {.window_s = 0.25, .fit_offsets = false, .fit_shift = false}, rig_.Values(),
                     pool_);
  const FitPoint start = problem.Start();
  ASSERT_EQ(start.states[0].size(), 14);
  const double from_log = problem.Evaluate(start, Keep::kCost).cost;
  // Off in all twelve: that costs, and is taken back.
  FitPoint off = start;
  for (auto& state : off.states) state.tail(12) << 0.01, 0.5, 0.01, -0.5, 0.02, 0.2, 0.1, 1, -0.1, 1, 0.2, -1;
  const double displaced = problem.Evaluate(off, Keep::kCost).cost;
  EXPECT_GT(displaced, 100 * from_log);
  ProblemObjective objective(problem);
  Work work;
  const FitPoint back = SolveStates(problem, objective, off, 8, &work);
  EXPECT_LT(problem.Evaluate(back, Keep::kCost).cost, 1.01 * from_log);
  for (const auto& state : back.states) {
    for (Eigen::Index i = 2; i < 14; i += 2) {
      EXPECT_LT(std::abs(state[i]), 1e-3) << i;
      EXPECT_LT(std::abs(state[i + 1]), 0.05) << i;  // a first row's slope is one-sided
    }
  }
}

// About the axis of symmetry nothing tells a turn of the sensor from one of the body: it stays zero.
TEST_F(PosesFitTest, ASensorsMountMovesWhereItsBodyStarts) {
  const Vector3d mount(0.04, 0, -0.03);  // in the marker's frame
  Load(kPose);
  Record(mount);
  FitProblem problem(*rig_.model, logs_, {.window_s = 0.5, .fit_shift = false}, rig_.Values(), pool_);
  const double without = problem.Evaluate(problem.Start(), Keep::kCost).cost;
  const SolveResult found = Solve(problem, problem.Start(), {.tolerance = 1e-10});
  EXPECT_LT(found.cost, 1e-2 * without);
  const Quaterniond marker(0.8, 0, 0.6, 0);
  const Vector3d expected = marker * mount;
  Vector3d offset;
  for (int e = 0; e < 3; ++e)
    offset[e] = problem.layout().Offset(found.point.y, 0, static_cast<std::size_t>(FindMeasured(logs_[0], 3 + e)));
  const Vector3d on_body = marker * offset;
  EXPECT_NEAR(on_body[0], expected[0], 4e-3);
  EXPECT_NEAR(on_body[1], expected[1], 4e-3);
}

}  // namespace
}  // namespace gapscope::testing

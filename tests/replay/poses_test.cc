// Measured orientations and poses, by the closed form of a free symmetric top.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "src/experiment/orientation.h"
#include "src/experiment/recording.h"
#include "tests/model/synthetic.h"
#include "tests/replay/spinning_top.h"

namespace gapscope::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kPeriod_s = 0.004;
constexpr int kRows = 401;

const char kPosesYaml[] = R"(log: {time: {column: t, unit: s}}
measured:
  - {signal: place, sensor: place, columns_of_elements: [x, y, z], unit: mm}
  - {signal: turn, sensor: turn, columns_of_elements: [qw, qx, qy, qz]}
)";

class PosesTest : public ::testing::Test {
 protected:
  // A log of the top's marker, whose orientation is turned by `mount` in its own frame. Signs of quaternions are
  // random.
  std::string Csv(const Vector3d& mount = Vector3d::Zero()) const {
    std::mt19937 random(4);
    std::string csv = "t,x,y,z,qw,qx,qy,qz\n";
    for (int k = 0; k < kRows; ++k) {
      const double t = k * kPeriod_s;
      const Vector3d p = 1000 * top_.Marker(t);
      const Quaterniond q = top_.MarkerTurn(t) * SpinningTop::Exp(mount);
      const double sign = random() % 2 == 0 ? 1 : -1;
      char line[400];
      std::snprintf(line, sizeof line, "%.4f,%.12g,%.12g,%.12g,%.14g,%.14g,%.14g,%.14g\n", t, p[0], p[1], p[2],
                    sign * q.w(), sign * q.x(), sign * q.y(), sign * q.z());
      csv += line;
    }
    return csv;
  }
  void Load(const std::string& yaml, const Vector3d& mount = Vector3d::Zero()) {
    experiment_ = MakeExperiment(scratch_, SpinningTop::kMjcf, yaml);
    model_ = MakeModel(experiment_);
    ASSERT_NE(model_, nullptr);
    auto recording = LoadRecording(experiment_, scratch_.Write("log.csv", Csv(mount)));
    ASSERT_TRUE(recording.ok()) << recording.error().Text();
    recording_ = std::move(recording).value();
  }
  InitialState Truth() const {
    InitialState start = AtRest(*model_);
    const Quaterniond q = top_.Turn(0);
    const double pose[] = {top_.place[0], top_.place[1], top_.place[2], q.w(), q.x(), q.y(), q.z()};
    std::copy(std::begin(pose), std::end(pose), start.qpos.begin());
    for (int i = 0; i < 3; ++i) start.qvel[i] = top_.velocity[i], start.qvel[3 + i] = top_.rate[i];
    return start;
  }

  Scratch scratch_;
  SpinningTop top_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
  Recording recording_;
};

TEST_F(PosesTest, FourColumnsAreThreeSignals) {
  Load(kPosesYaml);
  ASSERT_EQ(recording_.measured.size(), 6u);
  EXPECT_EQ(recording_.measured[3].spec.signal, "turn[0]");
  EXPECT_EQ(recording_.measured[5].spec.signal, "turn[2]");
  EXPECT_EQ(recording_.measured[4].spec.unit, "rad");
  for (std::size_t row = 0; row < recording_.rows(); ++row) {
    const Quaternion q = OrientationAt(&recording_.measured[3], row);
    const Quaterniond expected = top_.MarkerTurn(recording_.time_s[row]);
    ASSERT_NEAR(std::abs(expected.dot(Quaterniond(q[0], q[1], q[2], q[3]))), 1, 1e-12) << row;
    // No jump, though the top makes more than a turn.
    for (std::size_t e = 3; e < 6 && row > 0; ++e)
      ASSERT_LT(std::abs(recording_.measured[e].values[row] - recording_.measured[e].values[row - 1]), 0.2) << row;
  }
}

TEST_F(PosesTest, ThePredictionIsTheClosedForm) {
  constexpr double kTolerance = 1e-8;  // RK4 at 1 ms
  Load(kPosesYaml);
  const InitialState start = Truth();
  const auto predicted = Predict(*model_, recording_, {}, &start);
  for (std::size_t s = 0; s < 6; ++s)
    EXPECT_LT(LargestDifference(predicted[s], recording_.measured[s].values), kTolerance) << s;
}

// predicted - measured = log(conj(measured) predicted), here the same turn at all times.
TEST_F(PosesTest, TheResidualIsTheRotationVectorInTheMeasuredFrame) {
  const Vector3d off(0.4, -1.1, 0.7);
  Load(kPosesYaml, -off);
  const InitialState start = Truth();
  const auto predicted = Predict(*model_, recording_, {}, &start);
  for (std::size_t e = 0; e < 3; ++e) {
    for (std::size_t row = 0; row < recording_.rows(); ++row)
      ASSERT_NEAR(predicted[3 + e][row] - recording_.measured[3 + e].values[row], off[static_cast<int>(e)], 1e-8)
          << row;
  }
}

TEST_F(PosesTest, AMountIsAParameterOfEachNumber) {
  const std::string yaml = std::string(kPosesYaml).insert(std::string(kPosesYaml).rfind('}'), ", mount: [mx, my, mz]") +
                           "parameters:\n  mx: {unit: rad, nominal: 0.4, bounds: [-1, 1]}\n"
                           "  my: {unit: rad, nominal: -0.3, bounds: [-1, 1]}\n"
                           "  mz: {unit: rad, nominal: 0.2, bounds: [-1, 1]}\n";
  Load(yaml, Vector3d(0.4, -0.3, 0.2));
  const InitialState start = Truth();
  const auto predicted = Predict(*model_, recording_, {}, &start);
  for (std::size_t s = 3; s < 6; ++s)
    EXPECT_LT(LargestDifference(predicted[s], recording_.measured[s].values), 1e-8) << s;
  // The body starts where its sensor, so mounted, says.
  const InitialState from_log = InitialStateAt(*model_, recording_, 0, model_->Nominal());
  for (std::size_t i = 3; i < 7; ++i) EXPECT_NEAR(std::abs(from_log.qpos[i]), std::abs(start.qpos[i]), 1e-6) << i;
}

TEST_F(PosesTest, AFreeBodyStartsFromItsMeasuredPose) {
  constexpr double kPlace_m = 1e-5, kTurn = 1e-5, kSpeed = 2e-3;  // of local parabolas of 40 ms
  Load(kPosesYaml);
  ASSERT_EQ(model_->free_starts().size(), 1u);
  for (const std::size_t row : {10u, 137u, 250u, 390u}) {
    const double t = recording_.time_s[row];
    const InitialState start = InitialStateAt(*model_, recording_, row, model_->Nominal());
    const Quaterniond q(start.qpos[3], start.qpos[4], start.qpos[5], start.qpos[6]);
    EXPECT_LT(q.angularDistance(top_.Turn(t)), kTurn) << row;
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(start.qpos[i], top_.Place(t)[i], kPlace_m) << row;
      EXPECT_NEAR(start.qvel[i], top_.velocity[i], kSpeed) << row;
      EXPECT_NEAR(start.qvel[3 + i], top_.Rate(t)[i], kSpeed) << row;
    }
  }
}

// The MJCF's sensors and those that the experiment adds read the same: of the site, and of the body itself.
TEST_F(PosesTest, BodiesAndSitesNeedNoSensorInTheMjcf) {
  Load(Replaced(Replaced(kPosesYaml, "sensor: place", "site: marker"), "sensor: turn", "site: marker"));
  ASSERT_EQ(model_->free_starts().size(), 1u);
  InitialState start = Truth();
  const auto predicted = Predict(*model_, recording_, {}, &start);
  for (std::size_t s = 0; s < 6; ++s)
    EXPECT_LT(LargestDifference(predicted[s], recording_.measured[s].values), 1e-8) << s;
  Load(Replaced(Replaced(kPosesYaml, "sensor: place", "body: top"), "sensor: turn", "body: top"));
  start = Truth();
  const auto of_body = Predict(*model_, recording_, {}, &start);
  for (std::size_t row = 0; row < recording_.rows(); ++row) {
    for (std::size_t i = 0; i < 3; ++i)
      ASSERT_NEAR(of_body[i][row], top_.Place(recording_.time_s[row])[static_cast<int>(i)], 1e-8) << row;
  }
}

TEST_F(PosesTest, OrderOfColumnsMayBeStated) {
  const std::string yaml = Replaced(kPosesYaml, "[qw, qx, qy, qz]", "[qx, qy, qz, qw], order: xyzw");
  Load(yaml);
  const InitialState start = Truth();
  EXPECT_LT(LargestDifference(Predict(*model_, recording_, {}, &start)[3], recording_.measured[3].values), 1e-8);
}

TEST_F(PosesTest, AnOrientationAloneTurnsTheBodyWhereItStands) {
  Load(
      "log: {time: {column: t, unit: s}}\nmeasured:\n  - {signal: turn, sensor: turn, columns_of_elements: [qw, qx, "
      "qy, "
      "qz]}\n");
  const InitialState start = InitialStateAt(*model_, recording_, 137, model_->Nominal());
  EXPECT_LT(Quaterniond(start.qpos[3], start.qpos[4], start.qpos[5], start.qpos[6])
                .angularDistance(top_.Turn(recording_.time_s[137])),
            1e-5);
  EXPECT_EQ(start.qpos[0], 0.5);
  EXPECT_EQ(start.qvel[0], 0);
}

TEST_F(PosesTest, APoseThatIsNotToBeTakenLeavesTheModelsOwn) {
  std::string yaml = Replaced(kPosesYaml, "unit: mm", "unit: mm, start: false");
  Load(Replaced(yaml, "qz]", "qz], start: false"));
  EXPECT_TRUE(model_->free_starts().empty());
  EXPECT_EQ(InitialStateAt(*model_, recording_, 137, model_->Nominal()).qpos[0], 0.5);
}

// What the program says of a broken experiment or log; empty: nothing.
std::string MessageOf(const Scratch& scratch, const std::string& yaml, const std::string& csv) {
  scratch.Write("robot.xml", SpinningTop::kMjcf);
  const auto experiment = LoadExperiment(scratch.Write("experiment.yaml", "model: robot.xml\n" + yaml));
  if (!experiment.ok()) return experiment.error().Text();
  const auto model = Model::Load(experiment.value());
  if (!model.ok()) return model.error().Text();
  const auto recording = LoadRecording(experiment.value(), scratch.Write("log.csv", csv));
  return recording.ok() ? "" : recording.error().Text();
}

TEST_F(PosesTest, ErrorsSayWhatAndWhere) {
  struct Case {
    const char *from, *to;
    std::vector<const char*> says;
  };
  const std::vector<Case> cases = {
      {"[qw, qx, qy, qz]", "[qx, qy, qz]", {"experiment.yaml:5:5:", "another number of elements", "3", "4"}},
      {"[qw, qx, qy, qz]", "[qx, qy, qz], kind: orientation", {"experiment.yaml:5:5:", "needs four columns", "3"}},
      {"columns_of_elements: [qw, qx, qy, qz]",
       "element: 1, column: qx",
       {"experiment.yaml:5:5:", "is an orientation"}},
      {"[x, y, z]", "[qw, qx, qy, qz], kind: sensor", {"experiment.yaml:4:5:", "another number of elements", "4", "3"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, qz], kind: sensor", {"experiment.yaml:5:5:", "is an orientation"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, qz], scale: 2", {"experiment.yaml:5:5:", "'scale'", "means nothing"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, qz], mount: [a]", {"experiment.yaml:5:5:", "'mount'", "3"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, qz], order: zyxw", {"experiment.yaml:5:", "wxyz", "xyzw"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, qu]", {"log.csv:1", "no column 'qu'", "the signal 'turn[0]'"}},
      {"[qw, qx, qy, qz]", "[qw, qx, qy, x]", {"log.csv:2", "no unit quaternion", "order: xyzw"}},
      {"sensor: turn", "sensor: arm_turn, start: true", {"experiment.yaml:5:5:", "'arm' has no free joint", "top"}},
      {"sensor: place", "sensor: gyro, start: true", {"experiment.yaml:4:5:", "no pose", "framepos"}},
      {"columns_of_elements: [x, y, z]", "element: 1, column: y, start: true", {"experiment.yaml:4:5:", "not all of"}},
      {"sensor: turn", "body: tob", {"experiment.yaml:5:5:", "body that the MJCF lacks", "did you mean 'top'?"}},
      {"sensor: place", "site: maker", {"experiment.yaml:4:5:", "site that the MJCF lacks", "'marker'"}},
      {"sensor: place", "sensor: place, body: top", {"experiment.yaml:4:5:", "exactly one of"}},
      {"sensor: place", "body: top, site: tip", {"experiment.yaml:4:5:", "exactly one of"}},
      {"columns_of_elements: [x, y, z]", "column: x", {"experiment.yaml:4:5:", "has several elements"}},
      {"sensor: turn", "body: arm, start: true", {"experiment.yaml:5:5:", "'arm' has no free joint"}},
      {"sensor: turn", "sensor: tern", {"experiment.yaml:5:5:", "that the MJCF lacks", "'turn'"}},
  };
  const std::string good = Replaced(kPosesYaml, "unit: mm", "unit: \"1\"");
  EXPECT_EQ(MessageOf(scratch_, good, Csv()), "");
  for (const Case& broken : cases) {
    const std::string message = MessageOf(scratch_, Replaced(good, broken.from, broken.to), Csv());
    for (const char* part : broken.says)
      EXPECT_NE(message.find(part), std::string::npos) << broken.to << ": '" << part << "' is not in: " << message;
  }
  const std::string held = Replaced(good, "qz]", "qz], start: true") + "hold: [top]\n";
  EXPECT_EQ(MessageOf(scratch_, held, Csv()), "") << "it stands there";
}

}  // namespace
}  // namespace gapscope::testing

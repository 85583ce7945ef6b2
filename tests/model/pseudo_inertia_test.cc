// Ten numbers change a body's inertia: against closed forms, against the 4x4 matrix written out, and beside an MJCF
// with the changed numbers in it.
#include "src/model/pseudo_inertia.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

#include "src/model/apply.h"
#include "src/model/parameter_writer.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr double kSameInertia = 1e-12;

const BodyInertia kLink = {
    .mass_kg = 1.5, .centre_m = {0.1, -0.02, 0.3}, .moments_kg_m2 = {0.03, 0.02, 0.015}, .axes = {0.8, 0.36, 0.48, 0}};

Eigen::Matrix3d Turn(const Quaternion& q) { return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix(); }

// The inertia about the centre of mass, in the body's frame.
Eigen::Matrix3d Central(const BodyInertia& b) {
  return Turn(b.axes) * Eigen::Vector3d(b.moments_kg_m2.data()).asDiagonal() * Turn(b.axes).transpose();
}

// The pseudo-inertia as the paper has it, by way of the inertia about the body's origin.
Eigen::Matrix4d Matrix(const BodyInertia& b) {
  const Eigen::Vector3d c(b.centre_m.data());
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d about_origin = Central(b) + b.mass_kg * (c.dot(c) * one - c * c.transpose());
  Eigen::Matrix4d j;
  j << 0.5 * about_origin.trace() * one - about_origin, b.mass_kg * c, b.mass_kg * c.transpose(), b.mass_kg;
  return j;
}

double Apart(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

TEST(PseudoInertiaTest, AlphaScalesMassAndInertiaTogether) {
  const BodyInertia heavy = Changed(kLink, {0.2});
  EXPECT_NEAR(heavy.mass_kg, std::exp(0.4) * 1.5, kSameInertia);
  EXPECT_LT(Apart(Central(heavy), std::exp(0.4) * Central(kLink)), kSameInertia);
  EXPECT_EQ(heavy.centre_m, kLink.centre_m);
}

TEST(PseudoInertiaTest, TMovesTheCentreOfMassAlone) {
  const BodyInertia moved = Changed(kLink, {0, 0, 0, 0, 0, 0, 0, 0.01, 0.02, -0.05});
  EXPECT_NEAR(moved.centre_m[0], 0.11, kSameInertia);
  EXPECT_NEAR(moved.centre_m[1], 0.0, kSameInertia);
  EXPECT_NEAR(moved.centre_m[2], 0.25, kSameInertia);
  EXPECT_EQ(moved.mass_kg, 1.5);
  EXPECT_LT(Apart(Central(moved), Central(kLink)), kSameInertia);
}

TEST(PseudoInertiaTest, DStretchesABoxAlongItsEdges) {
  const auto box = [](double x, double y, double z) {
    const double m = 2.0 / 12;
    return BodyInertia{.mass_kg = 2, .moments_kg_m2 = {m * (y * y + z * z), m * (x * x + z * z), m * (x * x + y * y)}};
  };
  const BodyInertia stretched = Changed(box(0.3, 0.2, 0.1), {0, std::log(2), std::log(0.5), std::log(3)});
  EXPECT_LT(Apart(Central(stretched), Central(box(0.6, 0.1, 0.3))), kSameInertia);
  EXPECT_EQ(stretched.mass_kg, 2);
}

TEST(PseudoInertiaTest, SPushesPointsAlongTheFirstAxisByTheSecond) {
  // Two points on the y axis: s12 moves them along x by s12 y, s23 does nothing to them.
  const BodyInertia points = {.mass_kg = 2, .moments_kg_m2 = {0.02, 0, 0.02}};  // 1 kg each at y = +-0.1
  const BodyInertia pushed = Changed(points, {0, 0, 0, 0, 0.5, 0.7});
  Eigen::Matrix3d expected;  // at (0.05, 0.1) and (-0.05, -0.1)
  expected << 0.02, -0.01, 0, -0.01, 0.005, 0, 0, 0, 0.025;
  EXPECT_LT(Apart(Central(pushed), expected), kSameInertia);
}

TEST(PseudoInertiaTest, IsTheMatrixOfThePaperWhateverTheNumbers) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> draw;
  for (int k = 0; k < 2000; ++k) {
    PseudoInertia by;
    for (double& number : by) number = draw(random);
    const BodyInertia changed = Changed(kLink, by);
    const auto [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3] = by;
    Eigen::Matrix4d u;
    u << std::exp(d1), s12, s13, t1, 0, std::exp(d2), s23, t2, 0, 0, std::exp(d3), t3, 0, 0, 0, 1;
    u *= std::exp(alpha);
    EXPECT_LT(Apart(Matrix(changed), u * Matrix(kLink) * u.transpose()), kSameInertia) << k;
    // What MuJoCo's compiler asks of it, without a tolerance.
    const auto& [a, b, c] = changed.moments_kg_m2;
    EXPECT_TRUE(a > 0 && b > 0 && c > 0) << k;
    EXPECT_TRUE(a + b >= c && a + c >= b && b + c >= a) << k;
  }
}

TEST(PseudoInertiaTest, ZeroIsTheBodyAsItWas) {
  const BodyInertia rod = {.mass_kg = 1, .moments_kg_m2 = {0.1, 0.1, 0}},
                    ball = {.mass_kg = 1, .moments_kg_m2 = {0.1, 0.1, 0.1}, .axes = kLink.axes};
  for (const BodyInertia& body : {kLink, rod, ball}) {
    const BodyInertia same = Changed(body, {});
    EXPECT_EQ(same.mass_kg, body.mass_kg);
    EXPECT_EQ(same.centre_m, body.centre_m);
    EXPECT_EQ(same.axes, body.axes);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(same.moments_kg_m2[i], body.moments_kg_m2[i], 1e-16);
  }
}

TEST(PseudoInertiaTest, SmallNumbersTurnTheAxesLittle) {
  PseudoInertia little;
  little.fill(1e-4);
  const Vector3 turn = LogRotation(Conjugate(kLink.axes) * Changed(kLink, little).axes);
  EXPECT_GT(std::abs(turn[0]) + std::abs(turn[1]) + std::abs(turn[2]), 1e-6);
  EXPECT_LT(std::abs(turn[0]) + std::abs(turn[1]) + std::abs(turn[2]), 1e-2);
}

// A base on a stand that turns and slides, bodies with MuJoCo's short cuts (frames of inertia and body alike) among
// them. ARM and HAND are their inertials.
constexpr const char* kInertiaRobot = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body name="hub"><joint name="hub" axis="0 0 1" damping="0.02"/>
      HUB
      <site name="mark" pos="0.1 0 0"/>
    </body>
    <body name="arm" pos="1 0 1"><joint name="shoulder" axis="0 1 0" damping="0.02"/>
      <inertial pos="0.2 0.01 0" quat="0.8 0 0.6 0" mass="0.5" diaginertia="0.004 0.003 0.002"/>
      <body name="hand" pos="0.4 0 0"><joint name="wrist" axis="1 0 0" damping="0.01"/>
        HAND
      </body>
    </body>
  </worldbody>
  <actuator><motor name="hub" joint="hub"/><motor name="shoulder" joint="shoulder"/>
    <motor name="wrist" joint="wrist"/></actuator>
</mujoco>)";
constexpr const char* kHub = R"(<inertial pos="0 0 0" mass="0.6" diaginertia="0.001 0.0012 0.0018"/>)";
constexpr const char* kHand = R"(<inertial pos="0 0 0" mass="0.2" diaginertia="0.0002 0.0003 0.0004"/>)";
constexpr const char* kInertiaYaml = R"(commands:
  - {actuator: hub, column: a, unit: N m}
  - {actuator: shoulder, column: b, unit: N m}
  - {actuator: wrist, column: c, unit: N m}
measured:
  - {signal: hub, column: a, joint: hub, unit: rad}
  - {signal: shoulder, column: b, joint: shoulder, unit: rad}
  - {signal: wrist, column: c, joint: wrist, unit: rad}
)";
const std::string kFree = "inertia: [hub, hand]\n";
const PseudoInertia kOne = {0.1, 0.2, -0.1, 0.15, 0.3, -0.2, 0.1, 0.02, -0.03, 0.01},
                    kOther = {-0.2, 0.1, 0.3, -0.15, -0.1, 0.25, 0.3, 0.04, 0.05, -0.02};

std::map<std::string, double> Values(const std::string& body, const PseudoInertia& by) {
  std::map<std::string, double> values;
  for (std::size_t i = 0; i < by.size(); ++i) values[body + "." + kPseudoInertia[i]] = by[i];
  return values;
}

// An <inertial> of a body changed by the matrix of the paper: symmetric, in the body's frame.
std::string Inertial(double mass, const std::vector<double>& moments, const PseudoInertia& by) {
  const BodyInertia body = {.mass_kg = mass, .moments_kg_m2 = {moments[0], moments[1], moments[2]}};
  const auto [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3] = by;
  Eigen::Matrix4d u;
  u << std::exp(d1), s12, s13, t1, 0, std::exp(d2), s23, t2, 0, 0, std::exp(d3), t3, 0, 0, 0, 1;
  const Eigen::Matrix4d j = std::exp(2 * alpha) * u * Matrix(body) * u.transpose();
  const Eigen::Vector3d c = j.block<3, 1>(0, 3) / j(3, 3);
  const Eigen::Matrix3d second = j.block<3, 3>(0, 0) - j(3, 3) * c * c.transpose(),
                        central = second.trace() * Eigen::Matrix3d::Identity() - second;
  char text[400];
  std::snprintf(text, sizeof text,
                "<inertial pos=\"%.17g %.17g %.17g\" mass=\"%.17g\" fullinertia=\"%.17g %.17g %.17g %.17g %.17g "
                "%.17g\"/>",
                c[0], c[1], c[2], j(3, 3), central(0, 0), central(1, 1), central(2, 2), central(0, 1), central(0, 2),
                central(1, 2));
  return text;
}

std::string Robot(const std::string& hub, const std::string& hand) {
  return Replaced(Replaced(kInertiaRobot, "HUB", hub), "HAND", hand);
}

double Commanded(int command, double t) {
  constexpr double kSize[] = {0.02, 1.2, 0.01};
  return Exciting(t, kSize[command]);
}

class PseudoInertiaModelTest : public ::testing::Test {
 protected:
  std::shared_ptr<const Model> Make(const std::string& mjcf, const std::string& yaml) {
    return MakeModel(MakeExperiment(scratch_, mjcf, yaml));
  }
  static std::vector<std::vector<double>> Run(const Model& model, const std::map<std::string, double>& set = {}) {
    return Predict(model, MakeRecording(model.experiment(), 500, 0.002, Commanded), set);
  }
  std::string Message(const std::string& mjcf, const std::string& yaml) {
    scratch_.Write("robot.xml", mjcf);
    const auto experiment =
        LoadExperiment(scratch_.Write("experiment.yaml", std::string("model: robot.xml\n") + kInertiaYaml + yaml));
    if (!experiment.ok()) return experiment.error().Text();
    const auto model = Model::Load(experiment.value());
    return model.ok() ? "" : model.error().Text();
  }
  std::map<std::string, double> Both() {
    std::map<std::string, double> both = Values("hub", kOne);
    both.merge(Values("hand", kOther));
    return both;
  }
  static void ExpectSame(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b,
                         double tolerance) {
    ASSERT_EQ(a.size(), 3u);
    ASSERT_EQ(b.size(), 3u);
    for (std::size_t s = 0; s < 3; ++s) {
      EXPECT_GT(Largest(a[s]), 0.05) << "signal " << s << " moves";
      EXPECT_LE(LargestDifference(a[s], b[s]), tolerance) << "signal " << s;
    }
  }
  Scratch scratch_;
};

TEST_F(PseudoInertiaModelTest, MovesAsAnMjcfWithTheInertiaInIt) {
  const auto freed = Make(Robot(kHub, kHand), kInertiaYaml + kFree);
  ASSERT_NE(freed, nullptr);
  const auto motion = Run(*freed, Both());
  const auto written =
      Make(Robot(Inertial(0.6, {0.001, 0.0012, 0.0018}, kOne), Inertial(0.2, {0.0002, 0.0003, 0.0004}, kOther)),
           kInertiaYaml);
  ASSERT_NE(written, nullptr);
  ExpectSame(motion, Run(*written), kSameInertia);
  const auto as_it_was = Run(*Make(Robot(kHub, kHand), kInertiaYaml));
  EXPECT_GT(LargestDifference(motion[0], as_it_was[0]), 1e-2);
  ExpectSame(Run(*freed), as_it_was, kSameInertia);
}

TEST_F(PseudoInertiaModelTest, ZeroLeavesTheCompiledModel) {
  const auto freed = Make(Robot(kHub, kHand), std::string(kInertiaYaml) + "inertia: [hub, arm, hand]\n");
  ASSERT_NE(freed, nullptr);
  const ModelPtr written(mj_copyModel(nullptr, &freed->compiled()));
  const DataPtr data(mj_makeData(written.get()));
  ASSERT_TRUE(ParameterWriter(*freed, written.get(), data.get()).Write(freed->Nominal(), {}));
  const mjModel &a = freed->compiled(), &b = *written;
  for (int i = 0; i < a.nbody; ++i) {
    EXPECT_EQ(a.body_mass[i], b.body_mass[i]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(a.body_ipos[3 * i + k], b.body_ipos[3 * i + k]);
      EXPECT_NEAR(a.body_inertia[3 * i + k], b.body_inertia[3 * i + k], 1e-17);
    }
    for (int k = 0; k < 4; ++k) EXPECT_EQ(a.body_iquat[4 * i + k], b.body_iquat[4 * i + k]);
  }
  for (int i = 0; i < a.nv; ++i)
    EXPECT_NEAR(a.dof_invweight0[i], b.dof_invweight0[i], kSameInertia * a.dof_invweight0[i]);
}

TEST_F(PseudoInertiaModelTest, AreTunedOnlyWhereLogsKnowThem) {
  const auto freed = Make(Robot(kHub, kHand), kInertiaYaml + kFree);
  ASSERT_NE(freed, nullptr);
  EXPECT_TRUE(freed->FreeParameters().empty());
  ASSERT_EQ(freed->parameters().size(), 20u);
  for (const Parameter& p : freed->parameters()) {
    EXPECT_TRUE(p.if_known) << p.name;
    EXPECT_EQ(p.nominal, 0) << p.name;
    EXPECT_LT(p.low, 0) << p.name;
    EXPECT_EQ(p.high, -p.low) << p.name;
  }
  // What the experiment says of one holds.
  const auto listed = Make(Robot(kHub, kHand), std::string(kInertiaYaml) +
                                                   "inertia: [hub]\nparameters: {hub.alpha: {unit: 1, "
                                                   "nominal: 0.1, bounds: [0, 0.2]}}\n");
  ASSERT_NE(listed, nullptr);
  EXPECT_EQ(listed->FreeParameters().size(), 1u);
  const auto set = Make(Robot(kHub, kHand), std::string(kInertiaYaml) +
                                                "set: {body/hub/pseudo_inertia: [\"0.1\",\"0\",\"0\",\"0\",\"0\",\"0\","
                                                "\"0\",\"0\",\"0\",\"0\"]}\n");
  ASSERT_NE(set, nullptr);
  ExpectSame(Run(*listed), Run(*set), 0);
}

TEST_F(PseudoInertiaModelTest, TheExportedModelMovesAlike) {
  const auto freed = Make(Robot(kHub, kHand), kInertiaYaml + kFree);
  ASSERT_NE(freed, nullptr);
  const auto xml = freed->ToXml(ValuesWith(*freed, Both()), {}, {});
  ASSERT_TRUE(xml.ok()) << xml.error().Text();
  EXPECT_EQ(xml.value().find("simple="), std::string::npos) << "what an older MuJoCo cannot read";
  ExpectSame(Run(*freed, Both()), Run(*Make(xml.value(), kInertiaYaml)), 1e-4);  // six digits
}

TEST_F(PseudoInertiaModelTest, ApplyWritesTheInertialAlone) {
  const std::string mjcf = Robot(kHub, kHand);
  const auto freed = Make(mjcf, std::string(kInertiaYaml) + "inertia: [hub]\n");
  ASSERT_NE(freed, nullptr);
  const auto applied =
      ApplyToMjcf(*freed, ValuesWith(*freed, Values("hub", {0.1, 0, 0, 0, 0, 0, 0, 0.02, 0, 0})),
                  {.out = scratch_.Path("out.xml"), .notes = {{"hub.alpha", "heavier"}, {"hub.t1", "off centre"}}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  EXPECT_EQ(
      applied.value().text,
      Replaced(mjcf, kHub,
               "<!-- gapscope: heavier -->\n      <!-- gapscope: off centre -->\n      <inertial pos=\"0.02 0 0\" "
               "mass=\"0.732842\" diaginertia=\"0.001221403 0.001465683 0.002198525\"/>"));
}

TEST_F(PseudoInertiaModelTest, ApplyTakesAThinPlate) {
  const std::string plate = R"(<inertial pos="0 0 0" mass="0.6" diaginertia="0.0011 0.0009 0.002"/>)";
  const auto freed = Make(Robot(plate, kHand), std::string(kInertiaYaml) + "inertia: [hub]\n");
  ASSERT_NE(freed, nullptr);
  for (const double alpha : {0.1234567, -0.05551, 0.3, 0.77777, 0.012345}) {
    const auto applied = ApplyToMjcf(*freed, ValuesWith(*freed, {{"hub.alpha", alpha}, {"hub.s12", alpha}}),
                                     {.out = scratch_.Path("out.xml"), .notes = {}});
    EXPECT_TRUE(applied.ok()) << applied.error().Text();
  }
}

TEST_F(PseudoInertiaModelTest, ErrorsSayWhatIsAllowed) {
  const std::string ten = "[\"0\",\"0\",\"0\",\"0\",\"0\",\"0\",\"0\",\"0\",\"0\",\"0\"]";
  const std::string massless = Replaced(Robot(kHub, kHand), "<site name", "<body name=\"tag\"/><site name");
  const std::vector<std::array<std::string, 3>> cases = {
      {kInertiaRobot, "set: {body/hub/pseudo_inertia: [\"0\", \"0\"]}\n", "has 10 numbers"},
      {kInertiaRobot, "set: {body/hub/pseudo_inertia: [\"0\", \"0\"]}\n",
       "alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3"},
      {kInertiaRobot, "set: {body/hubb/pseudo_inertia: " + ten + "}\n", "did you mean 'hub'?"},
      {massless, "set: {body/tag/pseudo_inertia: " + ten + "}\n", "has no inertia"},
      {kInertiaRobot, "set:\n  body/hub/mass: 1\n  body/hub/pseudo_inertia: " + ten + "\n", "'body/hub/mass' too"},
      {kInertiaRobot, "inertia: [hub]\nset: {body/hub/ipos: [\"0\", \"0\", \"0\"]}\n", "'body/hub/ipos' too"},
      {kInertiaRobot, "inertia: [hub]\nset: {body/hub/pseudo_inertia: " + ten + "}\n", "is set twice"},
      {kInertiaRobot, "inertia: [hubb]\n", "did you mean 'hub'?"},
      {massless, "inertia: [tag]\n", "has no inertia"},
      {kInertiaRobot, "inertia: [hub, hub]\n", "names the body 'hub' twice"},
      {kInertiaRobot, "inertia: hub\n", "is not a list of bodies"},
  };
  for (const auto& [mjcf, yaml, says] : cases) {
    const std::string message = Message(mjcf == kInertiaRobot ? Robot(kHub, kHand) : mjcf, yaml);
    EXPECT_NE(message.find(says), std::string::npos) << yaml << message;
    EXPECT_NE(message.find("experiment.yaml:"), std::string::npos) << yaml << message;
  }
}

}  // namespace
}  // namespace gapscope::testing

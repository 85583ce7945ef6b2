// Units, signs and scales that the draft finds, against those that made the log.
#include <numbers>

#include "tests/draft/bench.h"

namespace gapscope::testing {
namespace {

constexpr double kDegree = std::numbers::pi / 180, kCount = 2 * std::numbers::pi / 4096;
constexpr double kUnitsKp = 6, kUnitsKd = 0.3;

class UnitsTest : public DraftBench {
 protected:
  // The factor that the draft gives the joint's angle, speed or command; 0: none.
  static double FactorOf(const Experiment& e, SignalKind kind) {
    const MeasuredSpec* m = Measured(e, "hip", kind);
    return m ? m->factor : 0;
  }
  const Motion m_ = Move(0, kUnitsKp, kUnitsKd);
};

TEST_F(UnitsTest, OfTheAngleByASpeedWhoseUnitIsStated) {
  for (const double unit : {1.0, kDegree, 1e-3, kCount}) {
    const Experiment e = Drafted(
        Bars({"hip"}),
        {{"time", m_.time_s}, {"q", Times(m_.angle, 1 / unit)}, {"speed_rpm", Times(m_.speed, 30 / std::numbers::pi)}});
    EXPECT_NEAR(FactorOf(e, SignalKind::kPosition), unit, 1e-9 * unit) << text_;
    EXPECT_NEAR(FactorOf(e, SignalKind::kVelocity), std::numbers::pi / 30, 1e-9);
    EXPECT_FALSE(IsUnsure("unit")) << unit << text_;
  }
}

TEST_F(UnitsTest, OfTheAngleByATargetWhoseUnitIsStated) {
  const Experiment e = Drafted(
      Bars({"hip"}), {{"time", m_.time_s}, {"q", Times(Move(0, 60, 1).angle, 1 / kDegree)}, {"target_rad", m_.target}});
  EXPECT_NEAR(FactorOf(e, SignalKind::kPosition), kDegree, 1e-9) << text_;
  EXPECT_FALSE(IsUnsure("unit")) << text_;
}

TEST_F(UnitsTest, OfAnAngleThatWouldLeaveItsRange) {
  const std::string limited = "range=\"-1 1\" limited=\"true\"";
  Experiment e = Drafted(Bars({"hip"}, "", limited), {{"time", m_.time_s}, {"q", Times(m_.angle, 1 / kDegree)}});
  EXPECT_NEAR(FactorOf(e, SignalKind::kPosition), kDegree, 1e-9) << text_;
  EXPECT_TRUE(IsUnsure("the unit of 'q' is not stated")) << text_;
  e = Drafted(Bars({"hip"}, "", limited), {{"time", m_.time_s}, {"q", m_.angle}});
  EXPECT_EQ(FactorOf(e, SignalKind::kPosition), 1) << text_;
}

TEST_F(UnitsTest, SpeedsFollowTheAngleAndTheirSignIsSaid) {
  const Experiment e =
      Drafted(Bars({"hip"}), {{"time", m_.time_s}, {"q_rad", m_.angle}, {"speed", Times(m_.speed, -1 / kDegree)}});
  EXPECT_NEAR(FactorOf(e, SignalKind::kVelocity), -kDegree, 1e-9) << text_;
  EXPECT_TRUE(IsUnsure("the other sign")) << text_;
}

TEST_F(UnitsTest, APolicysActionIsMappedToATarget) {
  const Motion stiff = Move(0, 60, 1.5);
  const Experiment e =
      Drafted(Bars({"hip"}),
              {{"time", stiff.time_s}, {"action", Times(stiff.target, 1 / 0.25, -0.4 / 0.25)}, {"q_rad", stiff.angle}});
  const CommandSpec* c = Command(e, "hip");
  ASSERT_NE(c, nullptr) << text_;
  EXPECT_NEAR(c->factor, 0.25, 0.05);
  EXPECT_NEAR(c->offset, 0.4, 0.05);
  EXPECT_TRUE(IsUnsure("by regression")) << text_;
  EXPECT_NE(text_.find("offset: "), std::string::npos);
}

TEST_F(UnitsTest, AFamilyHasOneUnit) {
  // The second joint hardly moves: alone it would be in radians.
  const Motion other = Move(1, kUnitsKp, kUnitsKd);
  const Experiment e =
      Drafted(Bars({"hip", "knee"}, "", "range=\"-1 1\" limited=\"true\""),
              {{"time", m_.time_s}, {"q1", Times(m_.angle, 1 / kDegree)}, {"q2", Times(other.angle, 0.01 / kDegree)}});
  ASSERT_NE(Measured(e, "knee", SignalKind::kPosition), nullptr) << text_;
  EXPECT_NEAR(Measured(e, "knee", SignalKind::kPosition)->factor, kDegree, 1e-9) << text_;
}

// Gravity holds the weak servo back: the angle goes 0.7 as far as its target, which is degrees over counts of 1/512.
TEST_F(UnitsTest, ATargetHasItsAnglesUnit) {
  const Motion weak = Move(0, kUnitsKp, kUnitsKd, {.gravity_n_m = 2.6});
  const std::string servo = "<actuator><position name=\"m\" joint=\"hip\" kp=\"6\" kv=\"0.3\"/></actuator>";
  const Experiment e = Drafted(
      Bars({"hip"}, servo),
      {{"time", weak.time_s}, {"target", Times(weak.target, 1 / kDegree)}, {"q_deg", Times(weak.angle, 1 / kDegree)}});
  const CommandSpec* c = Command(e, "m");
  ASSERT_NE(c, nullptr) << text_;
  EXPECT_NEAR(c->factor, kDegree, 1e-9) << text_;
}

TEST_F(UnitsTest, TheMiddleOfASensorsTurnIsTheZeroIfTheRangeSaysSo) {
  const auto counts = [](const std::vector<double>& angle) {
    std::vector<double> raw = Times(angle, 1 / kCount, 2048);
    for (double& v : raw) v = std::round(v);
    return raw;
  };
  const std::string limited = "range=\"-1 1\" limited=\"true\"";
  const std::string servo = "<actuator><position name=\"m\" joint=\"hip\" kp=\"6\" kv=\"0.3\"/></actuator>";
  const std::vector<Named> log = {{"time", m_.time_s}, {"goal", counts(m_.target)}, {"q", counts(m_.angle)}};
  Experiment e = Drafted(Bars({"hip"}, servo, limited), log);
  ASSERT_NE(Measured(e, "hip", SignalKind::kPosition), nullptr) << text_;
  EXPECT_NEAR(Measured(e, "hip", SignalKind::kPosition)->offset, -std::numbers::pi, 1e-4) << text_;
  ASSERT_NE(Command(e, "m"), nullptr);
  EXPECT_NEAR(Command(e, "m")->offset, -std::numbers::pi, 1e-4) << text_;
  EXPECT_TRUE(IsUnsure("half a turn")) << text_;
  e = Drafted(Bars({"hip"}, servo, limited), {{"time", m_.time_s}, {"q_rad", Times(m_.angle, 1, 1.2)}});
  ASSERT_NE(Measured(e, "hip", SignalKind::kPosition), nullptr) << text_;
  EXPECT_EQ(Measured(e, "hip", SignalKind::kPosition)->offset, 0);
  EXPECT_TRUE(IsUnsure("'q_rad' leaves its joint's range")) << text_;
}

// The input of a motor with a gear of 2, the torque at its joint, and both with the other sign.
TEST_F(UnitsTest, OfATorqueCommandByTheTorqueThatTheMotionTakes) {
  const std::string motor = "<actuator><motor name=\"m\" joint=\"hip\" gear=\"2\"/></actuator>";
  for (const auto& [raw_per_torque, factor] : {std::pair{0.5, 1.0}, {1, 0.5}, {-0.5, -1}, {-1, -0.5}}) {
    const Experiment e = Drafted(Bars({"hip"}, motor),
                                 {{"time", m_.time_s}, {"u", Times(m_.torque, raw_per_torque)}, {"q_rad", m_.angle}});
    const CommandSpec* c = Command(e, "m");
    ASSERT_NE(c, nullptr) << text_;
    EXPECT_NEAR(c->factor, factor, 1e-9) << text_;
    EXPECT_EQ(IsUnsure("by the torque that the motion takes"), factor != 1) << text_;
    EXPECT_FALSE(IsUnsure("is not stated")) << text_;
  }
}

TEST_F(UnitsTest, TimeInMicroAndMilliseconds) {
  for (const auto& [unit, factor] : {std::pair{"us", 1e6}, {"ms", 1e3}, {"s", 1.0}}) {
    const Experiment e = Drafted(Bars({"hip"}), {{"stamp", Times(m_.time_s, factor)}, {"q", m_.angle}});
    EXPECT_EQ(e.timeline.time_unit, unit) << text_;
  }
}

}  // namespace
}  // namespace gapscope::testing

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

TEST_F(UnitsTest, TimeInMicroAndMilliseconds) {
  for (const auto& [unit, factor] : {std::pair{"us", 1e6}, {"ms", 1e3}, {"s", 1.0}}) {
    const Experiment e = Drafted(Bars({"hip"}), {{"stamp", Times(m_.time_s, factor)}, {"q", m_.angle}});
    EXPECT_EQ(e.timeline.time_unit, unit) << text_;
  }
}

}  // namespace
}  // namespace gapscope::testing

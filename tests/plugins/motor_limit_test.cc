// The torque-speed curve, traced through all four quadrants.
#include <cmath>

#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

constexpr double kLimitRounding = 1e-12;
constexpr double kHuge = 1e6;  // a request that every limit cuts

// The torque that is left of a huge request, over speeds on both sides and both directions of torque.
template <class Motoring, class Generating>
void Trace(const Rig& rig, double fastest, Motoring motoring, Generating generating) {
  const ModelPtr m = rig.Compile();
  ASSERT_TRUE(m);
  const DataPtr d(mj_makeData(m.get()));
  for (int k = -200; k <= 200; ++k) {
    const double speed = fastest * k / 200 + 1e-9;  // zero belongs to both
    for (const double sign : {-1.0, 1.0}) {
      const double expected = sign * (sign * speed > 0 ? motoring(std::abs(speed)) : generating(std::abs(speed)));
      const double torque = TorqueAt(m.get(), d.get(), 0, speed, {sign * kHuge});
      ASSERT_NEAR(torque, expected, kLimitRounding * (1 + std::abs(expected))) << "speed " << speed << " sign " << sign;
      // What is below the limit passes.
      ASSERT_NEAR(TorqueAt(m.get(), d.get(), 0, speed, {0.5 * expected}), 0.5 * expected, kLimitRounding);
    }
  }
}

TEST(MotorLimitTest, RatedPeakNoLoad) {
  const Rig rig{.config = {{"law", "torque"},
                           {"peak_torque_n_m", "3"},
                           {"rated_speed_rad_per_s", "4"},
                           {"no_load_speed_rad_per_s", "10"},
                           {"generating_factor", "1.2"}}};
  Trace(rig, 15, [](double w) { return w <= 4 ? 3 : w >= 10 ? 0 : 3 * (10 - w) / 6; }, [](double) { return 3.6; });
}

TEST(MotorLimitTest, ConstantPowerOnBothSides) {
  const Rig rig{
      .config = {{"law", "torque"}, {"torque_limit_n_m", "2"}, {"power_w", "8"}, {"generating_power_w", "12"}}};
  Trace(rig, 15, [](double w) { return std::min(2.0, 8 / w); }, [](double w) { return std::min(2.0, 12 / w); });
}

TEST(MotorLimitTest, PowerLeavesGeneratingAloneByDefault) {
  const Rig rig{.config = {{"law", "torque"}, {"torque_limit_n_m", "2"}, {"power_w", "8"}}};
  Trace(rig, 15, [](double w) { return std::min(2.0, 8 / w); }, [](double) { return 2.0; });
}

const std::vector<double> kSpeed = {0, 2, 5, 9, 12}, kTorque = {3, 2.9, 2.2, 0.7, 0}, kBrake = {3.5, 3.5, 3.1, 2, 1};

double LinearTable(const std::vector<double>& torque, double w) {
  for (std::size_t i = 0; i + 1 < kSpeed.size(); ++i) {
    if (w <= kSpeed[i + 1])
      return torque[i] + (torque[i + 1] - torque[i]) * (w - kSpeed[i]) / (kSpeed[i + 1] - kSpeed[i]);
  }
  return torque.back();
}

Rig Table(const std::string& interpolation) {
  return {.config = {{"law", "torque"},
                     {"speed_table", "0 2 5 9 12"},
                     {"torque_table", "3 2.9 2.2 0.7 0"},
                     {"generating_torque_table", "3.5 3.5 3.1 2 1"},
                     {"table_interpolation", interpolation}}};
}

TEST(MotorLimitTest, LinearTable) {
  Trace(
      Table("linear"), 14, [](double w) { return LinearTable(kTorque, w); },
      [](double w) { return LinearTable(kBrake, w); });
}

TEST(MotorLimitTest, CubicTableMeetsThePointsAndIsMonotone) {
  const ModelPtr m = Table("cubic").Compile();
  const DataPtr d(mj_makeData(m.get()));
  for (std::size_t i = 1; i < kSpeed.size(); ++i) {
    EXPECT_NEAR(TorqueAt(m.get(), d.get(), 0, kSpeed[i], {kHuge}), kTorque[i], kLimitRounding);
    EXPECT_NEAR(TorqueAt(m.get(), d.get(), 0, -kSpeed[i], {-kHuge}), -kTorque[i], kLimitRounding);
    EXPECT_NEAR(TorqueAt(m.get(), d.get(), 0, -kSpeed[i], {kHuge}), kBrake[i], kLimitRounding);
  }
  double last = 4;
  for (double w = 0.01; w < 13; w += 0.01) {
    const double torque = TorqueAt(m.get(), d.get(), 0, w, {kHuge});
    ASSERT_LE(torque, last + kLimitRounding) << w;
    ASSERT_NEAR(torque, LinearTable(kTorque, w), 0.25) << w;
    last = torque;
  }
}

TEST(MotorLimitTest, CubicReproducesAStraightLine) {
  const Rig rig{.config = {{"law", "torque"},
                           {"speed_table", "0 1 5 10"},
                           {"torque_table", "10 9 5 0"},
                           {"table_interpolation", "cubic"},
                           {"generating_factor", "0.5"}}};
  Trace(rig, 12, [](double w) { return std::max(0.0, 10 - w); }, [](double) { return 5.0; });
}

// MuJoCo's own parallelogram: the line of a voltage drive at its ceiling is the trapeze with rated speed zero.
TEST(MotorLimitTest, TrapezeWithoutPlateauIsTheVoltageLine) {
  const Rig curve{.config = {{"law", "torque"}, {"peak_torque_n_m", "2.5"}, {"no_load_speed_rad_per_s", "20"}}};
  const Rig native{.native = "<dcmotor joint='joint' motorconst='0.5' resistance='2'/>"};
  const ModelPtr c = curve.Compile(), n = native.Compile();
  const DataPtr a(mj_makeData(c.get())), b(mj_makeData(n.get()));
  for (double w = 0.1; w < 20; w += 0.37) {
    EXPECT_NEAR(TorqueAt(c.get(), a.get(), 0, w, {kHuge}), TorqueAt(n.get(), b.get(), 0, w, {10}), 1e-9);
  }
}

}  // namespace
}  // namespace gapscope::testing

// Methods on logs whose truth is a closed form or an integration of the test's own.
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/identify/bench.h"

namespace gapscope {
namespace {

using testing::Bench;
using testing::ExpectRecovered;
using testing::LoadBench;

constexpr double kPi = std::numbers::pi;

class ClosedFormTest : public ::testing::Test {
 protected:
  // A log of one row per `dt`; `row` gives the columns after the time.
  std::string Write(const std::string& header, double duration, double dt,
                    const std::function<std::string(double)>& row) {
    std::string text = "time_s," + header + "\n";
    for (int k = 0; k * dt <= duration + 1e-9; ++k) text += std::to_string(k * dt) + "," + row(k * dt) + "\n";
    return scratch_.Write("log" + std::to_string(count_++) + ".csv", text);
  }
  static std::string Join(std::initializer_list<double> values) {
    std::string text;
    char number[32];
    for (const double v : values) {
      std::snprintf(number, sizeof number, "%s%.9g", text.empty() ? "" : ",", v);
      text += number;
    }
    return text;
  }
  testing::Scratch scratch_;
  int count_ = 0;
};

// A pendulum under viscous and dry friction, integrated with steps of 0.05 ms, turning points found exactly enough by
// their size; 2048 counts and a little noise.
struct FreeSwing {
  double hz = 1.7, damping = 0.0, dry = 0.0, rest = 0.0, start = 1.0;
};
std::vector<double> Integrate(const FreeSwing& s, double duration, double dt) {
  const double h = 5e-5, w2 = std::pow(2 * kPi * s.hz, 2);
  std::vector<double> out;
  double q = s.start, v = 0, next = 0;
  for (long k = 0; k * h <= duration + 1e-9; ++k) {
    if (k * h >= next - 1e-12) out.push_back(q), next += dt;
    const double pull = -w2 * std::sin(q - s.rest);
    if (v == 0 && std::abs(pull) <= s.dry) continue;
    const double sign = v != 0 ? (v > 0 ? 1 : -1) : (pull > 0 ? 1 : -1);
    const double a = pull - s.damping * v - s.dry * sign, w = v + h * a;
    const double middle = 0.5 * (v + w);
    const double mid_q = q + 0.5 * h * v, a2 = -w2 * std::sin(mid_q - s.rest) - s.damping * middle - s.dry * sign;
    const double nv = v + h * a2;
    q += h * middle;
    v = v * nv < 0 ? 0 : nv;
  }
  return out;
}

class RingDownTest : public ClosedFormTest {
 protected:
  Bench Swing(const FreeSwing& s, unsigned seed, double duration = 6) {
    const std::vector<double> angle = Integrate(s, duration, 0.002);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal(0, 5e-4);
    std::size_t k = 0;
    const double count = 2 * kPi / 2048;
    return LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad", duration, 0.002, [&](double) {
                       return Join({0, 0, count * std::round((angle[k++] + normal(random)) / count)});
                     })});
  }
};

TEST_F(RingDownTest, RecoversViscousAndDryFrictionTogether) {
  const FreeSwing truth{.hz = 1.7, .damping = 0.35, .dry = 0.4, .rest = 0.02, .start = 1.2};
  const Bench bench = Swing(truth, 1);
  const auto result = IdentifyRingDown(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_NEAR(result.value().Find("frequency")->value, truth.hz, 0.001 * truth.hz);
  ExpectRecovered(result.value(), "damping_rate", truth.damping, 0.3);
  ExpectRecovered(result.value(), "dry_rate", truth.dry, 0.3);
  ExpectRecovered(result.value(), "rest", truth.rest, 0.5);
  EXPECT_NE(result.value().remarks.front().find("both stand clear"), std::string::npos);
}

TEST_F(RingDownTest, TellsAnExponentialFromALinearEnvelope) {
  const auto viscous = IdentifyRingDown(Swing({.hz = 1.7, .damping = 0.5, .start = 0.9}, 2).input(), {});
  ASSERT_TRUE(viscous.ok());
  EXPECT_NE(viscous.value().remarks.front().find("exponential"), std::string::npos) << viscous.value().remarks.front();
  EXPECT_GT(viscous.value().Find("rmse_dry_only")->value, 3 * viscous.value().Find("rmse_viscous_only")->value);
  const auto dry = IdentifyRingDown(Swing({.hz = 1.7, .dry = 1.5, .start = 0.9}, 3).input(), {});
  ASSERT_TRUE(dry.ok());
  EXPECT_NE(dry.value().remarks.front().find("linear"), std::string::npos) << dry.value().remarks.front();
  EXPECT_GT(dry.value().Find("rmse_viscous_only")->value, 3 * dry.value().Find("rmse_dry_only")->value);
  // Half a swing from A costs the energy 2 A dry: 2 dry / w^2 of a small amplitude, A / sin A times that of a large
  // one.
  const auto& peaks = dry.value().tables.front().rows;
  ASSERT_GE(peaks.size(), 4u);
  const double middle = 0.5 * (peaks[0][2] + peaks[3][2]),
               step = 2 * 1.5 / std::pow(2 * kPi * 1.7, 2) * middle / std::sin(middle);
  EXPECT_NEAR((peaks[0][2] - peaks[3][2]) / 3, step, 0.05 * step);
}

TEST_F(RingDownTest, RefusesWhatDoesNotSwing) {
  const Bench still = LoadBench(
      "qube", {Write("voltage_v,arm_rad,pendulum_rad", 3, 0.002, [](double) { return std::string("0,0,0.003"); })});
  const auto result = IdentifyRingDown(still.input(), {});
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().what.find("does not swing"), std::string::npos);
  const Bench driven = LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad", 3, 0.002,
                                                [](double t) { return Join({1 + t, 0, std::sin(9 * t)}); })});
  EXPECT_FALSE(IdentifyRingDown(driven.input(), {}).ok());
}

// current = V / 8.4 + 0.03 + noise, rotor held; forced through the origin the positive half would give less, the
// negative half more than 8.4.
TEST_F(ClosedFormTest, ResistanceAndOffset) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 0.01);
  const auto volts = [](double t) { return -3 + 0.5 * std::floor(t / 0.5); };
  const Bench bench = LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad,current_a", 6.499, 0.002, [&](double t) {
                                  return Join({volts(t), 0.003068, 0, volts(t) / 8.4 + 0.03 + normal(random)});
                                })});
  const auto result = IdentifyResistance(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  for (const char* name : {"resistance", "resistance_positive", "resistance_negative"})
    ExpectRecovered(result.value(), name, 8.4, 0.1);
  ExpectRecovered(result.value(), "current_offset", 0.03, 0.2);
  EXPECT_EQ(result.value().rows, 13u);

  const Bench rest = LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad,current_a", 2, 0.002,
                                              [&](double) { return Join({0, 0.003068, 0, 0.03 + normal(random)}); })});
  const auto offset = IdentifyCurrentOffset(rest.input(), {});
  ASSERT_TRUE(offset.ok());
  ExpectRecovered(offset.value(), "current_offset", 0.03, 0.2);

  // A turning rotor is refused: back-EMF would count as resistance.
  const Bench turning =
      LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad,current_a", 6.499, 0.002,
                               [&](double t) { return Join({volts(t), 3 * t, 0, volts(t) / 8.4}); })});
  EXPECT_FALSE(IdentifyResistance(turning.input(), {}).ok());
  // So is a log without the column, with the nearest name.
  const auto misnamed = IdentifyCurrentOffset(rest.input(), {.current_column = "curent_a"});
  ASSERT_FALSE(misnamed.ok());
  EXPECT_NE(misnamed.error().Text().find("current_a"), std::string::npos);
}

// First-order motor: steady speed where kt (V - km w) / R = b w + Tc sign(w); the speed settles exponentially after
// each step.
TEST_F(ClosedFormTest, SteadySpeedsGiveTheEquivalentDamping) {
  const double r = 8.4, k = 0.042, b = 1.5e-4 + 6e-5, tc = 6e-4, inertia = 2.5e-5;
  const double rate = (b + k * k / r) / inertia;
  const auto volts = [](double t) { return -7 + std::floor(t / 2); };
  double w = 0, q = 0;
  const double dt = 0.002;
  const double count = 2 * kPi / 2048;
  const Bench bench = LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad", 29.99, dt, [&](double t) {
                                  const std::string row = Join({volts(t + 1e-9), count * std::round(q / count), 0});
                                  const double drive = k * volts(t + 1e-9) / r, sign = drive > 0 ? 1 : -1;
                                  const double settled =
                                      std::abs(drive) > tc ? (drive - tc * sign) / (b + k * k / r) : 0;
                                  const double next = settled + (w - settled) * std::exp(-rate * dt);
                                  q += settled * dt + (w - settled) * (1 - std::exp(-rate * dt)) / rate;
                                  w = next;
                                  return row;
                                })});
  const auto result = IdentifySteady(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  // The drive's torque is evaluated at the measured speed, so the equivalent damping is b itself.
  EXPECT_NEAR(result.value().Find("viscous")->value, b, 0.02 * b);
  EXPECT_NEAR(result.value().Find("coulomb")->value, tc, 0.1 * tc);
  EXPECT_NEAR(result.value().Find("speed_per_command_positive")->value /
                  result.value().Find("speed_per_command_negative")->value,
              1, 0.01);
  const auto fixed = IdentifySteady(bench.input(), {.coulomb_n_m = tc});
  ASSERT_TRUE(fixed.ok());
  EXPECT_NEAR(fixed.value().Find("viscous")->value, b, 0.02 * b);
  // Steps too short to settle are refused.
  const Bench hasty = LoadBench("qube", {Write("voltage_v,arm_rad,pendulum_rad", 5, dt,
                                               [&](double t) { return Join({std::floor(10 * t), 100 * t * t, 0}); })});
  EXPECT_FALSE(IdentifySteady(hasty.input(), {}).ok());
}

TEST_F(ClosedFormTest, TorqueConstantAndItsDroop) {
  std::mt19937_64 random(6);
  std::normal_distribution<double> normal;
  const double kt = 0.115 * 25, peak = 40;
  const auto log = [&](double loss) {
    return Write("target_rad,position_rad,torque_n_m,current_a", 20, 0.002, [&](double t) {
      const double i = peak * std::sin(2 * kPi * 0.7 * t) * std::min(1.0, t / 15);
      return Join({0, 0, kt * i * (1 - loss * std::abs(i) / peak) + 0.2 * normal(random), i + 0.01 * normal(random)});
    });
  };
  const auto bent = IdentifyTorqueConstant(LoadBench("joint", {log(0.2)}).input(), {});
  ASSERT_TRUE(bent.ok()) << bent.error().Text();
  ExpectRecovered(bent.value(), "kt", kt, 0.03);
  EXPECT_NEAR(bent.value().Find("loss_at_peak")->value, 0.2, 0.01);
  EXPECT_TRUE(bent.value().remarks.empty());
  const auto straight = IdentifyTorqueConstant(LoadBench("joint", {log(0)}).input(), {});
  ASSERT_TRUE(straight.ok());
  ExpectRecovered(straight.value(), "kt_straight", kt, 0.03);
  ASSERT_FALSE(straight.value().remarks.empty());
  EXPECT_NE(straight.value().remarks.front().find("no bend"), std::string::npos);
}

// The servo asks for far more than min(80 N m, 300 W / speed) while it is swept.
TEST_F(ClosedFormTest, TnCurveFindsPeakAndPower) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0, 0.3);
  const double dt = 0.002, amplitude = 2, w = 2 * kPi * 0.75;
  const Bench bench = LoadBench("joint", {Write("target_rad,position_rad,torque_n_m", 20, dt, [&](double t) {
                                  const double q = amplitude * std::sin(w * t), v = amplitude * w * std::cos(w * t);
                                  const double demand = 157.1451 * 1.5 * (v > 0 ? 1 : -1),
                                               limit = std::min(80.0, 300 / std::max(std::abs(v), 1e-6));
                                  const double target = q + (demand + 7.0729 * v) / 157.1451;
                                  return Join({target, q, std::clamp(demand, -limit, limit) + normal(random)});
                                })});
  const auto result =
      IdentifyTnCurve(bench.input(), {.rated_torque_n_m = 47.84, .rated_speed_rad_per_s = 116 * 2 * kPi / 60});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_NEAR(result.value().Find("peak_torque")->value, 80, 0.02 * 80);
  EXPECT_NEAR(result.value().Find("power")->value, 300, 0.02 * 300);
  // The data sheet's row read right: 47.84 N m at 116 rpm are 581 W.
  EXPECT_NEAR(result.value().Find("rated_power")->value, 581.1, 0.1);
}

// As above, and above 9 rad/s a line to nothing at 12 rad/s: the drive runs out of voltage.
TEST_F(ClosedFormTest, TnCurveFindsTheSpeedWithoutLoad) {
  std::mt19937_64 random(8);
  std::normal_distribution<double> normal(0, 0.1);
  const double dt = 0.002, amplitude = 2.4, w = 2 * kPi * 0.75;
  const Bench bench = LoadBench(
      "joint", {Write("target_rad,position_rad,torque_n_m", 40, dt, [&](double t) {
        const double q = amplitude * std::sin(w * t), v = amplitude * w * std::cos(w * t),
                     size = std::max(std::abs(v), 1e-6);
        const double demand = 157.1451 * 1.5 * (v > 0 ? 1 : -1),
                     limit = std::min({80.0, 300 / size, 300 / 9.0 * (12 - size) / 3});
        return Join({q + (demand + 7.0729 * v) / 157.1451, q, std::clamp(demand, -limit, limit) + normal(random)});
      })});
  const auto result = IdentifyTnCurve(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_NEAR(result.value().Find("peak_torque")->value, 80, 0.02 * 80);
  EXPECT_NEAR(result.value().Find("power")->value, 300, 0.03 * 300);
  ASSERT_NE(result.value().Find("no_load_speed"), nullptr);
  EXPECT_NEAR(result.value().Find("no_load_speed")->value, 12, 0.2);
}

// A command that clips in firmware; the clipped rows must not pull the gain down.
TEST_F(ClosedFormTest, PdLeavesClippedRowsOut) {
  const double kp = 60, kd = 3, limit = 12;
  const Bench bench =
      LoadBench("joint", {Write("target_rad,position_rad,torque_n_m", 20, 0.002, [&](double t) {
                  const double phase = 2 * kPi * (0.1 * t + 0.1 * t * t), target = 0.5 * std::sin(phase);
                  const double q = 0.45 * std::sin(phase - 0.3 * std::min(1.0, t)),
                               v = (0.45 * std::sin(2 * kPi * (0.1 * (t + 1e-5) + 0.1 * (t + 1e-5) * (t + 1e-5)) -
                                                    0.3 * std::min(1.0, t)) -
                                    q) /
                                   1e-5;
                  return Join({target, q, std::clamp(kp * (target - q) - kd * v, -limit, limit)});
                })});
  // The target of a row acts after it: continuous here, so half a step of "delay" of the target alone remains; the
  // gains hardly see it.
  const auto result = IdentifyPd(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_NEAR(result.value().Find("kp")->value, kp, 0.02 * kp);
  EXPECT_NEAR(result.value().Find("kd")->value, kd, 0.05 * kd);
  bool said = false;
  for (const auto& remark : result.value().remarks) said = said || remark.find("left out") != std::string::npos;
  EXPECT_TRUE(said);
}

}  // namespace
}  // namespace gapscope

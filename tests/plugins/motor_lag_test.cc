// Lag and sag, the stages with a state that the engine integrates.
#include <array>
#include <cmath>

#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

constexpr double kStep = 0.001;

Rig Lagged(const std::string& integrator, double h = kStep) {
  return {.config = {{"law", "torque"}},
          .live = {{"time_constant_s", "0"}},
          .option = "timestep='" + std::to_string(h) + "' integrator='" + integrator + "'",
          .first = "actdim='1'"};
}

struct LagCase {
  std::string integrator;
  double time_constant;
};

class MotorLagTest : public ::testing::TestWithParam<LagCase> {};

// The torque at the start of each step after a step of the request: 1 - e^(-t/tc) for tc >= h; below, the state lags
// with h and the output is blended, w (1 - e^(-t/h)) + (1 - w), w = tc/h. RK4 has its own e^z for one step.
TEST_P(MotorLagTest, StepResponseIsTheClosedForm) {
  const auto& [integrator, constant] = GetParam();
  const ModelPtr m = Lagged(integrator).Compile();
  ASSERT_TRUE(m);
  const DataPtr d(mj_makeData(m.get()));
  Live(m.get(), "time_constant_s") = constant;
  d->ctrl[0] = 0;
  mj_step(m.get(), d.get());
  d->ctrl[0] = 2;
  const double weight = std::min(1.0, constant / kStep), z = -kStep / std::max(constant, kStep);
  const double decay = integrator == "RK4" ? 1 + z * (1 + z / 2 * (1 + z / 3 * (1 + z / 4))) : std::exp(z);
  for (int k = 0; k < 40; ++k) {
    mj_step(m.get(), d.get());
    const double torque = StateOf(m.get(), d.get()).estimate_n_m();
    EXPECT_NEAR(torque, 2 * (1 - weight * std::pow(decay, k)), 1e-12) << "step " << k;
    if (constant > kStep) {
      EXPECT_NEAR(torque, 2 * (1 - std::exp(k * z)), 2e-5);
    }
  }
  EXPECT_TRUE(std::isfinite(d->qpos[0]));
}

std::vector<LagCase> LagCases() {
  std::vector<LagCase> cases;
  for (const char* integrator : {"Euler", "implicitfast", "discrete", "RK4"}) {
    for (const double constant : {0.0, 1e-9, 0.5 * kStep, kStep, 5 * kStep}) cases.push_back({integrator, constant});
  }
  return cases;
}
INSTANTIATE_TEST_SUITE_P(All, MotorLagTest, ::testing::ValuesIn(LagCases()));

// exp(A t) x0 of a 2 x 2 system with a constant input, by Taylor series of a short time, squared up.
std::array<double, 2> Linear(std::array<std::array<double, 2>, 2> a, std::array<double, 2> b, double t) {
  std::array<double, 2> x{0, 0};
  const int pieces = 4000;
  const double h = t / pieces;
  for (int k = 0; k < pieces; ++k) {
    std::array<double, 2> term = x, sum = x;
    for (int n = 1; n < 12; ++n) {
      const std::array<double, 2> f{a[0][0] * term[0] + a[0][1] * term[1] + (n == 1 ? b[0] : 0),
                                    a[1][0] * term[0] + a[1][1] * term[1] + (n == 1 ? b[1] : 0)};
      term = {f[0] * h / n, f[1] * h / n};
      sum = {sum[0] + term[0], sum[1] + term[1]};
    }
    x = sum;
  }
  return x;
}

constexpr double kKt = 0.5, kResistance = 2, kTimeConstant = 0.01, kDamping = 0.1, kVoltage = 10;

Rig Electric(const std::string& integrator, double h) {
  return {
      .config = {{"law", "voltage"}, {"kt", "0.5"}, {"ke", "0.5"}, {"resistance", "2"}, {"time_constant_s", "0.01"}},
      .option = "timestep='" + std::to_string(h) + "' integrator='" + integrator + "'",
      .first = "actdim='1'",
      .damping = kDamping};
}

double SpeedAfter(const mjModel* m, double time) {
  const DataPtr d(mj_makeData(m));
  mj_forward(m, d.get());  // primes: at rest, no current
  StateOf(m, d.get()).MarkPrimed();
  d->ctrl[0] = kVoltage;
  for (int k = 0; k < std::lround(time / m->opt.timestep); ++k) mj_step(m, d.get());
  return d->qvel[0];
}

// The lag on the whole request, back-EMF included, is the winding L di/dt = V - R i - ke w with L = R tc.
TEST(MotorLagElectricTest, WindingWithBackEmfIsExactUnderRk4) {
  const auto exact =
      Linear({{{-kDamping / kInertia, 1 / kInertia}, {-kKt * kKt / kResistance / kTimeConstant, -1 / kTimeConstant}}},
             {0, kKt * kVoltage / kResistance / kTimeConstant}, 0.1);
  EXPECT_NEAR(SpeedAfter(Electric("RK4", 0.001).Compile().get(), 0.1), exact[0], 1e-6 * exact[0]);
  EXPECT_NEAR(SpeedAfter(Electric("Euler", 0.0001).Compile().get(), 0.1), exact[0], 1e-2 * exact[0]);
}

TEST(MotorLagElectricTest, ConvergesToTheNativeDcMotor) {
  // The native one acts with the current at the step's end, this one with that at its start: they meet as h.
  double difference[2];
  for (const int i : {0, 1}) {
    const double h = i == 0 ? 0.0002 : 0.0001;
    const Rig native{.option = "timestep='" + std::to_string(h) + "'",
                     .damping = kDamping,
                     .native = "<dcmotor joint='joint' motorconst='0.5' resistance='2' inductance='0.02'/>"};
    const ModelPtr n = native.Compile();
    const DataPtr d(mj_makeData(n.get()));
    d->ctrl[0] = kVoltage;
    for (int k = 0; k < std::lround(0.1 / h); ++k) mj_step(n.get(), d.get());
    difference[i] = std::abs(SpeedAfter(Electric("Euler", h).Compile().get(), 0.1) - d->qvel[0]) / d->qvel[0];
  }
  EXPECT_LT(difference[0], 3e-3);
  EXPECT_NEAR(difference[1] / difference[0], 0.5, 0.02);
}

TEST(MotorLagTwoPolesTest, StepResponseIsTheClosedForm) {
  const Rig rig{.config = {{"law", "torque"}, {"time_constant_s", "0.02"}, {"second_time_constant_s", "0.005"}},
                .option = "timestep='0.001' integrator='RK4'",
                .first = "actdim='2'"};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  mj_step(m.get(), d.get());
  d->ctrl[0] = 1;
  for (int k = 0; k < 100; ++k) {
    mj_step(m.get(), d.get());
    const double t = 0.001 * k;
    const double exact = 1 - (0.02 * std::exp(-t / 0.02) - 0.005 * std::exp(-t / 0.005)) / 0.015;
    EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), exact, 1e-5);
  }
}

TEST(MotorLagPrimingTest, StartsAtThePresentRequestUnlessTheHostSaysOtherwise) {
  for (const std::string integrator : {"Euler", "RK4"}) {
    const ModelPtr m = Lagged(integrator).Compile();
    const DataPtr d(mj_makeData(m.get()));
    Live(m.get(), "time_constant_s") = 0.05;
    d->ctrl[0] = 1.5;
    for (int k = 0; k < 5; ++k) {
      mj_step(m.get(), d.get());
      EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), 1.5, 1e-12) << integrator;
    }
    mj_resetData(m.get(), d.get());
    StateOf(m.get(), d.get()).MarkPrimed();
    d->act[0] = 0.25;
    d->ctrl[0] = 1.5;
    mj_step(m.get(), d.get());
    EXPECT_EQ(StateOf(m.get(), d.get()).estimate_n_m(), 0.25) << integrator;
  }
}

// --- sag -----------------------------------------------------------------------------------------------------------

TEST(MotorSagTest, CeilingFallsUnderLoadAndRecovers) {
  const double limit = 2, fraction = 0.3, constant = 0.05;
  const Rig rig{.config = {{"law", "torque"},
                           {"torque_limit_n_m", "2"},
                           {"sag_fraction", "0.3"},
                           {"sag_time_constant_s", "0.05"}},
                .option = "timestep='0.001' integrator='RK4'",
                .first = "actdim='1'"};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  mj_step(m.get(), d.get());
  // Saturated: s' = ((1 - f s) - s)/T, so s = (1 - e^(-(1+f) t/T))/(1+f).
  d->ctrl[0] = 100;
  double s = 0;
  for (int k = 0; k < 200; ++k) {
    mj_step(m.get(), d.get());
    s = (1 - std::exp(-(1 + fraction) * 0.001 * k / constant)) / (1 + fraction);
    EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), limit * (1 - fraction * s), 1e-7) << k;
  }
  // Unloaded: it recovers.
  d->ctrl[0] = 0;
  mj_step(m.get(), d.get());
  const double loaded = d->act[0];
  for (int k = 0; k < 100; ++k) mj_step(m.get(), d.get());
  EXPECT_NEAR(d->act[0], loaded * std::exp(-0.1 / constant), 1e-7);
}

TEST(MotorSagTest, StartsAtRestUnderThePresentLoad) {
  const Rig rig{.config = {{"law", "torque"}, {"torque_limit_n_m", "2"}, {"sag_fraction", "0.3"}},
                .first = "actdim='1'"};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  d->ctrl[0] = 100;
  for (int k = 0; k < 50; ++k) {
    mj_step(m.get(), d.get());
    EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), 2 * (1 - 0.3 / 1.3), 1e-12);
  }
}

TEST(MotorSagTest, SupplyOfADutyServoSags) {
  const Rig rig{.config = {{"law", "duty"},
                           {"duty_gain", "1000"},
                           {"supply_v", "12"},
                           {"kt", "0.4"},
                           {"ke", "0"},
                           {"resistance", "4"},
                           {"sag_fraction", "0.5"},
                           {"sag_time_constant_s", "0.1"}},
                .first = "actdim='1'"};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  d->ctrl[0] = 1e3;
  for (int k = 0; k < 3; ++k) mj_step(m.get(), d.get());
  EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), 0.4 * 12 / 4 * (1 - 0.5 / 1.5), 1e-12);
}

}  // namespace
}  // namespace gapscope::testing

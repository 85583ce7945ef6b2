// Delays of the command and of the servo's own loop against exact solutions and MuJoCo's native delay.
#include <cmath>

#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

constexpr double kExact = 1e-6;  // rad, asked for of a fractional delay
constexpr double kDelayRounding = 1e-12;

// --- command delay -------------------------------------------------------------------------------------------------

double Command(int k) { return std::sin(0.02 * k) + 0.3 * std::sin(0.11 * k); }

// An inertia under a torque that is held for h and shifted by delay: exact, segment by segment.
double ExactInertia(double time, double delay, double h) {
  double q = 0, v = 0, t = 0;
  // Breaks at k h + delay; the command before the log is the first one.
  for (int k = 0;; ++k) {
    const double end = std::min(time, k * h + delay), torque = Command(std::max(0, k - 1));
    const double dt = end - t;
    if (dt > 0) {
      q += v * dt + 0.5 * torque / kInertia * dt * dt;
      v += torque / kInertia * dt;
      t = end;
    }
    if (t >= time) return q;
  }
}

// Replays `steps` of Command; `substeps` of them per command, unevenly when `uneven`.
double Replay(mjModel* m, double delay, double h, int steps, bool uneven = false) {
  Live(m, "command_delay_s") = 0;
  const DataPtr d(mj_makeData(m));
  Live(m, "command_delay_s") = delay;
  for (int k = 0; k < steps; ++k) {
    d->ctrl[0] = Command(k);
    if (uneven) {
      for (const double share : {0.3, 0.7}) {
        m->opt.timestep = share * h;
        mj_step(m, d.get());
      }
    } else {
      mj_step(m, d.get());
    }
  }
  return d->qpos[0];
}

Rig Delayed(const std::string& integrator) {
  return {.config = {{"law", "torque"}, {"max_delay_s", "0.03"}, {"min_timestep_s", "0.0003"}},
          .live = {{"command_delay_s", "0"}},
          .option = "timestep='0.001' integrator='" + integrator + "'"};
}

TEST(MotorDelayTest, FractionalCommandDelayIsTheExactShift) {
  const ModelPtr m = Delayed("RK4").Compile();
  const int steps = 500;
  for (const double delay : {0.0, 0.00025, 0.0009, 0.001, 0.0015, 0.00333, 0.01, 0.0247}) {
    m->opt.timestep = 0.001;
    EXPECT_NEAR(Replay(m.get(), delay, 0.001, steps), ExactInertia(steps * 0.001, delay, 0.001), kExact) << delay;
    EXPECT_NEAR(Replay(m.get(), delay, 0.001, steps, true), ExactInertia(steps * 0.001, delay, 0.001), kExact)
        << delay << " uneven steps";
  }
}

TEST(MotorDelayTest, TheLongestDelaysOfTheEffectsFitIntoTheDefaultHistory) {
  const Rig rig{.config = {{"law", "torque"}}, .live = {{"command_delay_s", "0"}}, .option = "timestep='0.001'"};
  const ModelPtr m = rig.Compile();
  constexpr double kHalfStep = 0.0005;  // as a host may refine the model's own
  m->opt.timestep = kHalfStep;
  m->opt.integrator = mjINT_RK4;
  const int steps = 800;
  EXPECT_NEAR(Replay(m.get(), 0.1204, kHalfStep, steps), ExactInertia(steps * kHalfStep, 0.1204, kHalfStep), kExact);
}

TEST(MotorDelayTest, WholeStepsEqualTheNativeDelay) {
  // Not RK4: there the native buffer is read at each stage's time, so that one step mixes two commands.
  for (const std::string integrator : {"Euler", "implicitfast"}) {
    const Rig plugin = Delayed(integrator);
    Rig native{.option = plugin.option, .native = "<motor joint='joint' delay='0.007' nsample='8' interp='zoh'/>"};
    const ModelPtr m = plugin.Compile(), n = native.Compile();
    ASSERT_TRUE(m && n);
    Live(m.get(), "command_delay_s") = 0.007;
    const DataPtr a(mj_makeData(m.get())), b(mj_makeData(n.get()));
    for (int k = 0; k < 400; ++k) {
      // The native buffer starts at zero, so the log does too.
      a->ctrl[0] = b->ctrl[0] = k == 0 ? 0 : Command(k);
      mj_step(m.get(), a.get());
      mj_step(n.get(), b.get());
      ASSERT_NEAR(a->qpos[0], b->qpos[0], kDelayRounding) << integrator << " step " << k;
    }
  }
}

TEST(MotorDelayTest, ResponseIsContinuousAndGradientNeverFlat) {
  const ModelPtr m = Delayed("Euler").Compile();
  const double d = 2.5e-5;
  double before = Replay(m.get(), 0, 0.001, 200);
  double last_slope = 0;
  for (int i = 1; i < 120; ++i) {
    const double q = Replay(m.get(), i * d, 0.001, 200), slope = (q - before) / d;
    EXPECT_LT(slope, -0.1) << i * d;  // the joint is accelerating: later is less
    if (i > 1) {
      EXPECT_NEAR(slope, last_slope, 0.02 * std::abs(last_slope)) << i * d;
    }
    before = q, last_slope = slope;
  }
}

TEST(MotorDelayTest, HistoryPushedByTheHostIsTheStart) {
  const ModelPtr m = Delayed("RK4").Compile();
  const double delay = 0.0047, h = 0.001;
  const int start = 100, steps = 60;
  // The whole log, keeping the state at `start`; then a window from there.
  Live(m.get(), "command_delay_s") = delay;
  const DataPtr whole(mj_makeData(m.get())), window(mj_makeData(m.get()));
  double q0 = 0, v0 = 0;
  for (int k = 0; k < start + steps; ++k) {
    if (k == start) q0 = whole->qpos[0], v0 = whole->qvel[0];
    whole->ctrl[0] = Command(k);
    mj_step(m.get(), whole.get());
  }
  mj_resetData(m.get(), window.get());
  plugins::MotorState state = StateOf(m.get(), window.get());
  plugins::History history = state.history();
  for (int k = start - 10; k < start; ++k) {
    const double ctrl = Command(k);
    history.Push((k - start) * h, 0, 0, &ctrl);
  }
  window->qpos[0] = q0, window->qvel[0] = v0;
  for (int k = start; k < start + steps; ++k) {
    window->ctrl[0] = Command(k);
    mj_step(m.get(), window.get());
  }
  EXPECT_NEAR(window->qpos[0], whole->qpos[0], kDelayRounding);
}

// --- delay in the servo's loop -------------------------------------------------------------------------------------

// Step response of I q'' = [kp (u - q) - kd q'](t - D) from rest, exactly: the series of Laplace terms
// (-1)^n kp (kp + kd s)^n e^{-s (n+1) D} / (I^{n+1} s^{2n+3}), of which those with (n+1) D < t have begun.
double ExactServo(double t, double kp, double kd, double delay) {
  double q = 0;
  for (int n = 0; (n + 1) * delay < t; ++n) {
    const double x = t - (n + 1) * delay;
    for (int k = 0; k <= n; ++k) {
      const double log_term = std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1) +
                              (n - k + 1) * std::log(kp) + k * std::log(kd) - (n + 1) * std::log(kInertia) +
                              (2 * n + 2 - k) * std::log(x) - std::lgamma(2 * n + 3 - k);
      q += (n % 2 ? -1 : 1) * std::exp(log_term);
    }
  }
  return q;
}

class MotorLoopDelayTest : public ::testing::TestWithParam<double> {};

TEST_P(MotorLoopDelayTest, StepResponseIsExact) {
  const double delay = GetParam(), h = 1e-4, kp = 157.0, kd = 7.0;
  const Rig rig{.config = {{"law", "position"}, {"kp", "157"}, {"kd", "7"}},
                .live = {{"torque_delay_s", "0"}},
                .option = "timestep='0.0001' integrator='RK4'"};
  const ModelPtr m = rig.Compile();
  Live(m.get(), "torque_delay_s") = delay;
  const DataPtr d(mj_makeData(m.get()));
  // At rest until the step at t = 0, which is step 200.
  double largest = 0;
  for (int k = -200; k < 600; ++k) {
    d->ctrl[0] = k < 0 ? 0 : 0.1;
    mj_step(m.get(), d.get());
    const double t = (k + 1) * h;
    if (t > 0) largest = std::max(largest, std::abs(d->qpos[0] - 0.1 * ExactServo(t, kp, kd, delay)));
  }
  EXPECT_GT(d->qpos[0], 0.03);
  EXPECT_LT(largest, kExact) << "delay " << delay;
}

INSTANTIATE_TEST_SUITE_P(Delays, MotorLoopDelayTest, ::testing::Values(0.003, 0.00305, 0.01001, 0.02));

// A joint that coasts at constant speed: the delayed law knows the angle exactly, also below a step and in RK4's
// stages.
TEST(MotorDelayTest, CoastingAngleIsExactBelowAStep) {
  for (const std::string integrator : {"Euler", "RK4"}) {
    const Rig rig{.config = {{"law", "position"}, {"kp", "1e-9"}},
                  .live = {{"torque_delay_s", "0.0004"}},
                  .option = "timestep='0.001' integrator='" + integrator + "'"};
    const ModelPtr m = rig.Compile();
    const DataPtr d(mj_makeData(m.get()));
    d->qvel[0] = 2;
    for (int k = 0; k < 20; ++k) {
      mj_forward(m.get(), d.get());
      EXPECT_NEAR(d->qfrc_actuator[0], -1e-9 * (d->qpos[0] - 2 * 0.0004), 1e-17) << integrator << " " << k;
      mj_step(m.get(), d.get());
    }
  }
}

TEST(MotorDelayTest, LiveDelayBeyondTheBufferIsClamped) {
  const ModelPtr m = Delayed("RK4").Compile();
  EXPECT_EQ(Replay(m.get(), 5.0, 0.001, 100), Replay(m.get(), 0.03, 0.001, 100));
  EXPECT_EQ(Replay(m.get(), -1.0, 0.001, 100), Replay(m.get(), 0, 0.001, 100));
}

// The ring with uneven times, full and wrapped, against a plain sum.
TEST(MotorHistoryTest, MeanAndMotionAfterWrapping) {
  const int capacity = 5;
  std::vector<double> buffer(plugins::History::Size(capacity, 2), 0.0);
  ASSERT_EQ(plugins::History::Capacity(static_cast<int>(buffer.size()), 2), capacity);
  plugins::History history(buffer.data(), capacity, 2);
  const auto cubic = [](double t) { return plugins::Motion{t * t * t - t, 3 * t * t - 1}; };
  double t = 0;
  std::vector<double> times;
  for (int k = 0; k < 13; ++k) {
    const double ctrl[] = {static_cast<double>(k), -2.0 * k};
    history.Open(t, cubic(t).q, cubic(t).qdot, ctrl);
    times.push_back(t);
    if (k < 12) history.Close();
    if (k < 12) t += 0.01 + 0.002 * (k % 3);
  }
  EXPECT_EQ(history.count(), capacity);
  for (double delay = 0; delay < 0.05; delay += 0.0007) {
    const plugins::Motion m = history.MotionAt(delay, t, cubic(t), 0.01);
    EXPECT_NEAR(m.q, cubic(t - delay).q, 1e-12);
    EXPECT_NEAR(m.qdot, cubic(t - delay).qdot, 0.014 * 0.014 / 8 * 6 + 1e-12);  // a straight line's error, qdot''' = 6
    double mean[2], sum = 0;
    const double step = 0.013;
    history.MeanCommand(delay, step, mean);
    const int pieces = 20000;
    for (int i = 0; i < pieces; ++i) {
      const double at = t - delay + step * (i + 0.5) / pieces;
      int k = 12;
      while (times[k] > at) --k;
      sum += std::max(k, 12 - capacity);
    }
    EXPECT_NEAR(mean[0], sum / pieces, 2e-4);
    EXPECT_NEAR(mean[1], -2 * mean[0], 1e-12);
  }
  // Time set back: the undone future is forgotten.
  const double zero[] = {0, 0};
  history.Open(times[9], 0, 0, zero);
  EXPECT_EQ(history.count(), 2);
}

}  // namespace
}  // namespace gapscope::testing

// A motor with every stage on: gradients, threads, resets, states, copies, and no allocation while stepping.
#include <malloc.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <thread>

#include "tests/plugins/motor_testing.h"

namespace {
std::atomic<long> g_allocations{0};
}  // namespace

// Counts what C++ code asks for, the plugin's included; the engine's own requests come through mju_user_malloc, and
// mallinfo2 sees what anything else keeps.
void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#pragma GCC diagnostic pop

namespace gapscope::testing {
namespace {

// All stages act: a fast, saturated, reversing motion. Driving and driven-back torques meet at standstill: a jump
// there would be seen a whole step late or not, and no difference quotient of a trajectory is smooth across that.
Rig Everything(const std::string& integrator = "Euler") {
  return {.config = {{"law", "position"}, {"inputs", "target velocity feedforward enable"}, {"max_delay_s", "0.03"}},
          .live = {{"kp", "60"},
                   {"kd", "4"},
                   {"command_delay_s", "0.0041"},
                   {"torque_delay_s", "0.0027"},
                   {"time_constant_s", "0.004"},
                   {"second_time_constant_s", "0.0015"},
                   {"dead_zone", "0.3"},
                   {"torque_limit_n_m", "5"},
                   {"power_w", "11"},
                   {"generating_power_w", "18"},
                   {"peak_torque_n_m", "6"},
                   {"rated_speed_rad_per_s", "1"},
                   {"no_load_speed_rad_per_s", "7"},
                   {"generating_factor", "1"},
                   {"sag_fraction", "0.2"},
                   {"sag_time_constant_s", "0.05"},
                   {"droop_at_peak", "0.1"},
                   {"droop_reference_n_m", "9"},
                   {"asymmetry", "0.05"},
                   {"efficiency_drive", "0.85"},
                   {"efficiency_backdrive", "0.85"}},
          .option = "timestep='0.001' integrator='" + integrator + "'",
          .first = "actdim='3'",
          .actuators = 4,
          .damping = 0.3};
}

void Drive(mjData* d, int k) {
  d->ctrl[0] = 0.8 * std::sin(0.012 * k) + 0.4 * std::sin(0.0031 * k * std::sqrt(k + 1.0));
  d->ctrl[1] = 0.2 * std::cos(0.012 * k);
  d->ctrl[2] = 0.1;
  d->ctrl[3] = 1;
}

std::vector<double> Simulate(const mjModel* m, mjData* d, int from, int to) {
  std::vector<double> q;
  for (int k = from; k < to; ++k) {
    Drive(d, k);
    mj_step(m, d);
    q.push_back(d->qpos[0]);
  }
  return q;
}

std::vector<double> Fresh(const mjModel* m, int steps) {
  const DataPtr d(mj_makeData(m));
  return Simulate(m, d.get(), 0, steps);
}

double Rms(const std::vector<double>& a, const std::vector<double>& b, double scale) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::pow((a[i] - b[i]) / scale, 2);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(MotorStateTest, TrajectoryHasAGradientInEveryLiveParameter) {
  const Rig rig = Everything();
  const ModelPtr m = rig.Compile();
  ASSERT_TRUE(m);
  std::vector<double> base = Fresh(m.get(), 800);
  for (const auto& [key, text] : rig.live) {
    if (key.starts_with("generating")) continue;
    const double value = Live(m.get(), key), step = 1e-4 * value;
    const auto slope = [&](double by) {
      Live(m.get(), key) = value + by;
      const std::vector<double> moved = Fresh(m.get(), 800);
      Live(m.get(), key) = value;
      return Rms(moved, base, by);
    };
    // Non-zero, and the same to either side and at a tenth of the step.
    const double right = slope(step), left = slope(-step), fine = slope(0.1 * step);
    EXPECT_GT(right * value, 1e-6) << key;
    EXPECT_NEAR(left / right, 1, 0.05) << key;
    EXPECT_NEAR(fine / right, 1, 0.05) << key;
  }
  // What holds only while braking, where it holds.
  Live(m.get(), "generating_factor") = 0.7;
  Live(m.get(), "generating_power_w") = 6;
  base = Fresh(m.get(), 800);
  for (const std::string key : {"generating_factor", "generating_power_w"}) {
    const double value = Live(m.get(), key);
    Live(m.get(), key) = value * (1 + 1e-4);
    EXPECT_GT(Rms(Fresh(m.get(), 800), base, 1e-4), 1e-6) << key;
    Live(m.get(), key) = value;
  }
}

TEST(MotorStateTest, ElectricalParametersHaveGradients) {
  const Rig rig{.config = {{"law", "duty"}},
                .live = {{"duty_gain", "3"},
                         {"duty_damping", "0.1"},
                         {"duty_limit", "0.6"},
                         {"supply_v", "12"},
                         {"kt", "1"},
                         {"ke", "1"},
                         {"resistance", "4"},
                         {"gear", "1.1"},
                         {"dead_zone", "0.05"}},
                .damping = 0.1};
  const ModelPtr m = rig.Compile();
  const auto run = [&] {
    const DataPtr d(mj_makeData(m.get()));
    std::vector<double> q;
    for (int k = 0; k < 2000; ++k) {
      d->ctrl[0] = k % 1000 < 500 ? 0.3 : -0.3;
      mj_step(m.get(), d.get());
      q.push_back(d->qpos[0]);
    }
    return q;
  };
  const std::vector<double> base = run();
  for (const auto& [key, text] : rig.live) {
    const double value = Live(m.get(), key);
    Live(m.get(), key) = value * (1 + 1e-5);
    EXPECT_GT(Rms(run(), base, 1e-5), 1e-4) << key;
    Live(m.get(), key) = value;
  }
}

TEST(MotorStateTest, SmoothInTheDelaysAcrossWholeSteps) {
  for (const std::string key : {"command_delay_s", "torque_delay_s"}) {
    // Smooth stages only, so that the delay's own smoothness shows.
    Rig rig{.config = {{"law", "position"}, {"max_delay_s", "0.03"}},
            .live = {{"kp", "10"}, {"kd", "1"}, {key, "0"}},
            .damping = 0.3};
    const ModelPtr m = rig.Compile();
    const DataPtr d(mj_makeData(m.get()));
    const auto end = [&](double delay) {
      mj_resetData(m.get(), d.get());
      Live(m.get(), key) = delay;
      for (int k = 0; k < 300; ++k) {
        d->ctrl[0] = std::sin(0.02 * k);
        mj_step(m.get(), d.get());
      }
      return d->qpos[0];
    };
    const double by = 5e-5;
    double last_slope = 0;
    for (int i = 0; i < 100; ++i) {
      const double slope = (end((i + 1) * by) - end(i * by)) / by;
      EXPECT_GT(std::abs(slope), 1e-3) << key << " " << i * by;
      if (i > 0) {
        EXPECT_NEAR(slope, last_slope, 0.03 * std::abs(last_slope) + 0.01) << key << " " << i * by;
      }
      last_slope = slope;
    }
  }
}

TEST(MotorStateTest, ResetRepeatsBitForBit) {
  for (const std::string integrator : {"Euler", "implicitfast", "RK4"}) {
    const ModelPtr m = Everything(integrator).Compile();
    const DataPtr d(mj_makeData(m.get()));
    const std::vector<double> first = Simulate(m.get(), d.get(), 0, 500);
    mj_resetData(m.get(), d.get());
    EXPECT_EQ(Simulate(m.get(), d.get(), 0, 500), first) << integrator;
    EXPECT_EQ(Fresh(m.get(), 500), first) << integrator;
  }
}

TEST(MotorStateTest, SetStateMidRunRepeatsBitForBit) {
  for (const std::string integrator : {"Euler", "implicitfast", "RK4"}) {
    const ModelPtr m = Everything(integrator).Compile();
    const DataPtr d(mj_makeData(m.get())), other(mj_makeData(m.get()));
    Simulate(m.get(), d.get(), 0, 300);
    std::vector<double> state(mj_stateSize(m.get(), mjSTATE_INTEGRATION));
    mj_getState(m.get(), d.get(), state.data(), mjSTATE_INTEGRATION);
    const std::vector<double> rest = Simulate(m.get(), d.get(), 300, 600);
    mj_setState(m.get(), d.get(), state.data(), mjSTATE_INTEGRATION);
    EXPECT_EQ(Simulate(m.get(), d.get(), 300, 600), rest) << integrator;
    // In another mjData that has been elsewhere; with a forward call too many on the way.
    Simulate(m.get(), other.get(), 0, 77);
    mj_setState(m.get(), other.get(), state.data(), mjSTATE_INTEGRATION);
    Drive(other.get(), 300);
    mj_forward(m.get(), other.get());
    EXPECT_EQ(Simulate(m.get(), other.get(), 300, 600), rest) << integrator;
  }
}

TEST(MotorStateTest, CopiedDataGoesOnAlike) {
  const ModelPtr m = Everything().Compile();
  const DataPtr d(mj_makeData(m.get()));
  Simulate(m.get(), d.get(), 0, 300);
  const DataPtr copy(mj_copyData(nullptr, m.get(), d.get()));
  EXPECT_EQ(Simulate(m.get(), d.get(), 300, 500), Simulate(m.get(), copy.get(), 300, 500));
}

TEST(MotorStateTest, TwoThreadsDoNotDisturbEachOther) {
  const ModelPtr m = Everything().Compile();
  const std::vector<double> alone = Fresh(m.get(), 1000);
  std::vector<double> results[2];
  {
    std::jthread a([&] { results[0] = Fresh(m.get(), 1000); });
    std::jthread b([&] { results[1] = Fresh(m.get(), 1000); });
  }
  EXPECT_EQ(results[0], alone);
  EXPECT_EQ(results[1], alone);
}

TEST(MotorStateTest, NoAllocationWhileStepping) {
  const ModelPtr m = Everything("RK4").Compile();
  long before = g_allocations;
  const DataPtr d(mj_makeData(m.get()));
  EXPECT_GT(g_allocations - before, 0) << "the plugin's own allocation was not seen: this test would prove nothing";
  Drive(d.get(), 0);
  mj_step(m.get(), d.get());
  mju_user_malloc = +[](size_t size) {
    ++g_allocations;
    return std::aligned_alloc(64, (size + 63) / 64 * 64);
  };
  before = g_allocations;
  const std::size_t heap = mallinfo2().uordblks;
  for (int k = 0; k < 1000; ++k) {
    Drive(d.get(), k);
    mj_step(m.get(), d.get());
  }
  mju_user_malloc = nullptr;
  EXPECT_EQ(g_allocations - before, 0);
  EXPECT_EQ(mallinfo2().uordblks, heap);
}

TEST(MotorStateTest, InverseDynamicsDoesNotAskActuators) {
  const ModelPtr m = Everything().Compile();
  const DataPtr d(mj_makeData(m.get()));
  Simulate(m.get(), d.get(), 0, 100);
  Drive(d.get(), 100);
  mj_forward(m.get(), d.get());
  const double torque = d->qfrc_actuator[0];
  std::vector<double> state(d->plugin_state, d->plugin_state + m->npluginstate);
  mj_inverse(m.get(), d.get());
  EXPECT_NEAR(d->qfrc_inverse[0], torque, 1e-9);
  EXPECT_EQ(std::vector<double>(d->plugin_state, d->plugin_state + m->npluginstate), state);
}

TEST(MotorStateTest, NeutralKeepsNoHistory) {
  const ModelPtr neutral = Rig{.config = {{"law", "torque"}}}.Compile();
  EXPECT_EQ(neutral->npluginstate, plugins::MotorState::kSlots);
  EXPECT_EQ(neutral->na, 0);
}

}  // namespace
}  // namespace gapscope::testing

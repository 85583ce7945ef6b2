// After the first run, a run allocates nothing: neither through operator new nor through malloc, ours or MuJoCo's.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <new>

#include "tests/model/synthetic.h"
#include "tests/models/rig_facts.h"
#include "tests/replay/count_new.h"
#include "tests/replay/spinning_top.h"

namespace gapscope::testing {
namespace {

TEST(AllocationTest, RunAllocatesNothing) {
  for (const char* rig : {"joint", "qube", "xl330"}) {
    Experiment experiment = ShippedExperiment(rig);
    const std::string unit = "N m/" + experiment.commands.front().unit;
    experiment.candidates = {{.name = "own",
                              .joint = FactsOfRig(rig).joints.front(),
                              .torque = "size * max(sin(angle), cos(5 * time)) * command",
                              .parameters = {{.key = "size", .unit = unit, .low = 0, .high = 1, .trials = {0.1}}}}};
    const auto base = MakeModel(experiment);
    std::vector<std::string> texts = {"command_delay", "coulomb_friction", "stribeck_friction", "actuator_lag",
                                      "sensor_delay"};
    if (std::string(rig) == "xl330") texts = {"load_friction", "torque_delay", "sensor_delay"};
    texts.emplace_back("own");
    const auto uses = ParseEffects(texts, *base->rig());
    ASSERT_TRUE(uses.ok()) << uses.error().Text();
    const auto model = MakeModel(experiment, uses.value());
    const Recording recording = MakeRecording(
        experiment, 200, 0.002, [](int c, double t) { return c == 0 ? Exciting(t, 0.3) : 1.0; },
        FactsOfRig(rig).log_values);
    std::vector<double> values = model->Nominal();
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (model->parameters()[i].name.find("delay_s") != std::string::npos) values[i] = 0.0031;
    }
    Simulator simulator(*model, 0);
    std::vector<double> predicted(recording.rows() * recording.measured.size());
    const InitialState start = AtRest(*model);
    ASSERT_TRUE(simulator.SetParameters(values, recording));
    (void)simulator.Run(recording, {0, recording.rows()}, start, predicted);
    // The engine's own requests count too.
    mju_user_malloc = +[](size_t size) { return ::operator new(size, std::align_val_t(64)); };
    // mj_resetData asks for scratch of its own, whoever calls it: that is not ours to avoid.
    const ModelPtr plain(mj_copyModel(nullptr, &simulator.mujoco_model()));
    const DataPtr data(mj_makeData(plain.get()));
    const long before_reset = NewsSoFar();
    mj_resetData(plain.get(), data.get());
    const long of_a_reset = NewsSoFar() - before_reset;
    const long before = NewsSoFar();
    for (int i = 0; i < 5; ++i)
      (void)simulator.Run(recording, {static_cast<std::size_t>(10 * i), recording.rows()}, start, predicted);
    mju_user_malloc = nullptr;
    // One before a run and two to see what was commanded before the log.
    constexpr long kResets = 3;
    EXPECT_EQ(NewsSoFar() - before, 5 * kResets * of_a_reset) << rig;
    EXPECT_LE(of_a_reset, 2) << rig;
  }
  const long before = NewsSoFar();
  ::operator delete(::operator new(64));
  EXPECT_GT(NewsSoFar(), before) << "the counter counts";
}

// Poses are compared in place.
TEST(AllocationTest, AMeasuredPoseAllocatesNothing) {
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch, SpinningTop::kMjcf, R"(measured:
  - {signal: place, sensor: place, columns_of_elements: [x, y, z]}
  - {signal: turn, sensor: turn, columns_of_elements: [qw, qx, qy, qz]}
)");
  const auto model = MakeModel(experiment);
  ASSERT_NE(model, nullptr);
  const Recording recording = MakeRecording(experiment, 200, 0.002, [](int, double) { return 0.0; });
  Simulator simulator(*model, 0);
  std::vector<double> predicted(recording.rows() * recording.measured.size());
  const InitialState start = AtRest(*model);
  ASSERT_TRUE(simulator.SetParameters(model->Nominal(), recording));
  const auto news = [&](std::size_t rows) {
    const long before = NewsSoFar();
    (void)simulator.Run(recording, {0, rows}, start, predicted);
    return NewsSoFar() - before;
  };
  news(200);
  EXPECT_EQ(news(200), news(20)) << "none a row";
}

}  // namespace
}  // namespace gapscope::testing

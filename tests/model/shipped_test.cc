// Every shipped experiment builds, and its nominal parameters write back the numbers of its MJCF.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "src/model/fields.h"
#include "src/model/parameter_writer.h"
#include "tests/model/synthetic.h"
#include "tests/models/rig_facts.h"

namespace gapscope::testing {
namespace {

double At(const mjModel& m, const FieldSlot& slot) {
  const char* base = slot.in_options ? reinterpret_cast<const char*>(&m.opt) : static_cast<const char*>(m.buffer);
  return *reinterpret_cast<const mjtNum*>(base + slot.offset);
}

class ShippedTest : public ::testing::TestWithParam<std::string> {};

TEST_P(ShippedTest, BuildsAndReproducesItsMjcf) {
  const std::string rig = GetParam();
  const Experiment experiment = ShippedExperiment(rig);
  const auto model = MakeModel(experiment);
  ASSERT_NE(model, nullptr);
  EXPECT_EQ(model->parameters().size(), experiment.parameters.size());
  const ModelPtr written(mj_copyModel(nullptr, &model->compiled()));
  const DataPtr data(mj_makeData(written.get()));
  ParameterWriter writer(*model, written.get(), data.get());
  ASSERT_TRUE(writer.Write(model->Nominal(), FactsOfRig(rig).log_values));
  const RigFacts& facts = FactsOfRig(rig);
  if (facts.own_values) return;
  for (const auto& setting : experiment.settings) {
    if (setting.field == "option/gravity") continue;  // deliberate: tilted by the published offset
    const auto field = ResolveField(model->compiled(), setting.field, setting.where);
    ASSERT_TRUE(field.ok()) << field.error().Text();
    for (std::size_t i = 0; i < field.value().components.size(); ++i) {
      for (const FieldSlot& slot : field.value().components[i]) {
        const double mjcf = At(model->compiled(), slot), now = At(*written, slot);
        EXPECT_NEAR(now, mjcf, facts.rounded * std::abs(mjcf))
            << rig << ": " << setting.where << " " << setting.field << "[" << i << "]";
      }
    }
  }
  // MuJoCo's derived constants follow.
  for (int i = 0; i < written->nv; ++i)
    EXPECT_NEAR(written->dof_M0[i], model->compiled().dof_M0[i], 1e-4 * model->compiled().dof_M0[i]) << rig;
}

TEST_P(ShippedTest, MovesAsItsMjcfWhenDrivenByMuJoCoAlone) {
  const std::string rig = GetParam();
  if (FactsOfRig(rig).own_values || !FactsOfRig(rig).log_values.empty()) return;
  const Experiment experiment = ShippedExperiment(rig);
  const auto model = MakeModel(experiment);
  const mjModel& m = model->compiled();
  const Recording recording =
      MakeRecording(experiment, 200, m.opt.timestep, [](int c, double t) { return c == 0 ? Exciting(t, 0.5) : 0; });
  const auto predicted = Predict(*model, recording);
  // Dry friction as stiff as the step allows (solref -1) is written for the replay's step, a hair below its limit.
  const ModelPtr alone(mj_copyModel(nullptr, &m));
  for (int dof = 0; dof < alone->nv; ++dof) {
    mjtNum* solref = alone->dof_solref + mjNREF * dof;
    if (solref[0] == -1) solref[1] = -0.9999 / m.opt.timestep;
  }
  const DataPtr d(mj_makeData(alone.get()));
  double difference = 0;
  for (std::size_t k = 0; k + 1 < recording.rows(); ++k) {
    for (std::size_t c = 0; c < recording.commands.size(); ++c)
      d->ctrl[model->command_actuators()[c]] = recording.commands[c].values[k];
    mj_step(alone.get(), d.get());
    for (std::size_t s = 0; s < predicted.size(); ++s) {
      // What passes a sensor's filter is not the joint's angle.
      if (experiment.measured[s].kind == SignalKind::kPosition && model->source(s).cutoff < 0)
        difference = std::max(difference, std::abs(predicted[s][k + 1] - d->qpos[model->source(s).qpos]));
    }
  }
  // Numbers of the MJCF against expressions of the parameters: rounding only.
  EXPECT_LT(difference, 1e-9) << rig;
}

// A motor that becomes a plugin keeps every field that the experiment sets: else the diagnosis would never try what
// acts in the motor.
TEST_P(ShippedTest, EveryPossibleEffectCanBeAdded) {
  const Experiment experiment = ShippedExperiment(GetParam());
  const auto model = MakeModel(experiment);
  const auto uses = AllUses(*model->rig());
  EXPECT_FALSE(uses.empty());
  for (const auto& use : uses) {
    const auto with = Model::Build(model->rig(), {use});
    EXPECT_TRUE(with.ok()) << use.Text() << ": " << with.error().Text();
  }
}

INSTANTIATE_TEST_SUITE_P(Rigs, ShippedTest, ::testing::ValuesIn(RigNames()),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace gapscope::testing

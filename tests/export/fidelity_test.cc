// Each effect's native form against its plugin: logs of the plugin model, driven through the written file.
#include "src/export/fidelity.h"

#include <gtest/gtest.h>

#include "src/core/file.h"
#include "src/export/target.h"
#include "tests/model/synthetic.h"
#include "tests/models/rig_facts.h"

namespace gapscope::testing {
namespace {

struct Case {
  std::string rig, effect;
  std::map<std::string, double> values;  // of the effect, by key
  Fidelity fidelity;
  double most;  // normalised error of the exported file; XML keeps six digits
  std::string target = "mujoco_native";
  double step_s = 0;  // 0: the rig's own
};

std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << c.rig << " " << c.effect << " to " << c.target;
}

// A log of two seconds of the model's own motion.
Recording OwnLog(const Model& model, const std::map<std::string, double>& set,
                 const std::map<std::string, double>& log_values = {}) {
  const bool volts = model.rig()->KindOfCommand("motor") == CommandKind::kVoltage;
  const auto command = [&](int c, double t) {
    const std::string& actuator = model.experiment().commands[static_cast<std::size_t>(c)].actuator;
    if (actuator == "motor.supply") return 7.4;
    if (actuator == "motor.enable") return 1.0;
    return c == 0 ? Exciting(t, volts ? 4 : 0.6) : 0;
  };
  Recording log = MakeRecording(model.experiment(), 1001, 0.002, command, log_values);
  log.log_path = "own.csv";
  log.timeline.median_step_s = 0.002;
  const auto predicted = Predict(model, log, set);
  for (std::size_t s = 0; s < log.measured.size(); ++s) log.measured[s].values = predicted[s];
  return log;
}

// What became of effects in the file that a target reads, and how that moves.
struct Exported {
  std::vector<NativeEffect> effects;
  FidelityErrors errors;
  double without_friction = kNaN;  // its error, where a law has friction, if that had none
};
void Export(const std::string& rig, const std::vector<std::string>& effects, const std::map<std::string, double>& set,
            const NativeFeatures& features, Exported* result) {
  const Scratch scratch;
  const Experiment experiment = ShippedExperiment(rig);
  const auto base = MakeModel(experiment);
  const ScaleTable scales = EstimateScales(*base, {OwnLog(*base, {})});
  const auto uses = ParseEffects(effects, *base->rig());
  ASSERT_TRUE(uses.ok()) << uses.error().Text();
  const auto model = MakeModel(experiment, uses.value(), scales);
  const std::vector<double> values = ValuesWith(*model, set);
  const auto exported = model->ExportNative(values, nullptr, features);
  ASSERT_TRUE(exported.ok()) << exported.error().Text();
  ExportedFile file = FileOf(exported.value(), scratch.Path("model.xml"));
  result->effects = exported.value().native;
  const auto xml = SpecToXml(*exported.value().spec, "model.xml");
  ASSERT_TRUE(xml.ok() && WriteFile(file.path, xml.value()).ok());
  EXPECT_EQ(xml.value().find("plugin"), std::string::npos);
  ThreadPool pool(1);
  const auto errors = MeasureFidelity(*model, values, file, {OwnLog(*model, set)}, pool);
  ASSERT_TRUE(errors.ok()) << errors.error().Text();
  result->errors = errors.value();
  if (file.friction.empty()) return;
  file.friction.clear();
  const auto without = MeasureFidelity(*model, values, file, {OwnLog(*model, set)}, pool);
  ASSERT_TRUE(without.ok()) << without.error().Text();
  result->without_friction = without.value().exported;
}

constexpr double kOfTheIntegrator = 0.05;  // implicitfast for RK4, at a rig's own step

class NativeFormTest : public ::testing::TestWithParam<Case> {};

TEST_P(NativeFormTest, MovesAsItsFidelitySays) {
  const Case& c = GetParam();
  std::map<std::string, double> set;
  for (const auto& [key, value] : c.values) set[c.effect + "." + key] = value;
  NativeFeatures features = TargetOf(c.target).has;
  features.time_step_s = c.step_s;
  Exported exported;
  ASSERT_NO_FATAL_FAILURE(Export(c.rig, {c.effect}, set, features, &exported));
  const Fidelity fidelity = exported.effects.front().fidelity;
  EXPECT_EQ(fidelity, c.fidelity) << FidelityName(fidelity);
  // A file that lacks the effect would not pass; one that drops it moves as if it were not there.
  if (fidelity == Fidelity::kDropped) {
    EXPECT_NEAR(exported.errors.exported, exported.errors.nominal, kOfTheIntegrator * exported.errors.nominal);
  } else {
    EXPECT_GT(exported.errors.nominal, (fidelity == Fidelity::kApproximated ? 1.2 : 20) * c.most);
  }
  EXPECT_LT(exported.errors.exported, exported.errors.model + c.most) << "nominal " << exported.errors.nominal;
}

constexpr Fidelity kExact = Fidelity::kExact, kNearly = Fidelity::kApproximated, kHost = Fidelity::kHost,
                   kDropped = Fidelity::kDropped;
constexpr char kNative[] = "mujoco_native", kMjx[] = "mjx", kMjlab[] = "mjlab", kIsaacLab[] = "isaaclab",
               kWarp[] = "mujoco_warp";

// A drive's plugin of the MJCF's own comes before that of a joint's friction, in the file and where it is read back.
TEST(FidelityTest, AFileWithADriveAndItsLoadFrictionMovesAsTheModel) {
  const Scratch scratch;
  const Experiment experiment = ShippedExperiment("xl330");
  const auto log_values = FactsOfRig("xl330").log_values;
  const auto base = MakeModel(experiment);
  const auto uses = ParseEffects({"load_friction@joint"}, *base->rig());
  const auto model = MakeModel(experiment, uses.value(), EstimateScales(*base, {OwnLog(*base, {}, log_values)}));
  const std::map<std::string, double> set = {{"load_friction@joint.coefficient", 0.4}};
  const std::vector<double> values = ValuesWith(*model, set);
  const auto exported = model->Export(values, nullptr, {});
  ASSERT_TRUE(exported.ok()) << exported.error().Text();
  const ExportedFile file{.path = scratch.Path("model.xml"), .host = {}, .delays_s = {}};
  const auto xml = SpecToXml(*exported.value().spec, "model.xml");
  ASSERT_TRUE(xml.ok() && WriteFile(file.path, xml.value()).ok());
  ThreadPool pool(1);
  const auto errors = MeasureFidelity(*model, values, file, {OwnLog(*model, set, log_values)}, pool);
  ASSERT_TRUE(errors.ok()) << errors.error().Text();
  EXPECT_GT(errors.value().nominal, 0.02);
  EXPECT_LT(errors.value().exported, errors.value().model + 1e-4);
}

// Actuators with a state cannot be made plugins, which would stand in for the host.
TEST(FidelityTest, WhatTheHostSendsIsMeasuredBesideALag) {
  const std::map<std::string, double> set = {{"dead_zone@motor.half_width_v", 0.4},
                                             {"direction_asymmetry@motor.asymmetry", 0.3},
                                             {"direction_asymmetry@motor.command_share", 1},
                                             {"actuator_lag@motor.time_constant_s", 0.02}};
  const NativeFeatures features = TargetOf("mujoco_native").has;
  Exported all;
  ASSERT_NO_FATAL_FAILURE(
      Export("qube", {"dead_zone@motor", "direction_asymmetry@motor", "actuator_lag@motor"}, set, features, &all));
  EXPECT_EQ(all.effects[0].fidelity, kHost);
  EXPECT_EQ(all.effects[1].fidelity, kHost);
  EXPECT_EQ(all.effects[2].fidelity, kNearly);
  constexpr double kOfTheLag = 0.015;  // its own case below
  EXPECT_GT(all.errors.nominal, 5 * kOfTheLag);
  EXPECT_LT(all.errors.exported, all.errors.model + kOfTheLag);
}

// Friction that the engine's solver lacks, of a drive that has a law anyway: nearer to the model than without it.
class LawFrictionTest : public ::testing::TestWithParam<Case> {};

TEST_P(LawFrictionTest, IsNearerThanNone) {
  const Case& c = GetParam();
  std::map<std::string, double> set = {{"torque_delay@motor.delay_s", 0.004}};
  for (const auto& [key, value] : c.values) set[c.effect + "." + key] = value;
  NativeFeatures features = TargetOf(c.target).has;
  features.time_step_s = c.step_s;
  Exported exported;
  ASSERT_NO_FATAL_FAILURE(Export(c.rig, {c.effect, "torque_delay@motor"}, set, features, &exported));
  EXPECT_EQ(exported.effects[0].fidelity, c.fidelity) << exported.effects[0].how;
  EXPECT_EQ(exported.effects[1].fidelity, kExact);
  EXPECT_LT(exported.errors.exported, c.most * exported.without_friction);
}

INSTANTIATE_TEST_SUITE_P(
    Effects, LawFrictionTest,
    ::testing::Values(Case{"joint", "load_friction@joint", {{"coefficient", 0.2}}, kNearly, 0.3, kMjlab, 5e-4},
                      Case{"joint", "load_friction@joint", {{"coefficient", 0.2}}, kNearly, 0.7, kIsaacLab, 5e-3},
                      Case{"joint",
                           "stribeck_friction@joint",
                           {{"friction_n_m", 4}, {"breakaway_n_m", 8}, {"stribeck_speed_rad_per_s", 1}},
                           kNearly,
                           0.5,
                           kMjlab,
                           5e-4}));

INSTANTIATE_TEST_SUITE_P(
    Effects, NativeFormTest,
    ::testing::Values(
        Case{"qube", "cable_spring@arm", {{"stiffness_n_m_per_rad", 0.002}, {"rest_rad", 0.4}}, kExact, 1e-5},
        Case{"qube",
             "cable_spring@arm",
             {{"stiffness_n_m_per_rad", 0.002}, {"stiffness_cubic_n_m_per_rad3", 0.002}},
             kExact,
             1e-5},
        Case{"flexjoint", "cable_spring@base", {{"stiffness_n_m_per_rad", 0.2}, {"rest_rad", 0.4}}, kExact, 1e-5},
        Case{"flexjoint", "spring_hardening@link", {{"cubic_n_m_per_rad3", 200}}, kExact, 1e-5},
        Case{"qube", "coulomb_friction@arm", {{"friction_n_m", 0.001}}, kExact, 1e-4},
        Case{"joint",
             "direction_asymmetry@joint",
             {{"friction_positive_n_m", 6}, {"friction_negative_n_m", 2}},
             kExact,
             1e-4},
        Case{"joint",
             "stribeck_friction@joint",
             {{"friction_n_m", 4}, {"breakaway_n_m", 8}, {"stribeck_speed_rad_per_s", 0.3}},
             kNearly,
             0.02},
        Case{"joint", "load_friction@joint", {{"coefficient", 0.2}}, kDropped, 1},
        Case{"joint", "quadratic_drag@joint", {{"drag_n_m_s2_per_rad2", 1}}, kExact, 1e-3},
        Case{"qube", "gravity_offset@arm", {{"torque_n_m", 0.004}, {"rest_rad", 1}}, kExact, 1e-5},
        Case{"qube", "torque_bias@arm", {{"torque_n_m", 0.002}}, kExact, 1e-5},
        Case{"qube", "cogging@arm", {{"amplitude_n_m", 0.002}, {"periods_per_rev", 7}, {"phase_rad", 1}}, kExact, 1e-5},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.02}}, kNearly, 0.03},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.0213}}, kNearly, 0.03, kNative, 5e-4},
        // The joint has no armature: a drive of larger gains stands for what late feedback takes off the inertia.
        Case{"joint", "torque_delay@motor", {{"delay_s", 0.008}}, kNearly, 0.16, kNative, 5e-4},
        Case{"joint", "torque_limit@motor", {{"limit_n_m", 40}}, kExact, 1e-4},
        Case{"qube", "dead_zone@motor", {{"half_width_v", 0.4}}, kHost, 1e-5},
        Case{"joint", "dead_zone@motor", {{"half_width_n_m", 4}}, kDropped, 1},
        Case{"qube", "actuator_lag@motor", {{"time_constant_s", 0.02}}, kNearly, 0.015},
        Case{"joint", "actuator_lag@motor", {{"time_constant_s", 0.01}}, kNearly, 0.16},
        Case{"joint", "torque_constant_droop@motor", {{"loss_at_peak", 0.4}}, kDropped, 1},
        Case{"joint", "sensor_delay@position_rad", {{"delay_s", 0.01}}, kHost, 1e-5},
        Case{"joint", "joint_compliance@joint", {{"stiffness_n_m_per_rad", 2000}}, kExact, 1e-3},
        Case{"joint", "backlash@joint", {{"gap_rad", 0.05}}, kExact, 1e-3},
        Case{"qube", "cable_spring@arm", {{"stiffness_n_m_per_rad", 0.002}, {"rest_rad", 0.4}}, kExact, 1e-5, kMjx},
        Case{"qube", "torque_bias@arm", {{"torque_n_m", 0.002}}, kExact, 1e-5, kMjx},
        Case{"qube", "gravity_offset@arm", {{"torque_n_m", 0.004}, {"rest_rad", 1}}, kDropped, 1, kMjx},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.02}}, kHost, 1e-5, kMjx},
        // The implicitfast integrator stands for RK4: small steps, lest it be all that is seen.
        Case{"qube", "gravity_offset@arm", {{"torque_n_m", 0.004}, {"rest_rad", 1}}, kExact, 0.004, kMjlab, 2e-4},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.02}}, kExact, 0.006, kMjlab, 2e-4},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.0213}}, kNearly, 0.01, kMjlab, 2e-4},
        Case{"joint", "torque_delay@motor", {{"delay_s", 0.008}}, kExact, 0.006, kMjlab, 2e-4},
        Case{"qube", "actuator_lag@motor", {{"time_constant_s", 0.02}}, kExact, 0.0015, kMjlab, 5e-5},
        // Its torque is the drive's own estimate, which jumps with commands, whatever is lost behind it.
        Case{"joint", "torque_constant_droop@motor", {{"loss_at_peak", 0.8}}, kExact, 0.006, kMjlab, 2e-4},
        Case{"joint",
             "cable_spring@joint",
             {{"stiffness_n_m_per_rad", 60}, {"rest_rad", 0.4}},
             kExact,
             0.006,
             kIsaacLab,
             2e-4},
        Case{"joint", "gravity_offset@joint", {{"torque_n_m", 40}, {"rest_rad", 1}}, kExact, 0.006, kIsaacLab, 2e-4},
        Case{"qube", "cable_spring@pendulum", {{"stiffness_n_m_per_rad", 0.01}}, kExact, 0.004, kIsaacLab, 2e-4},
        Case{"joint", "command_delay@motor", {{"delay_s", 0.02}}, kExact, 0.006, kIsaacLab, 2e-4},
        Case{"qube", "gravity_offset@pendulum", {{"torque_n_m", 0.004}}, kDropped, 1, kIsaacLab},
        Case{"qube", "actuator_lag@motor", {{"time_constant_s", 0.02}}, kExact, 0.0015, kIsaacLab, 5e-5},
        Case{"joint", "backlash@joint", {{"gap_rad", 0.05}}, kDropped, 1, kIsaacLab},
        Case{"joint", "end_stop@joint", {{"stiffness_n_m_per_rad", 400}, {"angle_rad", 0.2}}, kExact, 1e-4},
        Case{"joint", "end_stop@joint", {{"stiffness_n_m_per_rad", 400}, {"angle_rad", 0.2}}, kExact, 1e-4, kMjx},
        Case{"joint", "end_stop@joint", {{"stiffness_n_m_per_rad", 400}, {"angle_rad", 0.2}}, kExact, 1e-4, kWarp},
        Case{"joint",
             "end_stop@joint",
             {{"stiffness_n_m_per_rad", 400}, {"angle_rad", 0.2}},
             kExact,
             0.006,
             kMjlab,
             2e-4},
        Case{"joint",
             "end_stop@joint",
             {{"stiffness_n_m_per_rad", 400}, {"angle_rad", 0.2}},
             kExact,
             0.006,
             kIsaacLab,
             2e-4},
        Case{
            "qube", "end_stop@pendulum", {{"stiffness_n_m_per_rad", 0.1}, {"angle_rad", 0.05}}, kDropped, 1, kIsaacLab},
        Case{"joint", "torque_speed_curve@motor", {{"power_w", 40}}, kDropped, 1},
        Case{"joint", "torque_speed_curve@motor", {{"power_w", 40}}, kExact, 0.006, kMjlab, 2e-4},
        Case{"joint", "torque_speed_curve@motor", {{"power_w", 40}}, kExact, 0.006, kIsaacLab, 2e-4},
        Case{"joint", "supply_sag@motor", {{"limit_n_m", 40}, {"sag_fraction", 1}}, kNearly, 0.2},
        Case{"joint", "supply_sag@motor", {{"limit_n_m", 40}, {"sag_fraction", 1}}, kExact, 0.006, kMjlab, 2e-4},
        Case{"joint", "supply_sag@motor", {{"limit_n_m", 40}, {"sag_fraction", 1}}, kExact, 0.006, kIsaacLab, 2e-4},
        Case{"qube", "payload@pendulum", {{"mass_kg", 0.02}, {"z_m", -0.1}}, kExact, 1e-4},
        Case{"qube", "payload@pendulum", {{"mass_kg", 0.02}, {"z_m", -0.1}}, kExact, 1e-4, kMjx},
        Case{"qube", "payload@pendulum", {{"mass_kg", 0.02}, {"z_m", -0.1}}, kExact, 0.004, kMjlab, 2e-4},
        Case{"qube", "payload@pendulum", {{"mass_kg", 0.02}, {"z_m", -0.1}}, kExact, 0.004, kIsaacLab, 2e-4},
        Case{"qube", "mount_tilt@model", {{"x_rad", 0.2}, {"y_rad", 0.1}}, kExact, 1e-4},
        Case{"qube", "mount_tilt@model", {{"x_rad", 0.2}, {"y_rad", 0.1}}, kExact, 1e-4, kMjx},
        Case{"qube", "mount_tilt@model", {{"x_rad", 0.2}, {"y_rad", 0.1}}, kExact, 0.004, kMjlab, 2e-4},
        Case{"qube", "mount_tilt@model", {{"x_rad", 0.2}, {"y_rad", 0.1}}, kExact, 0.004, kIsaacLab, 2e-4}),
    [](const auto& at) { return "case" + std::to_string(at.index); });

}  // namespace
}  // namespace gapscope::testing

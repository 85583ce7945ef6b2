// What a URDF holds of a model's joints: for each a <joint> with the attributes to write over its own.
// Source of the names: ros/urdfdom, urdf_parser/src/joint.cpp (limit: lower, upper, effort, velocity; dynamics:
// damping, friction).
#include <fmt/core.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/export/target.h"
#include "src/model/element_names.h"
#include "src/model/xml_text.h"

namespace gapscope {
namespace {

// Effects that are numbers of a URDF's joint.
constexpr const char* kOfJoints[] = {"coulomb_friction", "stribeck_friction", "torque_limit"};

// The model with what a URDF has of it.
Result<ExportedModel> MakeUrdf(const Model& model, std::span<const double> values) {
  GS_ASSIGN(const KeptEffects kept, KeepEffects(model, values, kOfJoints));
  const NativeFeatures features{.passive_motors = PassiveMotors::kNone,
                                .delays = CommandDelays::kNone,
                                .polynomials = false,
                                .tendons = false,
                                .lags = false};
  GS_ASSIGN(ExportedModel exported, kept.model->ExportNative(kept.values, nullptr, features));
  std::map<std::string, NativeEffect> of_joints;
  for (const NativeEffect& effect : exported.native) of_joints[effect.use.Text()] = effect;
  exported.native = Collect(model.effects(), [&](const EffectUse& use) {
    const auto found = of_joints.find(use.Text());
    return found == of_joints.end() ? LeftOut(model, use, "no attribute of a URDF's joint") : found->second;
  });
  return exported;
}

// The least of what limits a joint's torque, and the speed at which its drive has none left; infinite: nothing does.
struct DriveLimits {
  double effort = kInfinity, velocity = kInfinity;
};

// Of a motor whose force is a multiple of its command less a multiple of the joint's speed.
void LimitByCommand(const mjModel& model, int actuator, DriveLimits* limits) {
  const bool affine = model.actuator_biastype[actuator] == mjBIAS_AFFINE;
  const mjtNum* bias = model.actuator_biasprm + actuator * mjNBIAS;
  const bool motor = model.actuator_gaintype[actuator] == mjGAIN_FIXED && (!affine || bias[1] == 0);
  if (!motor || !model.actuator_ctrllimited[actuator]) return;
  const mjtNum* range = model.actuator_ctrlrange + 2 * actuator;
  const double gear = std::abs(model.actuator_gear[6 * actuator]);
  const double most = std::abs(model.actuator_gainprm[actuator * mjNGAIN]) * std::min(-range[0], range[1]);
  if (most <= 0) return;
  limits->effort = std::min(limits->effort, gear * most);
  if (affine && bias[2] < 0) limits->velocity = std::min(limits->velocity, most / (-bias[2] * gear));
}

DriveLimits LimitsOf(const mjModel& model, int joint) {
  DriveLimits limits;
  if (model.jnt_actfrclimited[joint])
    limits.effort = std::min(-model.jnt_actfrcrange[2 * joint], model.jnt_actfrcrange[2 * joint + 1]);
  const int drive = DriveOn(model, joint);  // what stands beside it adds efforts
  if (drive < 0) return limits;
  const mjtNum* force = model.actuator_forcerange + 2 * drive;
  if (model.actuator_forcelimited[drive])
    limits.effort = std::min(limits.effort, std::abs(model.actuator_gear[6 * drive]) * std::min(-force[0], force[1]));
  LimitByCommand(model, drive, &limits);
  return limits;
}

// The joint's patch; empty: the model has no number for it.
std::string PatchOf(const mjModel& model, int joint) {
  const bool hinge = model.jnt_type[joint] == mjJNT_HINGE, limited = model.jnt_limited[joint];
  const int dof = model.jnt_dofadr[joint];
  const DriveLimits limits = LimitsOf(model, joint);
  std::string limit, dynamics;
  if (std::isfinite(limits.effort)) limit += fmt::format(" effort=\"{:.10g}\"", limits.effort);
  if (std::isfinite(limits.velocity)) limit += fmt::format(" velocity=\"{:.10g}\"", limits.velocity);
  if (model.dof_damping[dof] > 0) dynamics += fmt::format(" damping=\"{:.10g}\"", model.dof_damping[dof]);
  if (model.dof_frictionloss[dof] > 0) dynamics += fmt::format(" friction=\"{:.10g}\"", model.dof_frictionloss[dof]);
  if (limit.empty() && dynamics.empty()) return "";
  std::string text = fmt::format("<joint name=\"{}\" type=\"{}\">\n", XmlEscape(NameOf(model, mjOBJ_JOINT, joint)),
                                 !hinge    ? "prismatic"
                                 : limited ? "revolute"
                                           : "continuous");
  if (!limit.empty()) text += "  <limit" + limit + "/>\n";
  if (!dynamics.empty()) text += "  <dynamics" + dynamics + "/>\n";
  return text + "</joint>\n";
}

Result<std::vector<TargetFile>> WriteUrdf(const TargetInput& input) {
  const mjModel& model = *input.exported.compiled;
  std::vector<TargetFile> files;
  for (int j = 0; j < model.njnt; ++j) {
    if (model.jnt_type[j] != mjJNT_HINGE && model.jnt_type[j] != mjJNT_SLIDE) continue;
    const std::string patch = PatchOf(model, j);
    if (patch.empty()) continue;
    std::string name = NameOf(model, mjOBJ_JOINT, j);
    std::ranges::replace_if(name, [](unsigned char c) { return !std::isalnum(c); }, '_');
    files.push_back({"joint_" + name + ".urdf",
                     "<!-- Written by gapscope: attributes for this joint of your URDF, SI. What is not here, keep. "
                     "-->\n" +
                         patch});
  }
  if (files.empty())
    return Error{.what = "no joint has a number that a URDF holds",
                 .where = input.model.experiment().model_path,
                 .allowed = "a torque limit, a no-load speed, damping or dry friction of a hinge or slide",
                 .cure = "export to mujoco_native"};
  return files;
}

}  // namespace

ExportTarget Target_urdf() {
  return {.name = "urdf", .what = "URDF, a patch for each joint", .mjcf = false, .make = MakeUrdf, .files = WriteUrdf};
}

}  // namespace gapscope

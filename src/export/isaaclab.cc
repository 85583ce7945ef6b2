#include "src/export/isaaclab.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/export/drive_laws.h"
#include "src/export/isaaclab_draws.h"
#include "src/export/isaaclab_laws.h"
#include "src/export/python_text.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

// A joint and what drives it; of a passive joint the drive is its own spring.
struct JointDrive {
  std::string name, joint, note, law_command;  // law_command: of a drive with a law, which target is its command
  double stiffness = 0, damping = 0, limit = kInfinity;
  std::optional<DelayRange> delay_steps;  // none: commands are not late
};

// A number's range over the number that the configuration has.
struct ScaleRange {
  double low = 0, high = 0;
};

// The member of ArticulationActions that a drive with a law takes for its command.
std::string TargetOfCommand(const JointDrive& drive) {
  return drive.law_command == "position"   ? "joint_positions"
         : drive.law_command == "velocity" ? "joint_velocities"
                                           : "joint_efforts";
}

class IsaacLabWriter {
 public:
  IsaacLabWriter(const TargetInput& input, const IsaacLabNames& names)
      : input_(input), names_(names), compiled_(*input.exported.compiled) {}

  Status FindDrives();
  std::string Text() const;

 private:
  Error NoForm(const std::string& what, const std::string& allowed) const;
  Result<JointDrive> DriveOf(int joint) const;
  Status SetGains(int actuator, JointDrive* drive) const;
  Status LimitBy(const mjtNum* range, double gear, JointDrive* drive) const;
  std::string Configuration(int joint, const JointDrive& drive) const;
  std::optional<ScaleRange> ScaleOf(const char* field, int dof, double base) const;
  std::string Event(int joint, const std::string& name) const;
  IsaacLabDraws Draws() const;
  std::string Head(const std::string& events, const IsaacLabDraws& draws, bool late) const;

  const TargetInput& input_;
  const IsaacLabNames& names_;
  const mjModel& compiled_;
  std::vector<std::pair<int, JointDrive>> drives_;  // by joint
};

Error IsaacLabWriter::NoForm(const std::string& what, const std::string& allowed) const {
  return {.what = what + ", which Isaac Lab's configurations have no form for",
          .where = input_.model.experiment().model_path,
          .allowed = allowed,
          .cure = "export to mjlab or mujoco_native"};
}

Status IsaacLabWriter::LimitBy(const mjtNum* range, double gear, JointDrive* drive) const {
  if (range[0] != -range[1])
    return NoForm("the torque limits of '" + drive->name + "' differ by direction", "the same both ways");
  drive->limit = std::min(drive->limit, gear * range[1]);
  return Ok();
}

Status IsaacLabWriter::SetGains(int actuator, JointDrive* drive) const {
  const mjtNum* gain = compiled_.actuator_gainprm + actuator * mjNGAIN;
  const mjtNum* bias = compiled_.actuator_biasprm + actuator * mjNBIAS;
  const bool affine = compiled_.actuator_biastype[actuator] == mjBIAS_AFFINE;
  const bool plain = compiled_.actuator_dyntype[actuator] == mjDYN_NONE &&
                     compiled_.actuator_gaintype[actuator] == mjGAIN_FIXED &&
                     (affine || compiled_.actuator_biastype[actuator] == mjBIAS_NONE) && (!affine || bias[0] == 0);
  if (!plain)
    return NoForm("the actuator '" + drive->name + "' is no plain servo or motor",
                  "a stateless fixed gain, an affine bias without a constant");
  const double gear = compiled_.actuator_gear[6 * actuator];
  drive->stiffness = affine ? 0 - gear * gear * bias[1] : 0;
  drive->damping = affine ? 0 - gear * gear * bias[2] : 0;
  const bool by_law = input_.exported.laws.contains(drive->name);
  if (by_law)
    drive->law_command = CommandField(compiled_, actuator);
  else if (drive->stiffness == 0)
    drive->note = fmt::format("effort target: {:.6g} N m for each unit of the command", gear * gain[0]);
  else if (gear * gain[0] != drive->stiffness)
    drive->note = fmt::format("position target: {:.6g} times the command", gear * gain[0] / drive->stiffness);
  if (compiled_.actuator_ctrllimited[actuator] && !by_law) {
    const mjtNum* range = compiled_.actuator_ctrlrange + 2 * compiled_.actuator_ctrladr[actuator];
    drive->note += fmt::format("{}clip commands to {:.6g} .. {:.6g} before they are sent, as the MJCF does",
                               drive->note.empty() ? "" : "; ", range[0], range[1]);
  }
  const int joint = compiled_.actuator_trnid[2 * actuator];
  if (compiled_.actuator_forcelimited[actuator] && !by_law)
    GS_RETURN_IF_ERROR(LimitBy(compiled_.actuator_forcerange + 2 * actuator, std::abs(gear), drive));
  if (compiled_.jnt_actfrclimited[joint]) GS_RETURN_IF_ERROR(LimitBy(compiled_.jnt_actfrcrange + 2 * joint, 1, drive));
  const auto& late = input_.exported.delay_steps;
  if (const auto mine = late.find(drive->name); mine != late.end()) {
    const auto row = static_cast<std::size_t>(std::distance(late.begin(), mine));
    const double steps = mine->second;
    drive->delay_steps =
        input_.randomization ? RangeOfDelay(*input_.randomization, row, steps) : DelayRange{steps, steps};
  }
  return Ok();
}

// Plain motors beside the joint's drive are efforts of the same configuration.
Result<JointDrive> IsaacLabWriter::DriveOf(int joint) const {
  JointDrive drive{.joint = NameOf(compiled_, mjOBJ_JOINT, joint)};
  drive.name = drive.joint;
  const double spring = compiled_.jnt_stiffness[joint];
  const int actuator = DriveOn(compiled_, joint);
  const bool driven = actuator >= 0;
  if (driven) {
    drive.name = NameOf(compiled_, mjOBJ_ACTUATOR, actuator);
    GS_RETURN_IF_ERROR(SetGains(actuator, &drive));
  }
  const mjtNum* poly = compiled_.jnt_stiffnesspoly + mjNPOLY * joint;
  if ((driven && spring != 0) || std::any_of(poly, poly + mjNPOLY, [](double x) { return x != 0; }))
    return NoForm("the joint '" + drive.joint + "' has a spring of its own beside its drive, or one that hardens",
                  "linear springs, on joints without a drive");
  if (!driven && spring != 0) {
    drive.stiffness = spring;
    drive.note = fmt::format("a spring: its position target is {:.6g} rad, always",
                             compiled_.qpos_spring[compiled_.jnt_qposadr[joint]]);
  }
  return drive;
}

Status IsaacLabWriter::FindDrives() {
  if (compiled_.ntendon > 0 || compiled_.neq > 0)
    return NoForm("the MJCF has tendons or equality constraints", "joints that stand alone");
  for (int j = 0; j < compiled_.njnt; ++j) {
    if (compiled_.jnt_type[j] == mjJNT_FREE && j == 0) continue;
    if (compiled_.jnt_type[j] != mjJNT_HINGE && compiled_.jnt_type[j] != mjJNT_SLIDE)
      return NoForm("the joint '" + NameOf(compiled_, mjOBJ_JOINT, j) + "' is a ball or a free joint",
                    "hinges and slides");
    GS_ASSIGN(JointDrive drive, DriveOf(j));
    drives_.push_back({j, std::move(drive)});
  }
  return Ok();
}

std::string IsaacLabWriter::Configuration(int joint, const JointDrive& drive) const {
  const bool late = drive.delay_steps.has_value(), by_law = !drive.law_command.empty();
  const int dof = compiled_.jnt_dofadr[joint];
  const std::string friction = PyNumber(compiled_.dof_frictionloss[dof]);
  std::string text = fmt::format(
      "  {}: {}(\n    joint_names_expr=[{}],\n    stiffness={},\n    "
      "damping={},\n",
      PyText(drive.name),
      by_law ? "LawCfg"
      : late ? "DelayedPDActuatorCfg"
             : "ImplicitActuatorCfg",
      PyPattern(drive.joint), PyNumber(drive.stiffness), PyNumber(drive.damping));
  if (by_law)
    text += fmt::format("    law=LAWS[{}],\n    command=\"{}\",\n", PyText(drive.name), TargetOfCommand(drive));
  if (!drive.note.empty()) text = fmt::format("  # {}\n{}", drive.note, text);
  if (std::isfinite(drive.limit))
    text += fmt::format("    {}={},\n", late ? names_.explicit_limit : names_.implicit_limit, PyNumber(drive.limit));
  text += fmt::format(
      "    armature={},\n    friction={},\n    "
      "dynamic_friction={},\n    viscous_friction={},\n",
      PyNumber(compiled_.dof_armature[dof]), friction, friction, PyNumber(compiled_.dof_damping[dof]));
  if (late)
    text += fmt::format(
        "    # Each episode; efforts that are added to it are late too.\n    min_delay={:.0f},\n    "
        "max_delay={:.0f},\n",
        drive.delay_steps->low, drive.delay_steps->high);
  return text + "  ),\n";
}

// Of a number that a parameter makes which may be drawn alone.
std::optional<ScaleRange> IsaacLabWriter::ScaleOf(const char* field, int dof, double base) const {
  if (!input_.randomization || base <= 0) return std::nullopt;
  const std::vector<ParameterRange>& ranges = input_.randomization->ranges;
  for (const ParameterRange& range : ranges) {
    if (!MayBeDrawnAlone(range, ranges)) continue;
    const VaryingNumber& number = range.numbers.front();
    if (number.field == field && number.row == static_cast<std::size_t>(dof))
      return ScaleRange{number.low / base, number.high / base};
  }
  return std::nullopt;
}

// What of a joint is drawn; empty: nothing.
std::string IsaacLabWriter::Event(int joint, const std::string& name) const {
  const int dof = compiled_.jnt_dofadr[joint];
  const double dry_base = compiled_.dof_frictionloss[dof], viscous_base = compiled_.dof_damping[dof];
  const auto dry = ScaleOf("dof_frictionloss", dof, dry_base), viscous = ScaleOf("dof_damping", dof, viscous_base);
  std::optional<ScaleRange> friction = dry ? dry : viscous;
  if (dry && viscous) {
    const ScaleRange both{std::max(dry->low, viscous->low), std::min(dry->high, viscous->high)};
    if (both.low < both.high) friction = both;
  }
  std::string text;
  if (friction && dry_base > 0 && viscous_base > 0)
    text += "      # For dry and for viscous friction: Isaac Lab draws both from one range.\n";
  if (friction)
    text += fmt::format("      \"friction_distribution_params\": ({}, {}),\n", PyNumber(friction->low),
                        PyNumber(friction->high));
  if (const auto armature = ScaleOf("dof_armature", dof, compiled_.dof_armature[dof]))
    text += fmt::format("      \"armature_distribution_params\": ({}, {}),\n", PyNumber(armature->low),
                        PyNumber(armature->high));
  if (text.empty()) return "";
  return fmt::format(
      "  {}: EventTermCfg(\n    func=mdp.randomize_joint_parameters,\n    mode=\"startup\",\n    params={{\n"
      "      \"asset_cfg\": SceneEntityCfg(\"robot\", joint_names=[{}]),\n{}"
      "      \"operation\": \"scale\",\n      \"distribution\": \"uniform\",\n    }},\n  ),\n",
      PyText(name), PyPattern(NameOf(compiled_, mjOBJ_JOINT, joint)), text);
}

IsaacLabDraws IsaacLabWriter::Draws() const {
  const auto drives = Collect(drives_, [](const auto& entry) {
    const auto& [joint, drive] = entry;
    return DrawnDrive{drive.name, joint, drive.delay_steps.has_value(), !drive.law_command.empty()};
  });
  return WriteIsaacLabDraws(input_, names_, drives);
}

// How it is used, and what it imports. `late`: some drive's commands are.
std::string IsaacLabWriter::Head(const std::string& events, const IsaacLabDraws& draws, bool late) const {
  const bool laws = !input_.exported.laws.empty(), drawn = !draws.functions.empty();
  std::string terms = events.empty() ? "" : "EVENTS, ", use;
  if (!events.empty()) use = "The environment's events = EVENTS, where the articulation is the scene's \"robot\".\n";
  if (drawn) {
    terms = std::string(draws.late ? "DRAWN_ACTUATORS, " : "") + "DRAWS, " + terms;
    use += fmt::format("Or DRAWS{}: each environment has a joint draw, what goes together stays together.\n",
                       draws.late ? ", with actuators=DRAWN_ACTUATORS" : "");
  }
  std::string text = fmt::format(
      "\"\"\"Actuators for Isaac Lab {}, written by gapscope: friction in N m, "
      "so Isaac Sim 5 or later.\n\n"
      "from gapscope_isaaclab import ACTUATORS, {}SIMULATION\n"
      "ArticulationCfg(spawn=..., actuators=ACTUATORS), of a USD made of "
      "{}.\n{}\"\"\"\n\n",
      names_.version, terms, input_.mjcf, use);
  if (laws) text += "from dataclasses import MISSING\n";
  if (drawn) text += "from pathlib import Path\n";
  if (laws || drawn) text += "\n";
  if (drawn) text += "import numpy as np\n";
  if (drawn || (laws && input_.randomization)) text += "import torch\n";
  if (laws) text += "from gapscope_torch import Drive\n";
  text += fmt::format("from isaaclab.actuators import {}{}ImplicitActuatorCfg\n", late ? "DelayedPDActuatorCfg, " : "",
                      laws ? "IdealPDActuator, IdealPDActuatorCfg, " : "");
  if (!events.empty()) text += "from isaaclab.envs import mdp\n";
  if (!events.empty() || drawn) text += "from isaaclab.managers import EventTermCfg, SceneEntityCfg\n";
  return text;
}

std::string IsaacLabWriter::Text() const {
  const mjOption& option = input_.exported.spec->option;
  const bool late =
      std::ranges::any_of(drives_, [](const auto& drive) { return drive.second.delay_steps.has_value(); });
  std::string events;
  for (const auto& [joint, drive] : drives_) events += Event(joint, drive.name);
  events += IsaacLabLawEvents(input_);
  const IsaacLabDraws draws = Draws();
  const bool laws = !input_.exported.laws.empty(), python = laws || draws.late;
  std::string text = Head(events, draws, late);
  text += fmt::format("from isaaclab.sim import SimulationCfg\n{}\nSIMULATION = SimulationCfg(dt={}, gravity={}{})\n\n",
                      laws ? "from isaaclab.utils import configclass\n" : "", PyNumber(option.timestep),
                      PyNumbers(option.gravity), python ? names_.python_actuators : "");
  text += IsaacLabLaws(input_) + draws.functions + "ACTUATORS = {\n";
  for (const auto& [joint, drive] : drives_) text += Configuration(joint, drive);
  text += "}\n";
  if (!events.empty()) text += "\n# Each environment's own, times what ACTUATORS says.\nEVENTS = {\n" + events + "}\n";
  return text + draws.terms;
}

}  // namespace

NativeFeatures IsaacLabFeatures() {
  return {.passive_motors = PassiveMotors::kHost,
          .delays = CommandDelays::kWholeSteps,
          .polynomials = false,
          .springs_on_drives = false,
          .tendons = false,
          .lags = false,
          .runge_kutta = false,
          .drive_laws = true};
}

Result<std::vector<TargetFile>> WriteIsaacLab(const TargetInput& input, const IsaacLabNames& names) {
  IsaacLabWriter writer(input, names);
  GS_RETURN_IF_ERROR(writer.FindDrives());
  std::vector<TargetFile> files = LawFiles(input);
  files.insert(files.begin(), {"gapscope_isaaclab.py", writer.Text()});
  return files;
}

}  // namespace gapscope

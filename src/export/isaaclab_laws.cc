// Sources: the wheels isaaclab 2.3.2.post1 and 3.0.0, actuators/actuator_base.py, actuators/actuator_pd.py (what an
// actuator is made with, what it computes and is reset by) and utils/configclass.py.
#include "src/export/isaaclab_laws.h"

#include <fmt/core.h>

#include "src/export/drive_laws.h"
#include "src/export/python_text.h"

namespace gapscope {

std::string IsaacLabLaws(const TargetInput& input) {
  const std::string laws = LawsText(input);
  if (laws.empty()) return "";
  std::string text = laws + R"(

class LawActuator(IdealPDActuator):
  """The law makes the torque, instead of the gains. Efforts beside another command are as late as that."""

  def __init__(self, cfg, *args, **kwargs):
    super().__init__(cfg, *args, **kwargs)
    self.drive = Drive(cfg.step_s, **cfg.law)

  def compute(self, control_action, joint_pos, joint_vel):
    command = getattr(control_action, self.cfg.command)
    beside = None if self.cfg.command == "joint_efforts" else control_action.joint_efforts
    torque = self.drive.step(command, joint_pos, joint_vel, beside)
    self.computed_effort = self.applied_effort = control_action.joint_efforts = torque
    control_action.joint_positions = control_action.joint_velocities = None
    return control_action

  def reset(self, env_ids):
    super().reset(env_ids)
    self.drive.reset(slice(None) if env_ids is None else env_ids)


@configclass
class LawCfg(IdealPDActuatorCfg):
  class_type: type = LawActuator
  law: dict = MISSING
  command: str = MISSING
  step_s: float = SIMULATION.dt


)";
  if (IsaacLabLawEvents(input).empty()) return text;
  return text + R"(def draw_law(env, env_ids, asset_cfg, drive, argument, limits):
  """Gives each environment an argument of its own, from a uniform distribution."""
  if env_ids is None:
    env_ids = torch.arange(env.scene.num_envs, device=env.device)
  values = torch.empty(len(env_ids), device=env.device).uniform_(*limits)
  env.scene[asset_cfg.name].actuators[drive].drive.vary(argument, values, env_ids, env.scene.num_envs)


)";
}

std::string IsaacLabLawEvents(const TargetInput& input) {
  if (!input.randomization) return "";
  const std::vector<LawArgument> arguments = LawArguments(input.exported);
  const std::vector<ParameterRange>& ranges = input.randomization->ranges;
  std::string text;
  for (const ParameterRange& range : ranges) {
    if (!MayBeDrawnAlone(range, ranges) || range.numbers.front().field != kLaws) continue;
    const VaryingNumber& number = range.numbers.front();
    const LawArgument& argument = arguments[number.row];
    text += fmt::format(
        "  {}: EventTermCfg(\n    func=draw_law,\n    mode=\"startup\",\n    params={{\n"
        "      \"asset_cfg\": SceneEntityCfg(\"robot\"),\n      \"drive\": {},\n      \"argument\": \"{}\",\n"
        "      \"limits\": ({}, {}),\n    }},\n  ),\n",
        PyText(range.name), PyText(argument.drive), argument.name, PyNumber(number.low), PyNumber(number.high));
  }
  return text;
}

}  // namespace gapscope

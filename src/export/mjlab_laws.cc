#include "src/export/mjlab_laws.h"

#include <fmt/core.h>

#include <algorithm>

#include "src/export/drive_laws.h"

namespace gapscope {

std::string MjlabLaws(const TargetInput& input) {
  const std::string laws = LawsText(input);
  return laws.empty() ? "" : laws + R"(

@dataclass(kw_only=True)
class LawCfg(XmlActuatorCfg):
  law: dict

  def build(self, entity, target_ids, target_names):
    return LawActuator(self, entity, target_ids, target_names)


class LawActuator(XmlActuator):
  """A plain motor; the law makes its torque, instead of the MJCF's own gains, gear and limits."""

  def edit_spec(self, spec, target_names):
    super().edit_spec(spec, target_names)
    for actuator in self._mjs_actuators:
      actuator.set_to_motor()
      actuator.gear[0] = 1
      actuator.ctrllimited = actuator.forcelimited = mujoco.mjtLimited.mjLIMITED_FALSE

  def initialize(self, mj_model, model, data, device):
    super().initialize(mj_model, model, data, device)
    self.drive = Drive(mj_model.opt.timestep, **self.cfg.law)

  def compute(self, cmd):
    return self.drive.step(super().compute(cmd), cmd.pos, cmd.vel)

  def reset(self, env_ids=None):
    super().reset(env_ids)
    self.drive.reset(slice(None) if env_ids is None else env_ids)


)";
}

std::string DrawnMjlabLaws(const TargetInput& input, const std::vector<std::string>& drives) {
  std::string text;
  for (const LawArgument& argument : VaryingLawArguments(input)) {
    const auto drive = std::ranges::find(drives, argument.drive);
    if (drive == drives.end()) continue;
    text += fmt::format(
        "  values = torch.as_tensor(drawn[\"{}\"][row, {}], dtype=torch.float32, device=env.device)\n"
        "  asset.actuators[{}].drive.vary(\"{}\", values, env_ids, env.num_envs)\n",
        kLaws, argument.row, drive - drives.begin(), argument.name);
  }
  return text;
}

}  // namespace gapscope

#include "src/export/mjlab_laws.h"

#include <fmt/core.h>

#include <algorithm>
#include <set>

#include "src/export/python_text.h"

namespace gapscope {
namespace {

// Of the drive's first number in kLaws.
std::size_t RowOf(const std::map<std::string, DriveLaw>& laws, const std::string& drive) {
  std::size_t row = 0;
  for (const auto& [name, law] : laws) {
    if (name == drive) break;
    row += law.size();
  }
  return row;
}

// The longest that both delays of a law together may be, in any draw.
double MostDelay_s(const TargetInput& input, const std::string& drive) {
  const DrawnField* drawn = input.randomization ? FieldOf(*input.randomization, kLaws) : nullptr;
  double most = 0;
  for (std::size_t draw = 0; draw <= (drawn ? drawn->shape[0] : 0); ++draw) {
    double sum = 0;
    std::size_t row = RowOf(input.exported.laws, drive);
    for (const auto& [argument, number] : input.exported.laws.at(drive)) {
      const bool late = argument == "command_delay_s" || argument == "torque_delay_s";
      if (late) sum += draw == 0 ? number : drawn->values[(draw - 1) * drawn->shape[1] + row];
      ++row;
    }
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

std::string MjlabLaws(const TargetInput& input) {
  if (input.exported.laws.empty()) return "";
  std::string laws;
  for (const auto& [drive, law] : input.exported.laws) {
    laws += fmt::format("  {}: {{\n", PyText(drive));
    for (const auto& [argument, number] : law) laws += fmt::format("    \"{}\": {},\n", argument, PyNumber(number));
    laws += fmt::format("    \"max_delay_s\": {},\n  }},\n", PyNumber(MostDelay_s(input, drive)));
  }
  return "# Arguments of gapscope_torch.Drive, instead of the MJCF's own gains.\nLAWS = {\n" + laws + R"(}


@dataclass(kw_only=True)
class LawCfg(XmlActuatorCfg):
  law: dict

  def build(self, entity, target_ids, target_names):
    return LawActuator(self, entity, target_ids, target_names)


class LawActuator(XmlActuator):
  def edit_spec(self, spec, target_names):
    super().edit_spec(spec, target_names)
    for actuator in self._mjs_actuators:
      actuator.set_to_motor()

  def initialize(self, mj_model, model, data, device):
    super().initialize(mj_model, model, data, device)
    self.drive = Drive(mj_model.opt.timestep, **self.cfg.law)

  def compute(self, cmd):
    return self.drive.step(super().compute(cmd), cmd.pos, cmd.vel)

  def reset(self, env_ids=None):
    super().reset(env_ids)
    self.drive.reset(slice(None) if env_ids is None else env_ids)

  def set_law(self, argument, values, env_ids, num_envs):
    of_all = torch.as_tensor(getattr(self.drive, argument), dtype=torch.float32, device=values.device)
    of_all = of_all.expand(num_envs, 1).clone()
    of_all[env_ids, 0] = values
    setattr(self.drive, argument, of_all)


)";
}

std::string DrawnMjlabLaws(const TargetInput& input, const std::vector<std::string>& drives) {
  std::set<std::size_t> vary;
  for (const ParameterRange& range : input.randomization->ranges) {
    for (const VaryingNumber& number : range.numbers) {
      if (number.field == kLaws) vary.insert(number.row);
    }
  }
  std::string text;
  for (std::size_t d = 0; d < drives.size(); ++d) {
    const auto law = input.exported.laws.find(drives[d]);
    if (law == input.exported.laws.end()) continue;
    std::size_t row = RowOf(input.exported.laws, drives[d]);
    for (const auto& [argument, number] : law->second) {
      if (vary.contains(row))
        text += fmt::format(
            "  values = torch.as_tensor(drawn[\"{}\"][row, {}], dtype=torch.float32, device=env.device)\n"
            "  asset.actuators[{}].set_law(\"{}\", values, env_ids, env.num_envs)\n",
            kLaws, row, d, argument);
      ++row;
    }
  }
  return text;
}

}  // namespace gapscope

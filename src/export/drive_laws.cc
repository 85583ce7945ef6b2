#include "src/export/drive_laws.h"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <map>
#include <set>

#include "src/export/python_text.h"
#include "src/export/torch_file.h"

namespace gapscope {
namespace {

bool IsLate(const LawArgument& argument) {
  return argument.name == "command_delay_s" || argument.name == "torque_delay_s";
}

// The longest that both delays of a law together may be, at any end of a range and in any draw.
double MostDelay_s(const TargetInput& input, const std::string& drive) {
  std::vector<LawArgument> late = LawArguments(input.exported);
  std::erase_if(late, [&](const LawArgument& argument) { return argument.drive != drive || !IsLate(argument); });
  double most = 0;
  for (const LawArgument& argument : late) {
    double of_it = argument.value;
    for (const ParameterRange& range :
         input.randomization ? input.randomization->ranges : std::vector<ParameterRange>{}) {
      for (const VaryingNumber& number : range.numbers) {
        if (number.field == kLaws && number.row == argument.row) of_it = std::max({of_it, number.low, number.high});
      }
    }
    most += of_it;
  }
  const DrawnField* drawn = input.randomization ? FieldOf(*input.randomization, kLaws) : nullptr;
  for (std::size_t draw = 0; drawn && draw < drawn->shape[0]; ++draw) {
    double sum = 0;
    for (const LawArgument& argument : late) sum += drawn->values[draw * drawn->shape[1] + argument.row];
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

std::vector<LawArgument> LawArguments(const ExportedModel& exported) {
  std::vector<LawArgument> arguments;
  for (const auto& [drive, law] : exported.laws) {
    for (const auto& [name, value] : law) {
      if (name != kFrictionSlope) arguments.push_back({drive, name, arguments.size(), value});
    }
  }
  return arguments;
}

std::vector<LawArgument> VaryingLawArguments(const TargetInput& input) {
  std::set<std::size_t> vary;
  for (const ParameterRange& range : input.randomization->ranges) {
    for (const VaryingNumber& number : range.numbers) {
      if (number.field == kLaws) vary.insert(number.row);
    }
  }
  std::vector<LawArgument> arguments = LawArguments(input.exported);
  std::erase_if(arguments, [&](const LawArgument& argument) { return !vary.contains(argument.row); });
  return arguments;
}

std::string LawsText(const TargetInput& input) {
  if (input.exported.laws.empty()) return "";
  std::string text = "# Arguments of gapscope_torch.Drive.\nLAWS = {\n";
  for (const auto& [drive, law] : input.exported.laws) {
    std::map<std::string, std::vector<std::string>> groups;  // "spring" of "spring.stiffness"
    text += fmt::format("  {}: {{\n", PyText(drive));
    for (const auto& [name, number] : law) {
      if (const std::size_t dot = name.find('.'); dot != std::string::npos)
        groups[name.substr(0, dot)].push_back(fmt::format("\"{}\": {}", name.substr(dot + 1), PyNumber(number)));
      else
        text += fmt::format("    \"{}\": {},\n", name, PyNumber(number));
    }
    for (const auto& [group, arguments] : groups)
      text += fmt::format("    \"{}\": {{{}}},\n", group, fmt::join(arguments, ", "));
    text += fmt::format("    \"max_delay_s\": {},\n  }},\n", PyNumber(MostDelay_s(input, drive)));
  }
  return text + "}\n";
}

std::vector<TargetFile> LawFiles(const TargetInput& input) {
  if (input.exported.laws.empty()) return {};
  return {{"gapscope_torch.py", assets::kTorch}};
}

std::string CommandField(const mjModel& model, int actuator) {
  const mjtNum* gain = model.actuator_gainprm + actuator * mjNGAIN;
  const mjtNum* bias = model.actuator_biasprm + actuator * mjNBIAS;
  if (model.actuator_biastype[actuator] != mjBIAS_AFFINE) return "effort";
  if (bias[1] != 0 || gain[0] == 0) return "position";
  return gain[0] == -bias[2] ? "velocity" : "effort";
}

}  // namespace gapscope

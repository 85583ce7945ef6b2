#include "src/model/drive_facts.h"

#include <algorithm>
#include <sstream>
#include <string>
#include <string_view>

#include "src/plugins/motor/law.h"

namespace gapscope {
namespace {

// A live parameter of a plugin instance at the model's own value; 0: not given.
double ParameterOf(const mjModel& m, int instance, const char* key) {
  const std::string name = plugins::InstanceName(&m, instance);
  const int numeric = name.empty() ? -1 : mj_name2id(&m, mjOBJ_NUMERIC, (name + "." + key).c_str());
  if (numeric >= 0) return m.numeric_data[m.numeric_adr[numeric]];
  double value = 0;
  return plugins::ParseNumber(plugins::ConfigText(&m, instance, key), &value) ? value : 0;
}

// What the actuator is to its instance: as `inputs` lists them, in the order of their ids; else the law's own command.
std::string InputOf(const mjModel& m, int instance, int actuator, const plugins::LawTraits& law) {
  const auto before = std::count(m.actuator_plugin, m.actuator_plugin + actuator, instance);
  std::istringstream inputs{std::string(plugins::ConfigText(&m, instance, "inputs"))};
  std::string role;
  for (auto i = before; i >= 0; --i) inputs >> role;
  return inputs.fail() ? plugins::kRoleNames[law.command] : role;
}

}  // namespace

DriveFacts FactsOf(const mjModel& m, int actuator) {
  const int instance = m.actuator_plugin[actuator];
  if (instance < 0) {
    const bool servo =
        m.actuator_biastype[actuator] == mjBIAS_AFFINE && m.actuator_biasprm[actuator * mjNBIAS + 1] != 0;
    return {.feeds_back_position = servo, .holds_position = servo};
  }
  const mjpPlugin* plugin = mjp_getPluginAtSlot(m.plugin[instance]);
  if (!plugin || std::string_view(plugin->name) != plugins::kMotorName) return {};
  const plugins::LawTraits* law = plugins::FindLaw(plugins::ConfigText(&m, instance, "law"));
  if (!law) return {};
  const char* gain = law->position_gain;
  const bool holds = *gain && ParameterOf(m, instance, gain) != 0;
  // The affine law stands in for a native actuator: without a gain it is no servo, and meant to be none.
  const bool servo = *gain && (holds || law->law != plugins::MotorLaw::kAffine);
  const std::string input = InputOf(m, instance, actuator, *law);
  return {.feeds_back_position = servo,
          .holds_position = holds,
          .enables = input == plugins::kRoleNames[plugins::kEnable],
          .input = input};
}

}  // namespace gapscope

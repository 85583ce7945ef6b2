// Live parameters of a plugin instance.
//
// A parameter `key` of the instance `name` is, in this order: the model's `<custom><numeric name="NAME.KEY">` when
// there is one, read anew on every compute, so that it can be changed without recompiling and differentiated by finite
// differences; the `<config key="KEY">` of the instance, parsed once; its neutral value. Structure (laws, tables,
// buffer lengths) stands in `<config>` only.
#ifndef GAPSCOPE_PLUGINS_COMMON_PARAMETERS_H_
#define GAPSCOPE_PLUGINS_COMMON_PARAMETERS_H_

#include <mujoco/mujoco.h>

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace gapscope::plugins {

inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// What becomes of a parameter that two effects set.
enum class Combine { kSum, kLower };
// What a stage needs of the model beside its numbers.
enum class Needs {
  kNothing,
  kActivation,  // one of the first actuator's
  kTurn,        // a computation after the drive's: an actuator of its own
};

// One parameter as its plugin's README lists it.
struct ParameterSpec {
  const char* key;
  const char* unit;
  double neutral;  // the value at which its stage does nothing
  double min, max;
  // For programs that build a model with it.
  Combine combine = Combine::kSum;
  Needs needs = Needs::kNothing;
  const char* native = "";  // the joint's own field that does the same where nothing else is asked for; empty: none
  bool remembers = false;   // a time over which the past acts on
};

// The spec of that key; null: there is none.
inline const ParameterSpec* FindSpec(std::span<const ParameterSpec> specs, std::string_view key) {
  for (const ParameterSpec& spec : specs) {
    if (key == spec.key) return &spec;
  }
  return nullptr;
}

inline std::string InstanceName(const mjModel* m, int instance) {
  const char* name = mj_id2name(m, mjOBJ_PLUGIN, instance);
  return name ? name : "";
}

// The trimmed text of a `<config>`, or of the model's `<custom><text name="NAME.KEY">` where there is no config: the
// way in for programs that build a model through mjSpec, whose attribute map is a C++ object of MuJoCo's own standard
// library. Empty when absent.
inline std::string_view ConfigText(const mjModel* m, int instance, const char* key) {
  const char* text = mj_getPluginConfig(m, instance, key);
  if (!text || !*text) {
    const std::string full = InstanceName(m, instance) + "." + key;
    const int id = full.front() == '.' ? -1 : mj_name2id(m, mjOBJ_TEXT, full.c_str());
    if (id < 0) return {};
    text = m->text_data + m->text_adr[id];
  }
  std::string_view view(text);
  while (!view.empty() && std::isspace(static_cast<unsigned char>(view.front()))) view.remove_prefix(1);
  while (!view.empty() && std::isspace(static_cast<unsigned char>(view.back()))) view.remove_suffix(1);
  return view;
}

// The whole of `text` as a finite number, independent of the locale.
inline bool ParseNumber(std::string_view text, double* value) {
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return code == std::errc() && end == text.data() + text.size() && std::isfinite(*value);
}

// N parameters, in the order of their specs.
template <int N>
class LiveParameters {
 public:
  // Resolves all parameters, whatever is wrong with some. Returns an empty text, or one for the first fault that names
  // the instance, the key, what was found, the allowed range and the cure.
  std::string Resolve(const mjModel* m, int instance, const std::array<ParameterSpec, N>& specs) {
    const std::string name = InstanceName(m, instance);
    std::string fault;
    for (int i = 0; i < N; ++i) {
      const ParameterSpec& spec = specs[i];
      value_[i] = spec.neutral;
      address_[i] = -1;
      const std::string full = name + "." + spec.key;
      if (const int id = name.empty() ? -1 : mj_name2id(m, mjOBJ_NUMERIC, full.c_str()); id >= 0) {
        address_[i] = m->numeric_adr[id];
        value_[i] = m->numeric_data[address_[i]];
      } else if (const std::string_view text = ConfigText(m, instance, spec.key); !text.empty()) {
        if (!ParseNumber(text, &value_[i])) {
          value_[i] = spec.neutral;
          if (fault.empty()) {
            fault = "plugin instance '" + name + "': attribute '" + spec.key + "' is '" + std::string(text) +
                    "', expected a number" + UnitText(spec);
          }
        }
      }
      if (fault.empty() && !(value_[i] >= spec.min && value_[i] <= spec.max)) {
        fault = "plugin instance '" + name + "': attribute '" + spec.key + "' is " + std::to_string(value_[i]) +
                ", allowed " + std::to_string(spec.min) + " to " + std::to_string(spec.max) + UnitText(spec) +
                "; leave it out for " + std::to_string(spec.neutral);
      }
    }
    return fault;
  }

  // The current value of parameter i. No bounds are checked here: a tuner owns the live values.
  double operator()(const mjModel* m, int i) const {
    return address_[i] >= 0 ? m->numeric_data[address_[i]] : value_[i];
  }

  // Whether parameter i can ever differ from `neutral`: its stage is skipped otherwise.
  bool IsNeutral(int i, double neutral) const { return address_[i] < 0 && value_[i] == neutral; }

 private:
  static std::string UnitText(const ParameterSpec& spec) {
    return std::strcmp(spec.unit, "1") == 0 ? std::string() : std::string(" ").append(spec.unit);
  }
  std::array<double, N> value_{};
  std::array<int, N> address_{};
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_PARAMETERS_H_

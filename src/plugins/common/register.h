// What all plugins of ours do alike between MuJoCo and an instance.
#ifndef GAPSCOPE_PLUGINS_COMMON_REGISTER_H_
#define GAPSCOPE_PLUGINS_COMMON_REGISTER_H_

#include <mujoco/mujoco.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <vector>

#include "src/plugins/common/parameters.h"

namespace gapscope::plugins {

// All attributes that `<config>` may hold: those of the structure, and a parameter's key each.
inline std::vector<const char*> AttributesOf(std::span<const ParameterSpec> specs,
                                             std::initializer_list<const char*> structure) {
  std::vector<const char*> attributes = structure;
  for (const ParameterSpec& spec : specs) attributes.push_back(spec.key);
  return attributes;
}

template <class T>
T* InstanceOf(const mjData* d, int instance) {
  return reinterpret_cast<T*>(d->plugin_data[instance]);  // NOLINT(performance-no-int-to-ptr): so MuJoCo keeps it
}

// A plugin whose instances are T: made by T::Create(m, instance) (null: `init` must fail, see refusal.h), with a state
// of `state_size` numbers that a reset zeroes, computed by T::Compute(m, d, capability), told by T::Advance(m, d) that
// a step is over. `attributes` must live as long as the program.
template <class T>
mjpPlugin PluginOf(const char* name, int capabilities, std::span<const char* const> attributes,
                   int (*state_size)(const mjModel* m, int instance)) {
  mjpPlugin plugin;
  mjp_defaultPlugin(&plugin);
  plugin.name = name;
  plugin.capabilityflags = capabilities;
  plugin.nattribute = static_cast<int>(attributes.size());
  plugin.attributes = attributes.data();
  plugin.nstate = state_size;
  plugin.init = +[](const mjModel* m, mjData* d, int instance) {
    std::unique_ptr<T> made = T::Create(m, instance);
    if (!made) return -1;
    d->plugin_data[instance] = reinterpret_cast<uintptr_t>(made.release());
    return 0;
  };
  plugin.destroy = +[](mjData* d, int instance) {
    delete InstanceOf<T>(d, instance);
    d->plugin_data[instance] = 0;
  };
  plugin.reset =
      +[](const mjModel* m, mjtNum* state, void*, int instance) { mju_zero(state, m->plugin_statenum[instance]); };
  plugin.compute = +[](const mjModel* m, mjData* d, int instance, int capability) {
    InstanceOf<const T>(d, instance)->Compute(m, d, capability);
  };
  plugin.advance = +[](const mjModel* m, mjData* d, int instance) { InstanceOf<const T>(d, instance)->Advance(m, d); };
  return plugin;
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_REGISTER_H_

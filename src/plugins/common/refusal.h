// How an instance refuses what it cannot do, without ending the host.
//
// MuJoCo turns `init() == -1` into an error text while a model is compiled (mj_loadXML, mj_compile, Python's from_xml_*
// return or raise it, the text of mju_warning included), but into mju_error, which ends the program, when mj_makeData
// runs on a finished model (run on 4.0.1). So: refuse while compiling, and on a finished model, where only a host
// that edits mjModel gets to, warn and do nothing. A model being compiled has no signature yet.
#ifndef GAPSCOPE_PLUGINS_COMMON_REFUSAL_H_
#define GAPSCOPE_PLUGINS_COMMON_REFUSAL_H_

#include <mujoco/mujoco.h>

#include <cstring>
#include <string>

#include "src/plugins/common/parameters.h"

namespace gapscope::plugins {

inline bool IsCompiling(const mjModel* m) { return m->signature == 0; }

// Says `fault`. True: `init` must return -1; false: carry on without effect.
inline bool Refuse(const mjModel* m, const std::string& fault) {
  const bool compiling = IsCompiling(m);
  mju_warning("%s%s", fault.c_str(), compiling ? "" : "; the instance is left without effect");
  return compiling;
}

// "plugin instance 'NAME': attribute 'KEY' is 'ACTUAL', allowed ALLOWED; CURE"
inline std::string Fault(const mjModel* m, int instance, const char* key, const std::string& actual,
                         const std::string& allowed, const std::string& cure) {
  return "plugin instance '" + InstanceName(m, instance) + "': attribute '" + key + "' is '" + actual + "', allowed " +
         allowed + "; " + cure;
}

// A `<numeric name="INSTANCE.KEY">` whose KEY is none of `keys` is a slip of the pen that would go unseen. Returns the
// fault, or an empty text. Keys with a dot belong to other instances.
inline std::string UnknownNumeric(const mjModel* m, int instance, const char* const* keys, int count) {
  const std::string prefix = InstanceName(m, instance) + ".";
  if (prefix.size() == 1) return {};
  for (int i = 0; i < m->nnumeric; ++i) {
    const std::string name = mj_id2name(m, mjOBJ_NUMERIC, i);
    if (name.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string key = name.substr(prefix.size());
    if (key.find('.') != std::string::npos) continue;
    bool known = false;
    std::string all;
    for (int k = 0; k < count; ++k) {
      known = known || key == keys[k];
      if (k > 0) all += ", ";
      all += keys[k];
    }
    if (!known) {
      return std::string("plugin instance '")
          .append(prefix, 0, prefix.size() - 1)
          .append("': numeric '")
          .append(name)
          .append("' sets no parameter; allowed keys: ")
          .append(all)
          .append("; correct the key or rename the numeric");
    }
  }
  return {};
}

// The hinge or slide joint that `<config key="joint">` names. Returns the fault, or an empty text.
inline std::string ResolveJoint(const mjModel* m, int instance, int* joint) {
  const std::string name(ConfigText(m, instance, "joint"));
  *joint = name.empty() ? -1 : mj_name2id(m, mjOBJ_JOINT, name.c_str());
  if (*joint >= 0 && (m->jnt_type[*joint] == mjJNT_HINGE || m->jnt_type[*joint] == mjJNT_SLIDE)) return {};
  std::string all;
  for (int i = 0; i < m->njnt; ++i) {
    const char* candidate = mj_id2name(m, mjOBJ_JOINT, i);
    if (candidate && (m->jnt_type[i] == mjJNT_HINGE || m->jnt_type[i] == mjJNT_SLIDE)) {
      all += (all.empty() ? "" : ", ") + std::string(candidate);
    }
  }
  return Fault(m, instance, "joint", name,
               "the name of a hinge or slide joint (" + (all.empty() ? "none named" : all) + ")",
               "set <config key=\"joint\" value=\"...\"/>");
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_REFUSAL_H_

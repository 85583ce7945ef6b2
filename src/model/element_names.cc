#include "src/model/element_names.h"

namespace gapscope {

std::string NameOf(const mjModel& m, mjtObj type, int id) {
  const char* name = id < 0 ? nullptr : mj_id2name(&m, type, id);
  return name ? name : "";
}

std::vector<std::string> ElementNames(const mjModel& m, mjtObj type) {
  const auto count = type == mjOBJ_JOINT      ? m.njnt
                     : type == mjOBJ_BODY     ? m.nbody
                     : type == mjOBJ_TENDON   ? m.ntendon
                     : type == mjOBJ_ACTUATOR ? m.nactuator
                     : type == mjOBJ_SENSOR   ? m.nsensor
                                              : m.nnumeric;
  std::vector<std::string> names;
  for (int i = 0; i < static_cast<int>(count); ++i) {
    if (std::string name = NameOf(m, type, i); !name.empty()) names.push_back(std::move(name));
  }
  return names;
}

}  // namespace gapscope

#include "src/export/target.h"

#include <algorithm>

#include "src/core/result.h"

namespace gapscope {
#include "targets_table.inc"

void SayAsMujoco311(mjSpec* spec) {
  for (mjsElement* e = mjs_firstElement(spec, mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec, e))
    mjs_asActuator(e)->ctrlspec = 0;
  const ModelPtr written(mj_compile(spec, nullptr));  // what is written is what was compiled
  GS_CHECK(written != nullptr);
}

const std::vector<ExportTarget>& Targets() {
  static const std::vector<ExportTarget> targets = MakeTargets();
  return targets;
}

const ExportTarget& TargetOf(const std::string& name) {
  const auto found = std::ranges::find(Targets(), name, &ExportTarget::name);
  GS_CHECK(found != Targets().end());
  return *found;
}

}  // namespace gapscope

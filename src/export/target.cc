#include "src/export/target.h"

#include <algorithm>

#include "src/core/collect.h"
#include "src/core/result.h"

namespace gapscope {
#include "targets_table.inc"

bool KeptEffects::Has(const EffectUse& use) const {
  return std::ranges::find(model->effects(), use) != model->effects().end();
}

Result<KeptEffects> KeepEffects(const Model& model, std::span<const double> values,
                                std::span<const char* const> names) {
  std::vector<EffectUse> uses;
  std::ranges::copy_if(model.effects(), std::back_inserter(uses), [&](const EffectUse& use) {
    return std::ranges::any_of(names, [&](const char* name) { return use.effect == name; });
  });
  KeptEffects kept;
  GS_ASSIGN(kept.model, Model::Build(model.rig(), uses, {}));
  kept.values = Collect(kept.model->parameters(), [&](const Parameter& parameter) {
    return values[static_cast<std::size_t>(model.IndexOf(parameter.name))];
  });
  return kept;
}

NativeEffect LeftOut(const Model& model, const EffectUse& use, const std::string& why_dropped) {
  const std::string& host = EffectOf(use, *model.rig()).host;
  return host.empty() ? NativeEffect{use, Fidelity::kDropped, why_dropped} : NativeEffect{use, Fidelity::kHost, host};
}

int DriveOn(const mjModel& model, int joint) {
  for (int a = 0; a < model.nactuator; ++a) {
    if (model.actuator_trntype[a] == mjTRN_JOINT && model.actuator_trnid[2 * a] == joint) return a;
  }
  return -1;
}

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

// One blind-check case of an arm: as ../case.h, for plants of several driven joints.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_CASE_H_
#define GAPSCOPE_TESTS_TWIN_ARM_CASE_H_

#include <string>
#include <vector>

#include "tests/twin/arm/effects.h"
#include "tests/twin/arm/gap.h"
#include "tests/twin/arm/recorder.h"
#include "tests/twin/case.h"
#include "tests/twin/output.h"

namespace gapscope::twin {

struct ArmEffect {
  ArmChoice choice;
  Values parameters, extra;
  Gap gap;
  bool clear = true;
  double beside_torques = 0;
};

struct ArmCase {
  Kind kind = Kind::kNone;
  std::uint64_t seed = 0, index = 0;
  bool nominal_base = false;
  ArmPlant base, truth;  // without and with everything
  ArmSensors sensors;
  std::vector<ArmLog> logs;
  std::vector<ArmEffect> effects;
  std::vector<Label::Roughness> roughness;
  double rough_refit = 0;
  Gap gap;  // all effects together, roughness too
};

// Kinds none, single, pair, triple, rough, auto. Errors (another kind, an effect or place that is not there; an effect
// that cannot be made visible) come as text in `problem`.
bool MakeArmCase(const CaseRequest& request, ArmRig rig, ArmCase* made, std::string* problem);

std::vector<ArmRecord> MakeArmRecords(const ArmCase& c, bool noise, double step_s = 1e-4);
Label LabelOf(const ArmCase& c);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_CASE_H_

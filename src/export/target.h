// Where a result can be taken to. Each target is a file of targets/, which says what it acts on and what it writes.
#ifndef GAPSCOPE_EXPORT_TARGET_H_
#define GAPSCOPE_EXPORT_TARGET_H_

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "src/export/randomize.h"
#include "src/model/model.h"
#include "src/model/native.h"

namespace gapscope {

// What a target's own files are made of.
struct TargetInput {
  const Model& model;
  std::span<const double> values;  // of the model's parameters
  const ExportedModel& exported;
  const Randomization* randomization;  // null: none was asked for
  std::string mjcf;                    // the name of the written MJCF
};
struct TargetFile {
  std::string name, text;
};

struct ExportTarget {
  std::string name;          // of --to
  std::string what;          // for people
  bool plugins = false;      // it runs our plugin library
  NativeFeatures has = {};   // where it does not
  bool mujoco_3_11 = false;  // it reads that version's MJCF
  bool mjcf = true;          // it reads one at all; else `files` are all that is written
  // The model with what the target has of it; null: Export's with plugins, ExportNative's without.
  Result<ExportedModel> (*make)(const Model& model, std::span<const double> values) = nullptr;
  // Files beside the MJCF; null: none. Errors: the model has no form there.
  Result<std::vector<TargetFile>> (*files)(const TargetInput& input) = nullptr;
};

// A model with some of its effects alone, and their values.
struct KeptEffects {
  std::shared_ptr<const Model> model;
  std::vector<double> values;
  bool Has(const EffectUse& use) const;
};
// Those of these names. `values`: of the model's parameters.
Result<KeptEffects> KeepEffects(const Model& model, std::span<const double> values, std::span<const char* const> names);
// What becomes of one that is not kept: the host's where it can, else dropped.
NativeEffect LeftOut(const Model& model, const EffectUse& use, const std::string& why_dropped);

// The actuator that drives a joint, the first one on it; -1: none.
int DriveOn(const mjModel& model, int joint);

// Leaves out of a compiled spec what no MJCF of MuJoCo 3.11 says: the `input` of actuators of one control, whose law
// stands in their gain and bias.
void SayAsMujoco311(mjSpec* spec);

// All, by name.
const std::vector<ExportTarget>& Targets();
// One of their names.
const ExportTarget& TargetOf(const std::string& name);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_TARGET_H_

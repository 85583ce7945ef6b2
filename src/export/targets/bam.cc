// Parameter files of BAM (https://github.com/Rhoban/bam at 1b5a1ce: bam/model.py for the friction models m1 to m6,
// bam/actuator.py and the families beside it for the drives), one for each servo that is driven by its duty cycle.
#include <fmt/core.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/core/statistics.h"
#include "src/experiment/expression.h"
#include "src/export/target.h"
#include "src/model/element_names.h"
#include "src/plugins/common/parameters.h"

namespace gapscope {
namespace {

// A family of servos: duty = error_gain kp (target - q), at most `most`. A file cannot say these: they are BAM's code.
struct Family {
  const char* actuator;
  double error_gain, most;
  bool ratio;  // the file may scale the gain
};
constexpr Family kFamilies[] = {{"xl330", 4096 / (2 * std::numbers::pi) / (256 * 885), 1, false},
                                {"xl320", 0.05048199, 1, false},
                                {"mx106", 0.158, 0.9625, false},
                                {"sts3215", 0.166, 0.97, true}};

// Effects that are terms of BAM's friction.
constexpr const char* kFriction[] = {"coulomb_friction", "stribeck_friction", "load_friction"};

Error NoBam(const Model& model, const std::string& what, const std::string& actual, const std::string& allowed) {
  return {.what = what,
          .where = model.experiment().model_path,
          .actual = actual,
          .allowed = allowed,
          .cure = "export it with its plugins: --to mujoco"};
}

// The model with what BAM has of it.
Result<ExportedModel> MakeBam(const Model& model, std::span<const double> values) {
  GS_ASSIGN(const KeptEffects kept, KeepEffects(model, values, kFriction));
  GS_ASSIGN(ExportedModel exported, kept.model->Export(kept.values, nullptr, {}));
  exported.native = Collect(model.effects(), [&](const EffectUse& use) -> NativeEffect {
    if (kept.Has(use)) return {use, Fidelity::kExact, "a term of BAM's friction"};
    return LeftOut(model, use, "no parameter of BAM's");
  });
  return exported;
}

class BamWriter {
 public:
  BamWriter(const TargetInput& input, int actuator)
      : input_(input),
        compiled_(*input.exported.compiled),
        joint_(compiled_.actuator_trnid[2 * actuator]),
        drive_(NameOf(compiled_, mjOBJ_PLUGIN, compiled_.actuator_plugin[actuator])) {}

  Result<TargetFile> File() const;

 private:
  // A live number of a plugin instance; `otherwise` where it has none.
  double Number(const std::string& instance, const std::string& key, double otherwise) const {
    const int id = mj_name2id(&compiled_, mjOBJ_NUMERIC, (instance + "." + key).c_str());
    return id < 0 ? otherwise : compiled_.numeric_data[compiled_.numeric_adr[id]];
  }
  Result<double> ErrorGain() const;
  Result<const Family*> FamilyOf(double error_gain) const;

  const TargetInput& input_;
  const mjModel& compiled_;
  int joint_;
  std::string drive_;  // its plugin instance
};

// Duty for a radian of error and one unit of the servo's own gain, which the logs' headers say.
Result<double> BamWriter::ErrorGain() const {
  const Experiment& experiment = input_.model.experiment();
  const std::string field = "numeric/" + drive_ + ".duty_gain";
  const auto set = std::ranges::find(experiment.settings, field, &FieldSetting::field);
  const auto gain = std::ranges::find(experiment.values, "kp", &LogValue::header);
  if (set == experiment.settings.end() || gain == experiment.values.end() ||
      !Mentions(set->expressions.front(), gain->name))
    return NoBam(input_.model, "the servo's own gain is not known apart from its duty gain", "",
                 field + " set from a value with `header: kp`");
  std::map<std::string, double> numbers;
  for (const LogValue& value : experiment.values) numbers[value.name] = 1;
  for (std::size_t i = 0; i < input_.values.size(); ++i) numbers[input_.model.parameters()[i].name] = input_.values[i];
  return EvaluateOnce(set->expressions.front(), numbers, experiment.path);
}

Result<const Family*> BamWriter::FamilyOf(double error_gain) const {
  const double most = Number(drive_, "duty_limit", 1);
  for (const Family& family : kFamilies) {
    const bool same = family.ratio || std::abs(error_gain / family.error_gain - 1) < 1e-3;
    if (same && std::abs(most - family.most) < 1e-6) return &family;
  }
  std::vector<std::string> known;
  for (const Family& family : kFamilies)
    known.push_back(fmt::format("{} {:.5g} to {:.4g}", family.actuator, family.error_gain, family.most));
  return NoBam(input_.model, "no family of BAM's has the duty gain and limit of '" + drive_ + "'",
               fmt::format("{:.5g} to {:.4g}", error_gain, most), Join(known));
}

Result<TargetFile> BamWriter::File() const {
  const double kt = Number(drive_, "kt", kNaN), ke = Number(drive_, "ke", kNaN);
  if (std::abs(ke - kt) > 1e-9 * kt)
    return NoBam(input_.model, "the back-EMF constant of '" + drive_ + "' is not its torque constant",
                 fmt::format("{:.5g} and {:.5g}", ke, kt), "one constant for both");
  GS_ASSIGN(const double error_gain, ErrorGain());
  GS_ASSIGN(const Family* family, FamilyOf(error_gain));
  const int dof = compiled_.jnt_dofadr[joint_];
  const std::string friction = NameOf(compiled_, mjOBJ_JOINT, joint_) + ".friction";
  const double level = Number(friction, "friction_n_m", compiled_.dof_frictionloss[dof]);
  const double hump = std::max(0.0, Number(friction, "breakaway_n_m", 0) - level);
  const double load = Number(friction, "load_coefficient", 0);
  nlohmann::ordered_json json = {{"kt", kt}, {"R", Number(drive_, "resistance", kNaN)}};
  if (family->ratio) json["error_gain_ratio"] = error_gain / family->error_gain;
  json["armature"] = compiled_.dof_armature[dof];
  json["friction_base"] = level;
  if (load > 0)
    json.update({{"load_friction_motor", load},
                 {"load_friction_external", 0.0},
                 {"load_friction_motor_stribeck", 0.0},
                 {"load_friction_external_stribeck", 0.0}});
  if (load > 0 || hump > 0) {
    json["friction_stribeck"] = hump;
    json["dtheta_stribeck"] = hump > 0 ? Number(friction, "stribeck_speed_rad_per_s", 1) : 1;
    json["alpha"] = Number(friction, "stribeck_exponent", 2);
  }
  json["friction_viscous"] = compiled_.dof_damping[dof];
  json["model"] = load > 0 ? "m5" : hump > 0 ? "m2" : "m1";
  json["actuator"] = family->actuator;
  std::string name = drive_;
  std::ranges::replace_if(name, [](unsigned char c) { return !std::isalnum(c); }, '_');
  return TargetFile{"bam_" + name + ".json", json.dump(2) + "\n"};
}

Result<std::vector<TargetFile>> WriteBam(const TargetInput& input) {
  const mjModel& compiled = *input.exported.compiled;
  std::vector<TargetFile> files;
  for (int a = 0; a < compiled.nactuator; ++a) {
    const int instance = compiled.actuator_plugin[a];
    const bool first = instance >= 0 && (a == 0 || compiled.actuator_plugin[a - 1] != instance);
    if (!first || plugins::ConfigText(&compiled, instance, "law") != "duty") continue;
    GS_ASSIGN(files.emplace_back(), BamWriter(input, a).File());
  }
  if (files.empty())
    return NoBam(input.model, "no drive is a servo by duty cycle, which is what BAM's files describe", "",
                 "gapscope.motor with law duty");
  return files;
}

}  // namespace

ExportTarget Target_bam() {
  return {.name = "bam",
          .what = "BAM, a file for each servo",
          .plugins = true,
          .mjcf = false,
          .make = MakeBam,
          .files = WriteBam};
}

}  // namespace gapscope

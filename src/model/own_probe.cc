#include "src/model/own_probe.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "src/core/collect.h"
#include "src/experiment/expression.h"
#include "src/model/rig.h"
#include "src/plugins/common/parser.h"
#include "src/plugins/expression/expression.h"

namespace gapscope {
namespace {

constexpr int kMotions = 12;

// Nothing about these motions is special: no zero, both signs.
std::array<double, plugins::kFormulaInputCount> Motion(int k) {
  std::array<double, plugins::kFormulaInputCount> motion{};
  motion[plugins::kAngle] = 1.9 * std::sin(1.7 * k);
  motion[plugins::kSpeed] = 5.3 * std::sin(2.3 * k + 0.4);
  motion[plugins::kCommand] = 3.1 * std::cos(1.1 * k);
  motion[plugins::kTime] = 0.83 * k;
  return motion;
}

// Fields are taken at the base model's nominal parameters.
class FormulaProbe : public OwnProbe {
 public:
  FormulaProbe(const OwnEffect& own, const Experiment& experiment) : OwnProbe(own) {
    std::vector<std::string> names, texts = {own.torque};
    if (own.torque.empty()) {
      for (const Parameter& p : experiment.parameters) names.push_back(p.name), variables_.push_back(p.nominal);
      for (const LogValue& v : experiment.values) names.push_back(v.name), variables_.push_back(v.fallback.value_or(1));
      texts.clear();
      for (const FieldSetting& s : own.settings) texts.insert(texts.end(), s.expressions.begin(), s.expressions.end());
    } else {
      names.assign(plugins::kFormulaInputs.begin(), plugins::kFormulaInputs.end());
      variables_.assign(names.size(), 0);
    }
    first_ = names.size();
    for (const OwnParameter& p : own.parameters) names.push_back(p.key), variables_.push_back(p.neutral);
    for (const std::string& text : texts)
      expressions_.push_back(Expression::Parse(text, names, variables_.data(), own.where).value());
  }

  Values At(const Values& parameters) override {
    std::copy(parameters.begin(), parameters.end(), variables_.begin() + static_cast<std::ptrdiff_t>(first_));
    Values values;
    const int motions = own_.torque.empty() ? 1 : kMotions;
    for (int k = 1; k <= motions; ++k) {
      if (!own_.torque.empty()) std::ranges::copy(Motion(k), variables_.begin());
      for (const Expression& expression : expressions_) values.push_back(expression.Evaluate());
    }
    return values;
  }

  bool IsOfMotion() override {
    if (!own_.torque.empty()) {
      return !Mentions(own_.torque, plugins::kFormulaInputs[plugins::kCommand]) &&
             !Mentions(own_.torque, plugins::kFormulaInputs[plugins::kTime]);
    }
    return std::all_of(own_.settings.begin(), own_.settings.end(), [](const FieldSetting& s) {
      const std::string last = s.field.substr(s.field.rfind('/') + 1);
      return s.field.starts_with("joint/") &&
             (last.starts_with("damping") || last.starts_with("stiffness") || last == "springref");
    });
  }

 private:
  Values variables_;
  std::size_t first_ = 0;  // of the candidate's parameters in variables_
  std::vector<Expression> expressions_;
};

// The passive forces of the rig with the plugin less those of the rig.
class PluginProbe : public OwnProbe {
 public:
  PluginProbe(const OwnEffect& own, const Rig& rig, ModelPtr model)
      : OwnProbe(own),
        base_(rig.compiled()),
        base_data_(mj_makeData(&base_)),
        model_(std::move(model)),
        data_(mj_makeData(model_.get())),
        joint_(mj_name2id(&base_, mjOBJ_JOINT, own.joint.c_str())) {
    const std::string drive = rig.ActuatorOf(own.joint);
    actuator_ = drive.empty() ? -1 : mj_name2id(&base_, mjOBJ_ACTUATOR, drive.c_str());
    for (const OwnParameter& p : own.parameters) {
      const std::string name = OwnInstance(own.joint, own.name) + "." + p.key;
      addresses_.push_back(model_->numeric_adr[mj_name2id(model_.get(), mjOBJ_NUMERIC, name.c_str())]);
    }
  }

  Values At(const Values& parameters) override { return Torques(parameters, true); }

  bool IsOfMotion() override {
    const Values moved = Collect(own_.parameters, Moved);
    return Torques(moved, true) == Torques(moved, false);
  }

 private:
  // `driven`: with a command and at a time other than zero.
  Values Torques(const Values& parameters, bool driven) {
    for (std::size_t i = 0; i < parameters.size(); ++i) model_->numeric_data[addresses_[i]] = parameters[i];
    Values values;
    for (int k = 1; k <= kMotions; ++k) {
      const auto motion = Motion(k);
      Move(base_, base_data_.get(), motion, driven);
      Move(*model_, data_.get(), motion, driven);
      for (int i = 0; i < base_.nv; ++i) values.push_back(data_->qfrc_passive[i] - base_data_->qfrc_passive[i]);
    }
    return values;
  }
  void Move(const mjModel& m, mjData* d, const std::array<double, plugins::kFormulaInputCount>& motion,
            bool driven) const {
    mj_resetData(&m, d);
    d->qpos[m.jnt_qposadr[joint_]] = motion[plugins::kAngle];
    d->qvel[m.jnt_dofadr[joint_]] = motion[plugins::kSpeed];
    if (driven && actuator_ >= 0) d->ctrl[actuator_] = motion[plugins::kCommand];
    if (driven) d->time = motion[plugins::kTime];
    mj_forward(&m, d);
  }

  const mjModel& base_;
  DataPtr base_data_;
  ModelPtr model_;
  DataPtr data_;
  int joint_, actuator_ = -1;
  std::vector<int> addresses_;
};

}  // namespace

OwnProbe::Values OwnProbe::AtNeutral() { return At(Collect(own_.parameters, &OwnParameter::neutral)); }

OwnProbe::Values OwnProbe::Alone(std::size_t i) {
  Values values = Collect(own_.parameters, &OwnParameter::neutral);
  values[i] = Moved(own_.parameters[i]);
  return At(values);
}

OwnProbe::Values OwnProbe::Beside(std::size_t i, double value) {
  Values values = Collect(own_.parameters, Moved);
  values[i] = value;
  return At(values);
}

double OwnProbe::Moved(const OwnParameter& p) {
  Values values = p.trials;
  values.insert(values.begin(), p.start);
  values.insert(values.end(), {p.high, p.low});
  return *std::find_if(values.begin(), values.end(), [&](double value) { return value != p.neutral; });
}

Structure::OwnTorque TorqueOf(const OwnEffect& own, const std::map<std::string, std::string>& names) {
  const bool formula = own.plugin.empty();
  return {.name = own.name,
          .joint = own.joint,
          .plugin = formula ? plugins::Expression::kName : own.plugin,
          .config = formula ? std::map<std::string, std::string>{{"torque", own.torque}} : own.config,
          .of_command = Mentions(own.torque, plugins::kFormulaInputs[plugins::kCommand]),
          .parameters = names};
}

std::unique_ptr<OwnProbe> MakeFormulaProbe(const OwnEffect& own, const Experiment& experiment) {
  return std::make_unique<FormulaProbe>(own, experiment);
}

Result<std::unique_ptr<OwnProbe>> MakePluginProbe(const OwnEffect& own, const Rig& rig) {
  int slot = -1;
  const mjpPlugin* plugin = mjp_getPlugin(own.plugin.c_str(), &slot);
  if (!plugin) {
    return Error{.what = "no library that is loaded registers the plugin '" + own.plugin + "'",
                 .where = own.torque_where,
                 .cure = "name its library with --plugin FILE"};
  }
  if (!(plugin->capabilityflags & mjPLUGIN_PASSIVE)) {
    return Error{.what = "the plugin '" + own.plugin + "' is not passive: it makes no torque on a joint",
                 .where = own.torque_where};
  }
  Structure structure(rig);
  std::map<std::string, std::string> parameters;
  for (const OwnParameter& p : own.parameters) {
    structure.AddParameter({.name = p.key, .unit = p.unit, .nominal = p.neutral, .low = p.low, .high = p.high});
    parameters[p.key] = p.key;
  }
  structure.AddOwnTorque(TorqueOf(own, parameters));
  GS_RETURN_IF_ERROR(structure.Finish());
  ModelPtr model(mj_compile(structure.spec.get(), nullptr));
  if (!model) {
    return Error{
        .what = "the plugin '" + own.plugin + "' refuses the model: " + OneLine(mjs_getError(structure.spec.get())),
        .where = own.torque_where};
  }
  return std::unique_ptr<OwnProbe>(std::make_unique<PluginProbe>(own, rig, std::move(model)));
}

}  // namespace gapscope

#include "src/plugins/expression/expression.h"

#include <algorithm>
#include <cmath>

#include "src/plugins/common/refusal.h"
#include "src/plugins/common/register.h"
#include "src/plugins/motor/history.h"

namespace gapscope::plugins {
namespace {

constexpr double kLongestDelay_s = 10;

std::string GivenMaxDelay(const mjModel* m, int instance) {
  const char* text = mj_getPluginConfig(m, instance, "max_delay_s");
  return text ? text : "";
}

// A custom text that held it would not be there yet when MuJoCo asks for the state's size: hence a default.
double DelayToKeep(const mjModel* m, int instance) {
  double value = 0;
  if (ParseNumber(GivenMaxDelay(m, instance), &value)) return value;
  const std::string numeric = InstanceName(m, instance) + "." + kFormulaDelay;
  return mj_name2id(m, mjOBJ_NUMERIC, numeric.c_str()) >= 0 ? kDefaultMaxDelay_s : 0;
}

}  // namespace

int Expression::StateSize(const mjModel* m, int instance) {
  constexpr double kStepRefinement = 4;  // of the model's step, that a host may take
  const double max_delay = DelayToKeep(m, instance);
  if (!(max_delay > 0) || max_delay > kLongestDelay_s) return 0;
  const double steps = std::min(std::ceil(max_delay * kStepRefinement / m->opt.timestep) + 2, 1e6);
  return kSlots + History::Size(static_cast<int>(steps), 1);
}

std::unique_ptr<Expression> Expression::Create(const mjModel* m, int instance) {
  auto expression = std::make_unique<Expression>();
  const std::string problem = expression->Resolve(m, instance);
  if (problem.empty()) return expression;
  expression->dof_ = -1;
  return Refuse(m, problem) ? nullptr : std::move(expression);
}

std::string Expression::Resolve(const mjModel* m, int instance) {
  int joint = -1;
  if (std::string fault = ResolveJoint(m, instance, &joint); !fault.empty()) return fault;
  dof_ = m->jnt_dofadr[joint];
  angle_address_ = m->jnt_qposadr[joint];
  const std::string actuator(ConfigText(m, instance, "actuator"));
  const int id = actuator.empty() ? -1 : mj_name2id(m, mjOBJ_ACTUATOR, actuator.c_str());
  if (!actuator.empty() && id < 0) {
    return Fault(m, instance, "actuator", actuator, "the name of an actuator, whose command the formula reads",
                 "correct it, or leave it out where the formula reads no command");
  }
  if (id >= 0) ctrl_address_ = m->actuator_ctrladr[id];
  if (std::string fault = ResolveDelay(m, instance); !fault.empty()) return fault;
  return ResolveFormula(m, instance);
}

std::string Expression::ResolveDelay(const mjModel* m, int instance) {
  if (std::string fault = live_.Resolve(m, instance, kSpecs); !fault.empty()) return fault;
  const std::string text = GivenMaxDelay(m, instance);
  max_delay_s_ = DelayToKeep(m, instance);
  if (!text.empty() && !(max_delay_s_ > 0 && max_delay_s_ <= kLongestDelay_s))
    return Fault(m, instance, "max_delay_s", text, "0 to 10 s, above 0", "leave it out for no delay");
  if (live_(m, kLateCommand) > max_delay_s_) {
    return Fault(m, instance, "command_delay_s", std::to_string(live_(m, kLateCommand)),
                 "0 to max_delay_s = " + std::to_string(max_delay_s_) + " s", "raise max_delay_s");
  }
  state_ = m->plugin_stateadr[instance];
  capacity_ = max_delay_s_ > 0 ? History::Capacity(m->plugin_statenum[instance] - kSlots, 1) : 0;
  return {};
}

std::string Expression::ResolveFormula(const mjModel* m, int instance) {
  const std::string text(ConfigText(m, instance, "torque"));
  const auto fault = [&](const std::string& why) {
    return Fault(m, instance, "torque", text.substr(0, 200),
                 "a formula of angle, speed, command, time and numerics of the instance", why);
  };
  if (text.empty()) return fault("set <config key=\"torque\" value=\"...\"/>");
  if (IsTooLong(text)) return fault("it is too long: shorten it");
  if (Assigns(text)) return fault("it assigns: compare with '=='");
  try {
    SetText(&parser_, text);
    std::vector<std::string> names;
    for (const auto& [name, unbound] : parser_.GetUsedVar()) names.push_back(name);
    if (std::string missing = ResolveNames(m, instance, names); !missing.empty()) return missing;
    parser_.Eval();
    if (parser_.GetNumResults() != 1) return fault("it has several values: write one");
  } catch (const mu::Parser::exception_type& e) {
    return fault(e.GetMsg());
  }
  return {};
}

std::string Expression::ResolveNames(const mjModel* m, int instance, const std::vector<std::string>& names) {
  const std::string prefix = InstanceName(m, instance) + ".";
  std::vector<const char*> keys = {kSpecs[kLateCommand].key};
  parameters_.resize(names.size());
  for (std::size_t i = 0; i < kFormulaInputCount; ++i) parser_.DefineVar(kFormulaInputs[i], &inputs_[i]);
  for (const std::string& name : names) {
    if (name == kFormulaInputs[kCommand] && ctrl_address_ < 0) {
      return Fault(m, instance, "actuator", "", "the actuator whose command the formula reads",
                   "set <config key=\"actuator\" value=\"...\"/>");
    }
    if (std::find(kFormulaInputs.begin(), kFormulaInputs.end(), name) != kFormulaInputs.end()) continue;
    const std::string full = prefix + name;
    const int id = mj_name2id(m, mjOBJ_NUMERIC, full.c_str());
    if (id < 0) {
      return Fault(m, instance, "torque", name, "angle, speed, command, time, pi and numerics of the instance",
                   "add <numeric name=\"" + full + "\" data=\"...\"/>");
    }
    parser_.DefineVar(name, &parameters_[addresses_.size()]);
    addresses_.push_back(m->numeric_adr[id]);
    keys.push_back(name.c_str());
  }
  return UnknownNumeric(m, instance, keys.data(), static_cast<int>(keys.size()));
}

double Expression::Command(const mjModel* m, mjData* d) const {
  const double now = d->ctrl[ctrl_address_];
  if (capacity_ == 0) return now;
  double* slots = d->plugin_state + state_;
  History history(slots + kSlots, capacity_, 1);
  // RK4 computes at later times of the same step: its command is the one that the step began with.
  const bool later = m->opt.integrator == mjINT_RK4 && slots[kStepOpen] != 0 && d->time > slots[kStepTime] &&
                     d->time <= slots[kStepTime] + m->opt.timestep * (1 + 1e-9);
  if (!later) {
    slots[kStepOpen] = 1;
    slots[kStepTime] = d->time;
    history.Open(d->time, 0, 0, &now);
  }
  double mean = 0;
  history.MeanCommand(std::clamp(live_(m, kLateCommand), 0.0, max_delay_s_), m->opt.timestep, &mean);
  return mean;
}

void Expression::Compute(const mjModel* m, mjData* d, int) const {
  if (dof_ < 0) return;
  inputs_ = {d->qpos[angle_address_], d->qvel[dof_], ctrl_address_ < 0 ? 0 : Command(m, d), d->time};
  for (std::size_t i = 0; i < addresses_.size(); ++i) parameters_[i] = m->numeric_data[addresses_[i]];
  // A torque that does not exist ends the simulation as a divergence: nothing is thrown into the engine.
  try {
    d->qfrc_passive[dof_] += parser_.Eval();
  } catch (const mu::Parser::exception_type&) {
    d->qfrc_passive[dof_] = std::numeric_limits<double>::quiet_NaN();
  }
}

void Expression::Advance(const mjModel*, mjData* d) const {
  if (dof_ < 0 || capacity_ == 0) return;
  double* slots = d->plugin_state + state_;
  if (slots[kStepOpen] == 0) return;
  slots[kStepOpen] = 0;
  History(slots + kSlots, capacity_, 1).Close();
}

void RegisterExpression() {
  static const std::vector<const char*> attributes =
      AttributesOf(Expression::kSpecs, {"joint", "torque", "actuator", "max_delay_s"});
  const mjpPlugin plugin = PluginOf<Expression>(Expression::kName, mjPLUGIN_PASSIVE, attributes, Expression::StateSize);
  mjp_registerPlugin(&plugin);
}

}  // namespace gapscope::plugins

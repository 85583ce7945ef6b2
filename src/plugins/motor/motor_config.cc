#include "src/plugins/motor/motor_config.h"

#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "src/plugins/motor/history.h"

namespace gapscope::plugins {
namespace {

// How much finer than the model's own a time step may be by default.
constexpr double kStepRefinement = 2;

std::string Problem(const mjModel* m, int instance, const std::string& text) {
  return "gapscope.motor instance '" + InstanceName(m, instance) + "': " + text;
}

std::string Bad(const mjModel* m, int instance, const char* key, std::string_view found, const std::string& allowed,
                const std::string& cure = "") {
  return Problem(m, instance,
                 "attribute '" + std::string(key) + "' is '" + std::string(found) + "', allowed " + allowed +
                     (cure.empty() ? "" : "; " + cure));
}

std::vector<std::string_view> Words(std::string_view text) {
  std::vector<std::string_view> words;
  const char* blanks = " \t\r\n,";
  for (std::size_t at = text.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(blanks, end);
  }
  return words;
}

bool HasNumeric(const mjModel* m, int instance, const char* key) {
  const std::string name = InstanceName(m, instance);
  return !name.empty() && mj_name2id(m, mjOBJ_NUMERIC, (name + "." + key).c_str()) >= 0;
}

bool Given(const mjModel* m, int instance, const char* key) {
  return !ConfigText(m, instance, key).empty() || HasNumeric(m, instance, key);
}

int FirstActuator(const mjModel* m, int instance) {
  int first = 0;
  while (first < m->nactuator && m->actuator_plugin[first] != instance) ++first;
  return first;
}

// The sizes of the history, by what is known while compiling; 0 when the instance keeps none.
double MaxDelay(const mjModel* m, int instance) {
  double value = 0;
  if (ParseNumber(ConfigText(m, instance, "max_delay_s"), &value)) return value;
  for (const char* key : {"command_delay_s", "torque_delay_s"}) {
    if (HasNumeric(m, instance, key)) return kDefaultMaxDelay_s;
    if (ParseNumber(ConfigText(m, instance, key), &value) && value > 0) return kDefaultMaxDelay_s;
  }
  return 0;
}

// A list of numbers; false when one is none.
bool Numbers(std::string_view text, std::vector<double>* values) {
  for (const std::string_view word : Words(text)) {
    double value;
    if (!ParseNumber(word, &value)) return false;
    values->push_back(value);
  }
  return true;
}

// The parts of Parse, in its order: each returns an empty text, or what is wrong.

std::string ParseLawAndInputs(const mjModel* m, int instance, MotorConfig* config) {
  const std::string_view law_text = ConfigText(m, instance, "law");
  const LawTraits* chosen = FindLaw(law_text);
  if (!chosen) {
    return Bad(m, instance, "law", law_text, "position, torque, current, voltage, duty, affine");
  }
  config->law = chosen->law;
  config->input_of.fill(-1);
  const std::string_view input_text = ConfigText(m, instance, "inputs");
  std::vector<std::string_view> words = Words(input_text);
  if (words.empty()) words.push_back(kRoleNames[chosen->command]);
  config->inputs = static_cast<int>(words.size());
  for (int i = 0; i < config->inputs; ++i) {
    int role = 0;
    while (role < kRoles && words[i] != kRoleNames[role]) ++role;
    if (role == kRoles || config->input_of[role] >= 0) {
      return Bad(m, instance, "inputs", input_text,
                 "each of target, velocity, torque, current, voltage, feedforward, supply, enable at most once",
                 "remove '" + std::string(words[i]) + "'");
    }
    config->input_of[role] = i;
  }
  config->command = config->input_of[chosen->command];
  if (config->law == MotorLaw::kAffine) {
    for (const MotorRole role : {kTorque, kCurrent, kVoltage}) {
      if (config->command < 0) config->command = config->input_of[role];
    }
  }
  if (config->command < 0) {
    return Bad(m, instance, "inputs", input_text, "a list with '" + std::string(kRoleNames[chosen->command]) + "'",
               "that is what law '" + std::string(chosen->name) + "' follows");
  }
  return {};
}

// As many as roles, on one joint, nothing that the engine would do to a native one.
std::string CheckActuators(const mjModel* m, int instance, MotorConfig* config) {
  int found = 0;
  const int first = FirstActuator(m, instance);
  for (int i = 0; i < m->nactuator; ++i) {
    if (m->actuator_plugin[i] != instance) continue;
    ++found;
    const std::string name = mj_id2name(m, mjOBJ_ACTUATOR, i) ? mj_id2name(m, mjOBJ_ACTUATOR, i) : "";
    if (m->actuator_ctrlnum[i] != 1 || m->actuator_outnum[i] != 1) {
      return Problem(m, instance, "actuator '" + name + "' has several controls or forces, allowed one of each");
    }
    if (m->actuator_dyntype[i] != mjDYN_NONE && m->actuator_dyntype[i] != mjDYN_USER) {
      return Problem(m, instance, "actuator '" + name + "' has a native dyntype, allowed none; use time_constant_s");
    }
    if (m->actuator_delay[i] != 0) {
      return Problem(m, instance, "actuator '" + name + "' has a native delay, allowed 0; use command_delay_s");
    }
    if (m->actuator_trntype[i] != m->actuator_trntype[first] ||
        m->actuator_trnid[2 * i] != m->actuator_trnid[2 * first]) {
      return Problem(m, instance,
                     "actuator '" + name +
                         "' is not on the joint of the first one, allowed one joint per "
                         "instance; make another instance");
    }
  }
  if (found != config->inputs) {
    return Problem(m, instance,
                   "attribute 'inputs' lists " + std::to_string(config->inputs) + " role(s) but " +
                       std::to_string(found) +
                       " actuator(s) name this instance, allowed as many; list "
                       "one role per actuator, in the order of the actuators");
  }
  return {};
}

std::string ParseDeadZone(const mjModel* m, int instance, MotorConfig* config) {
  const std::string_view dead_text = ConfigText(m, instance, "dead_zone_on");
  if (!dead_text.empty() && dead_text != "command" && dead_text != "torque")
    return Bad(m, instance, "dead_zone_on", dead_text, "command, torque");
  const bool default_on = config->law == MotorLaw::kVoltage || config->law == MotorLaw::kCurrent;
  config->dead_zone_on_command = dead_text.empty() ? default_on : dead_text == "command";
  return {};
}

std::string ResolveNumbers(const mjModel* m, int instance, MotorConfig* config) {
  const std::string problem = config->live.Resolve(m, instance, kMotorSpecs);
  return problem.empty() ? problem : "gapscope.motor " + problem;
}

// What the law cannot do without.
std::string CheckNeeds(const mjModel* m, int instance, MotorConfig* config) {
  const std::string law_name = FindLaw(ConfigText(m, instance, "law"))->name;
  const auto needs = [&](std::initializer_list<const char*> keys) -> std::string {
    for (const char* key : keys) {
      if (!Given(m, instance, key)) {
        return Problem(m, instance,
                       "attribute '" + std::string(key) + "' is missing, law '" + law_name +
                           "' needs it; add <config key=\"" + key + "\" value=\"...\"/>");
      }
    }
    return "";
  };
  std::string problem;
  if (config->law == MotorLaw::kPosition) problem = needs({"kp"});
  if (config->law == MotorLaw::kCurrent) problem = needs({"kt"});
  if (config->law == MotorLaw::kVoltage) problem = needs({"kt", "ke", "resistance"});
  if (config->law == MotorLaw::kDuty) problem = needs({"duty_gain", "kt", "ke", "resistance"});
  if (config->law == MotorLaw::kDuty && problem.empty() && config->input_of[kSupply] < 0) problem = needs({"supply_v"});
  return problem;
}

std::string ParseDelays(const mjModel* m, int instance, MotorConfig* config) {
  const std::string_view max_text = ConfigText(m, instance, "max_delay_s");
  if (double value; !max_text.empty() && (!ParseNumber(max_text, &value) || value < 0 || value > 10)) {
    return Bad(m, instance, "max_delay_s", max_text, "0 to 10 s",
               "leave it out for " + std::to_string(kDefaultMaxDelay_s));
  }
  const std::string_view step_text = ConfigText(m, instance, "min_timestep_s");
  if (double value; !step_text.empty() && (!ParseNumber(step_text, &value) || !(value >= 1e-6) || value > 1)) {
    return Bad(m, instance, "min_timestep_s", step_text, "1e-6 to 1 s", "leave it out for half the model's time step");
  }
  config->max_delay_s = MaxDelay(m, instance);
  if (const double delay = config->live(m, kCommandDelay) + config->live(m, kTorqueDelay);
      delay > config->max_delay_s) {
    return Problem(m, instance,
                   "attributes 'command_delay_s' and 'torque_delay_s' add up to " + std::to_string(delay) +
                       " s, allowed 0 to max_delay_s = " + std::to_string(config->max_delay_s) +
                       " s; raise max_delay_s");
  }
  return {};
}

std::string ParseSpeedTables(const mjModel* m, int instance, MotorConfig* config) {
  const std::string_view interpolation_text = ConfigText(m, instance, "table_interpolation");
  if (!interpolation_text.empty() && interpolation_text != "linear" && interpolation_text != "cubic") {
    return Bad(m, instance, "table_interpolation", interpolation_text, "linear, cubic", "leave it out for linear");
  }
  const auto interpolation =
      interpolation_text == "cubic" ? SpeedTable::Interpolation::kMonotoneCubic : SpeedTable::Interpolation::kLinear;
  const std::string_view speed_text = ConfigText(m, instance, "speed_table");
  std::vector<double> speed;
  bool good = Numbers(speed_text, &speed) && (speed_text.empty() || speed.size() >= 2);
  for (std::size_t i = 0; i < speed.size(); ++i) good = good && speed[i] >= 0 && (i == 0 || speed[i] > speed[i - 1]);
  if (!good) {
    return Bad(m, instance, "speed_table", speed_text, "two or more numbers >= 0 in rad/s, strictly ascending");
  }
  for (const auto& [key, table] :
       {std::pair{"torque_table", &config->motoring}, std::pair{"generating_torque_table", &config->generating}}) {
    const std::string_view text = ConfigText(m, instance, key);
    if (text.empty()) continue;
    std::vector<double> torque;
    good = Numbers(text, &torque) && torque.size() == speed.size();
    for (const double value : torque) good = good && value >= 0;
    if (!good) {
      return Bad(m, instance, key, text,
                 "as many numbers >= 0 in N m as speed_table has (" + std::to_string(speed.size()) + ")");
    }
    table->Set(speed, std::move(torque), interpolation);
  }
  if (!speed.empty() && config->motoring.empty() && config->generating.empty()) {
    return Problem(m, instance,
                   "attribute 'speed_table' stands alone, allowed with torque_table or "
                   "generating_torque_table; add one");
  }
  return {};
}

// Activations for what the engine integrates.
std::string CheckActivations(const mjModel* m, int instance, MotorConfig* config) {
  int needed = 0;
  for (const MotorParameter p : {kTimeConstant, kSecondTimeConstant, kSagFraction})
    needed += !config->live.IsNeutral(p, 0);
  if (m->actuator_actnum[FirstActuator(m, instance)] < needed) {
    return Problem(m, instance,
                   "the first actuator has actdim " + std::to_string(m->actuator_actnum[FirstActuator(m, instance)]) +
                       ", allowed at least " + std::to_string(needed) +
                       " (one each for time_constant_s, second_time_constant_s, sag_fraction where they "
                       "are used); write actdim=\"" +
                       std::to_string(needed) + "\" on that <plugin>");
  }
  return {};
}

// A supply that sags needs a ceiling to sag.
std::string CheckSag(const mjModel* m, int instance, MotorConfig* config) {
  bool ceiling = !config->motoring.empty() || config->law == MotorLaw::kDuty || Given(m, instance, "supply_v") ||
                 config->input_of[kSupply] >= 0 || m->actuator_forcelimited[FirstActuator(m, instance)];
  for (const MotorParameter p : {kTorqueLimit, kPower, kPeakTorque}) ceiling = ceiling || !config->live.IsNeutral(p, 0);
  if (!config->live.IsNeutral(kSagFraction, 0) && !ceiling) {
    return Problem(m, instance,
                   "attribute 'sag_fraction' needs a ceiling that sags; give torque_limit_n_m, "
                   "peak_torque_n_m, power_w, torque_table, forcerange, or supply_v");
  }
  return {};
}

}  // namespace

int MotorStateSize(const mjModel* m, int instance) {
  const double max_delay = MaxDelay(m, instance);
  if (!(max_delay > 0) || max_delay > 10) return MotorState::kSlots;
  double step = 0;
  if (!ParseNumber(ConfigText(m, instance, "min_timestep_s"), &step) || !(step > 0)) {
    step = m->opt.timestep / kStepRefinement;
  }
  const int inputs = std::max<int>(1, static_cast<int>(Words(ConfigText(m, instance, "inputs")).size()));
  // One sample beyond the delay's start, one for the step that the mean reaches back.
  const double steps = std::min(std::ceil(max_delay / step) + 2, 1e6);
  return MotorState::kSlots + History::Size(static_cast<int>(steps), inputs);
}

std::string MotorConfig::Parse(const mjModel* m, int instance) {
  for (const auto part : {ParseLawAndInputs, CheckActuators, ParseDeadZone, ResolveNumbers, CheckNeeds, ParseDelays,
                          ParseSpeedTables, CheckActivations, CheckSag}) {
    if (std::string problem = part(m, instance, this); !problem.empty()) return problem;
  }
  return {};
}

}  // namespace gapscope::plugins

// The second half of a Structure that must do without our plugins: terms become what MuJoCo has itself, exactly, nearly
// or not at all, and what became of each effect is told.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "src/experiment/expression.h"
#include "src/model/structure.h"

namespace gapscope {
namespace {

bool FeedsBack(const std::vector<mjsActuator*>& inputs) {
  return std::any_of(inputs.begin(), inputs.end(),
                     [](const mjsActuator* input) { return input->biasprm[1] != 0 || input->biasprm[2] != 0; });
}

std::string Term(const std::string& group, const std::string& place, const std::string& key) {
  return fmt::format("{}/{}/{}", group, place, key);
}

}  // namespace

std::string FidelityName(Fidelity fidelity) {
  switch (fidelity) {
    case Fidelity::kExact:
      return "exact";
    case Fidelity::kApproximated:
      return "approximated";
    case Fidelity::kHost:
      return "host";
    case Fidelity::kDropped:
      return "dropped";
  }
  return "";
}

double SentCommand::Of(double command) const {
  const double live = std::copysign(std::max(std::abs(command) - dead_zone, 0.0), command);
  return live * (1 + (live > 0 ? asymmetry : -asymmetry));
}

double Structure::ValueIn(const Terms& terms, const std::string& key) const {
  const auto term = terms.find(key);
  return term == terms.end() ? 0 : value_of(term->second);
}

double Structure::ValueOf(const std::string& field, double own) const {
  const auto set = std::find_if(settings.begin(), settings.end(), [&](const auto& s) { return s.field == field; });
  return set == settings.end() ? own : value_of(set->expressions.front());
}

void Structure::Enter(const std::string& group, const std::string& place, const std::string& key) {
  if (entering) owners_[Term(group, place, key)].push_back(*entering);
}

// The worst of what becomes of an effect's terms is what becomes of it.
void Structure::Tell(const std::string& group, const std::string& place, const std::string& key, Fidelity fidelity,
                     const std::string& how, bool by_law) {
  for (const EffectUse& use : OwnersOf(group, place, key)) TellOf({use, fidelity, how, by_law});
}

std::vector<EffectUse> Structure::OwnersOf(const std::string& group, const std::string& place,
                                           const std::string& key) const {
  std::string entered = place;  // before its joint was split
  for (const auto& [joint, motor] : motor_joint) {
    if (motor == place) entered = joint;
  }
  const auto owners = owners_.find(Term(group, entered, key));
  return owners == owners_.end() ? std::vector<EffectUse>{} : owners->second;
}

void Structure::TellOf(const NativeEffect& effect) {
  const auto of = std::ranges::find(told, effect.use, &NativeEffect::use);
  if (of == told.end()) {
    told.push_back(effect);
    return;
  }
  const bool by_law = of->by_law || effect.by_law;  // of one on all drives, of which some have a law
  if (effect.fidelity > of->fidelity) *of = effect;
  of->by_law = by_law;
}

Status Structure::FinishNative() {
  if (mjs_firstElement(spec.get(), mjOBJ_PLUGIN)) {
    return Error{.what = "the MJCF itself has plugins: it has no form without them",
                 .where = rig_.experiment().model_path,
                 .allowed = "native elements",
                 .cure = "export it with them: --to mujoco"};
  }
  if (!features.tendons) {
    for (const Split& split : splits)
      Tell(kSplitTerms, split.joint, "", Fidelity::kDropped, "nothing links two joints there: motor and load are one");
    splits.clear();
  }
  for (const Split& split : splits) FinishSplit(split);
  const std::set<std::string> by_law = LawJoints();
  for (const std::string& joint : by_law) NativeLaw(joint);
  for (const auto& [joint, terms] : motor_) {
    if (!by_law.contains(joint)) NativeMotor(joint, terms);
  }
  for (const auto& [joint, terms] : friction_) GS_RETURN_IF_ERROR(NativeFriction(joint, terms));
  for (const auto& [joint, terms] : spring_) {
    if (!(SpringsByLaw() && by_law.contains(joint))) NativeSpring(joint, terms);
  }
  for (const OwnTorque& torque : own_torques_)
    TellOf({{torque.name, torque.joint}, Fidelity::kDropped, "a formula of the experiment's own has no native form"});
  return Ok();
}

// amplitude sin(per_rad q + phase) on a joint, by a motor without an input.
Fidelity Structure::AddPassive(const std::string& joint, double amplitude, double per_rad, double phase) {
  if (amplitude == 0) return Fidelity::kExact;
  if (features.passive_motors == PassiveMotors::kHost)
    return ActuatorsOn(joint).empty() ? Fidelity::kDropped : Fidelity::kHost;
  mjsActuator* actuator = nullptr;
  if (features.passive_motors != PassiveMotors::kNone) {
    const bool idle = features.passive_motors == PassiveMotors::kIdleInput;
    constexpr double kLeast = 1e-9;  // a motor with an input must have a constant
    actuator = mjs_addActuator(spec.get(), nullptr);
    double constants[2] = {idle ? kLeast : 0, idle ? kLeast : 0}, ripple[3] = {amplitude, per_rad, phase};
    mjs_setToDCMotor(actuator, constants, 1, nullptr, nullptr, nullptr, ripple, nullptr, nullptr, nullptr,
                     idle ? mjINPUT_VOLTAGE : mjINPUT_NONE);
  } else if (per_rad == 0) {
    actuator = mjs_addActuator(spec.get(), nullptr);
    actuator->gainprm[0] = 0;
    actuator->biastype = mjBIAS_AFFINE;
    actuator->biasprm[0] = amplitude * std::sin(phase);
  } else {
    return Fidelity::kDropped;
  }
  int count = 0;
  std::string name;
  do name = fmt::format("{}.passive{}", joint, count++ ? fmt::format("_{}", count) : "");
  while (mjs_findElement(spec.get(), mjOBJ_ACTUATOR, name.c_str()));
  mjs_setName(actuator->element, name.c_str());
  actuator->trntype = mjTRN_JOINT;
  mjs_setString(actuator->target, joint.c_str());
  return Fidelity::kExact;
}

void Structure::NativeSpring(const std::string& joint, const Terms& terms) {
  const auto value = [&](const char* key) { return ValueIn(terms, key); };
  const auto tell = [&](const char* key, Fidelity fidelity, const std::string& how) {
    Tell(kSpringTerms, joint, key, fidelity, how);
  };
  const auto passive = [&](const char* key, double amplitude, double per_rad, double phase) {
    const Fidelity done = AddPassive(joint, amplitude, per_rad, phase);
    tell(key, done,
         done == Fidelity::kExact ? "a motor that nobody drives, its torque a sine of the angle"
         : done == Fidelity::kHost
             ? fmt::format("add {:.4g} sin({:.4g} q + {:.4g}) N m to the drive's torque", amplitude, per_rad, phase)
             : "no torque of an angle there");
  };
  NativeElastic(joint, terms);
  passive("gravity_n_m", value("gravity_n_m"), 1, std::numbers::pi - value("gravity_rest_rad"));
  passive("bias_n_m", value("bias_n_m"), 0, 0.5 * std::numbers::pi);
  passive("cogging_n_m", value("cogging_n_m"), value("cogging_periods_per_rev"), value("cogging_phase_rad"));
  if (value("stop_n_m_per_rad") > 0) {
    Terms stop = terms;
    if (features.tendons) AddStop(joint, &stop);
    tell("stop_n_m_per_rad", features.tendons ? Fidelity::kExact : Fidelity::kDropped,
         features.tendons ? "a tendon whose spring is slack before the stop" : "no soft stop there");
  }
}

// Springs add up to one: k1 (q - r1) + k2 (q - r2) = (k1 + k2) (q - r).
void Structure::NativeElastic(const std::string& joint, const Terms& terms) {
  const char* keys[] = {"stiffness_n_m_per_rad", "rest_rad", "cubic_n_m_per_rad3"};
  if (std::none_of(std::begin(keys), std::end(keys), [&](const char* key) { return terms.contains(key); })) return;
  const auto value = [&](const char* key) { return ValueIn(terms, key); };
  if (!features.springs_on_drives && !ActuatorsOn(joint).empty()) {
    const std::string cubic = value(keys[2]) != 0 ? fmt::format(" {:+.4g} x^3", -value(keys[2])) : "";
    const std::string how = fmt::format("add {:.4g} x{} N m, x = q {:+.4g} rad, to the drive's torque", -value(keys[0]),
                                        cubic, -value(keys[1]));
    for (const char* key : keys) Tell(kSpringTerms, joint, key, Fidelity::kHost, how);
    return;
  }
  mjsJoint* element = FindJoint(joint);
  const std::string field = "joint/" + joint + "/";
  const double own = ValueOf(field + "stiffness", element->stiffness[0]);
  const double own_rest = ValueOf(field + "springref", element->springref);
  const double own_cubic = ValueOf(field + "stiffness_cubic", element->stiffness[2]);
  const double added = value(keys[0]), rest = value(keys[1]), cubic = value(keys[2]);
  const double sum = own + added;
  const double common = sum != 0 ? (own * own_rest + added * rest) / sum : rest;
  const bool one_rest = own == 0 || std::abs(own_rest - rest) < 1e-12;
  Put(field + "stiffness", sum);
  Put(field + "springref", common);
  for (const char* key : keys) Tell(kSpringTerms, joint, key, Fidelity::kExact, "the joint's own spring");
  if (cubic == 0 && own_cubic == 0) return;
  const bool kept = features.polynomials && one_rest && (own_cubic == 0 || own_rest == rest);
  if (kept) Put(field + "stiffness_cubic", own_cubic + cubic);
  if (!kept && cubic != 0)
    Tell(kSpringTerms, joint, keys[2], added != 0 ? Fidelity::kApproximated : Fidelity::kDropped,
         features.polynomials ? "without its cubic term: the joint's own spring rests elsewhere"
                              : "without its cubic term: springs are linear there");
}

Status Structure::NativeFriction(const std::string& joint, const Terms& terms) {
  const auto value = [&](const char* key) { return ValueIn(terms, key); };
  const auto tell = [&](const char* key, Fidelity fidelity, const std::string& how) {
    Tell(kFrictionTerms, joint, key, fidelity, how);
  };
  const std::string on = MotorSide(joint);
  const double positive = value("friction_positive_n_m"), negative = value("friction_negative_n_m");
  const double level = value("friction_n_m") + 0.5 * (positive + negative);
  tell("friction_n_m", Fidelity::kExact, "the joint's own dry friction");
  Terms own;
  if (terms.contains("friction_n_m") || level > 0) own["friction_n_m"] = ExactText(level);
  if (const auto drag = terms.find("quadratic_n_m_s2_per_rad2"); drag != terms.end()) {
    if (features.polynomials) own.insert(*drag);
    tell(drag->first.c_str(), features.polynomials ? Fidelity::kExact : Fidelity::kDropped,
         features.polynomials ? "the joint's own quadratic damping" : "damping is linear there");
  }
  if (!own.empty()) GS_RETURN_IF_ERROR(FinishFriction(joint, own));
  // While it slides, friction by direction is constant friction and a constant torque.
  const bool both = AddPassive(on, -0.5 * (positive - negative), 0, 0.5 * std::numbers::pi) == Fidelity::kExact;
  for (const char* key : {"friction_positive_n_m", "friction_negative_n_m"})
    tell(key, both ? Fidelity::kExact : Fidelity::kApproximated,
         both ? "dry friction of the mean, and a constant torque" : "dry friction of the mean");
  const auto drive = ActuatorsOn(joint);
  const auto law = drive.empty() ? laws.end() : laws.find(mjs_getString(mjs_getName(drive.front()->element)));
  if (law != laws.end() && law->second.contains(kFrictionSlope)) return Ok();
  tell("breakaway_n_m", Fidelity::kApproximated, "dry friction of its level at speed: it breaks away at that");
  tell("load_coefficient", Fidelity::kDropped, "friction in proportion to a load has no native form");
  return Ok();
}

void Structure::NativeDelay(const std::string& joint, const std::string& key, double delay_s,
                            const std::vector<mjsActuator*>& inputs) {
  const double step_s = spec->option.timestep, steps = delay_s / step_s;
  const bool counted = features.delays == CommandDelays::kWholeSteps;
  double* counted_s = counted ? &delays_s[mjs_getString(mjs_getName(inputs.front()->element))] : nullptr;
  if (delay_s <= 0) return;
  const std::string in_steps = fmt::format("{:.4g} ms, {:.3g} steps of {:.4g} ms", 1e3 * delay_s, steps, 1e3 * step_s);
  if (features.delays == CommandDelays::kNone || (!counted && steps < 1)) {
    Tell(kMotorTerms, joint, key, Fidelity::kHost,
         fmt::format(
             "send commands {} later: {}", in_steps,
             features.delays == CommandDelays::kNone ? "actuators have no delay there" : "less than a step is none"));
    return;
  }
  const bool whole = std::abs(steps - std::round(steps)) < 1e-6;
  const bool late_feedback = FeedsBack(inputs) && key == "torque_delay_s";
  if (late_feedback && !MakeFeedbackLate(joint, {delay_s, 0.5 * delay_s * delay_s}, inputs)) {
    Tell(kMotorTerms, joint, key, Fidelity::kDropped,
         fmt::format("feedback {} late has no native form: that is too long for the joint's inertia", in_steps));
    return;
  }
  const char* how_late = late_feedback ? "; that of its feedback by less damping and other inertia or gains" : "";
  if (counted_s) {
    *counted_s += delay_s;
    Tell(kMotorTerms, joint, key, whole && !late_feedback ? Fidelity::kExact : Fidelity::kApproximated,
         fmt::format("commands {} steps late for {}{}", std::lround(steps), in_steps, how_late));
    return;
  }
  for (mjsActuator* input : inputs) {
    input->delay += delay_s;
    input->nsample = std::max(input->nsample, static_cast<int>(std::ceil(input->delay / step_s - 1e-6)) + 1);
    input->interp = whole ? 0 : 1;
  }
  // MuJoCo's last stage is at the end of a step.
  const bool early = spec->option.integrator == mjINT_RK4 && !features.late_in_stages;
  Tell(kMotorTerms, joint, key, late_feedback || early ? Fidelity::kApproximated : Fidelity::kExact,
       "the actuator's own delay of " + in_steps + ", full of zeros at a reset" +
           (early ? ", by RK4 up to a step less" : "") + how_late);
}

void Structure::Put(const std::string& field, double number) {
  std::erase_if(settings, [&](const FieldSetting& setting) { return setting.field == field; });
  Set(field, {ExactText(number)});
}

// kp q(t - D) + kv q'(t - D), to second order in D: kp q + (kv - kp D) q' + (kp D^2 / 2 - kv D) q''. (Of a lag D: kp
// D^2.) The last term is inertia. Where the armature has less than that takes off, the rest is taken off by a drive
// whose torques are larger by as much as the joint's inertia is then too large: J q'' = T s is (J / s) q'' = T. False:
// there is no such drive.
bool Structure::MakeFeedbackLate(const std::string& joint, Lateness late, const std::vector<mjsActuator*>& inputs) {
  constexpr double kLeastInertia = 0.3;  // share of the joint's that must be left for the series to say anything
  struct Gains {
    std::string field;
    double gain = 0, kp = 0, kv = 0;  // at the drive, before its gear
  };
  std::vector<Gains> drives;
  double change = 0;
  const double gear = inputs.front()->gear[0];
  for (const mjsActuator* input : inputs) {
    const std::string field = std::string("actuator/") + mjs_getString(mjs_getName(input->element)) + "/";
    const double kp = ValueOf(field + "kp", -ValueOf(field + "bias1", input->biasprm[1])),
                 kv = ValueOf(field + "kv", -ValueOf(field + "bias2", input->biasprm[2]));
    if (kp == 0 && kv == 0) continue;
    const double gain = ValueOf(field + "gain", ValueOf(field + "kp", input->gainprm[0]));
    drives.push_back({field, gain, kp, kv - kp * late.first_s});
    change += gear * gear * (kp * late.second_s2 - kv * late.first_s);
  }
  const std::string place = "joint/" + joint + "/";
  const mjsJoint& element = *FindJoint(joint);
  const double armature = ValueOf(place + "armature", element.armature) + change;
  double larger = 1;
  if (armature < 0) {
    const mjModel& m = rig_.compiled();
    const int dof = m.jnt_dofadr[mj_name2id(&m, mjOBJ_JOINT, joint.c_str())];
    const double inertia = m.dof_M0[dof] - m.dof_armature[dof];
    if (!(inertia + armature > kLeastInertia * inertia)) return false;
    larger = inertia / (inertia + armature);
  }
  Put(place + "armature", std::max(0.0, armature));
  const double passive = (larger - 1) * ValueOf(place + "damping", element.damping[0]) / (gear * gear);
  for (const Gains& drive : drives) {
    Put(drive.field + "kp", larger * drive.kp);
    Put(drive.field + "kv", larger * drive.kv + (&drive == &drives.front() ? passive : 0));
    Put(drive.field + "gain", larger * drive.gain);
  }
  return true;
}

// The command passes an activation. Feedback does not: it is late by other gains, for alone the command's lag would be
// of the motion, which the loop takes out. On a drive without position feedback the second lag is the command's.
void Structure::NativeLag(const std::string& joint, const Terms& terms, const std::vector<mjsActuator*>& inputs) {
  const double lag = ValueIn(terms, "time_constant_s"), second = ValueIn(terms, "second_time_constant_s");
  if (lag <= 0) return;
  const auto tell = [&](Fidelity fidelity, const std::string& how) {
    Tell(kMotorTerms, joint, "time_constant_s", fidelity, how);
  };
  if (!features.lags) return tell(Fidelity::kDropped, "actuators have no lag there");
  const bool feeds_back = FeedsBack(inputs);
  const double beyond = inputs.front()->biasprm[1] != 0 ? second : 0;
  const Lateness late{lag + beyond, lag * lag + lag * beyond + beyond * beyond};
  if (feeds_back && !MakeFeedbackLate(joint, late, inputs))
    return tell(Fidelity::kDropped, "a lag of feedback has no native form: it is too long for the joint's inertia");
  for (mjsActuator* input : inputs) {
    input->dyntype = mjDYN_FILTEREXACT;
    input->dynprm[0] = lag + second;
    input->actdim = 1;
  }
  const bool exact = !feeds_back && second == 0;
  tell(exact ? Fidelity::kExact : Fidelity::kApproximated,
       feeds_back ? "one pole of the command; that of its feedback by less damping and other inertia or gains"
       : exact    ? "an activation of one pole"
                  : "one pole of the command for two");
}

void Structure::NativeMotor(const std::string& joint, const Terms& terms) {
  const auto value = [&](const char* key) { return ValueIn(terms, key); };
  const auto tell = [&](const char* key, Fidelity fidelity, const std::string& how) {
    Tell(kMotorTerms, joint, key, fidelity, how);
  };
  const std::vector<mjsActuator*> inputs = ActuatorsOn(joint);
  for (const char* key : {"command_delay_s", "torque_delay_s"}) {
    if (terms.contains(key)) NativeDelay(joint, key, value(key), inputs);
  }
  // A sagging limit lies between itself and 1 / (1 + sag) of it, under lasting load: their harmonic mean.
  const double sag = value("sag_fraction");
  if (const double limit = value("torque_limit_n_m") / (1 + 0.5 * sag); limit > 0 && std::isfinite(limit)) {
    const double most = limit * std::abs(inputs.front()->gear[0]);
    mjsJoint* element = FindJoint(joint);
    const bool limited = element->actfrclimited == mjLIMITED_TRUE;
    element->actfrcrange[0] = limited ? std::max(element->actfrcrange[0], -most) : -most;
    element->actfrcrange[1] = limited ? std::min(element->actfrcrange[1], most) : most;
    element->actfrclimited = mjLIMITED_TRUE;
    const double softness = value("limit_softness");
    tell("torque_limit_n_m", softness > 0.02 ? Fidelity::kApproximated : Fidelity::kExact,
         "the joint's own limit of actuator forces" +
             (softness > 0.02 ? fmt::format(", its corner sharp where {:.2g} of it is round", softness) : ""));
  }
  NativeLag(joint, terms, inputs);
  NativeSent(joint, terms, inputs);
  for (const char* key : {"droop_at_peak", "power_w"})
    tell(key, Fidelity::kDropped, "the drive's law has no native form");
  const double limit = value("torque_limit_n_m");
  const bool limited = limit > 0 && std::isfinite(limit);
  tell("sag_fraction", limited ? Fidelity::kApproximated : Fidelity::kDropped,
       limited ? fmt::format("a limit that does not fall: of {:.4g} N m without load and {:.4g} under lasting load the "
                             "harmonic mean",
                             limit, limit / (1 + sag))
               : "the drive's law has no native form");
}

// Of a torque that nothing is fed back to, and of any command, it is the command's.
void Structure::NativeSent(const std::string& joint, const Terms& terms, const std::vector<mjsActuator*>& inputs) {
  const std::string drive = mjs_getString(mjs_getName(inputs.front()->element));
  const bool feeds_back = FeedsBack(inputs);
  const auto by_sender = [&](const char* key, const std::string& how) {
    for (const EffectUse& use : OwnersOf(kMotorTerms, joint, key))
      TellOf({.use = use, .fidelity = Fidelity::kHost, .how = how, .by_sender = true});
  };
  SentCommand command;
  if (const double width = ValueIn(terms, "dead_zone"); terms.contains("dead_zone")) {
    const bool of_command = IsElectric(rig_.KindOfCommand(drive));
    if (of_command || !feeds_back) {
      const double gain = ValueOf("actuator/" + drive + "/gain", inputs.front()->gainprm[0]);
      command.dead_zone = of_command ? width : width / std::abs(gain);
      by_sender("dead_zone",
                fmt::format("take {:.4g} off the command's size, down to zero, before it is sent", command.dead_zone));
    } else {
      Tell(kMotorTerms, joint, "dead_zone", Fidelity::kDropped, "no torque of a servo near zero: no form");
    }
  }
  const double of_torque = ValueIn(terms, "asymmetry");
  const bool has_form = !feeds_back || of_torque == 0;
  if (has_form) command.asymmetry = ValueIn(terms, "command_asymmetry") + of_torque;
  for (const char* key : {"command_asymmetry", "asymmetry"}) {
    if (has_form)
      by_sender(key, fmt::format("send commands (1 + {0:.4g} sign u) u", command.asymmetry));
    else
      Tell(kMotorTerms, joint, key, Fidelity::kDropped, "gain by the torque's sign: no form");
  }
  if (command.dead_zone != 0 || command.asymmetry != 0) sent[drive] = command;
}

}  // namespace gapscope

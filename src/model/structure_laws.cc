// Drives that code of ours stands for beside an MJCF without plugins (gapscope.torch): which they are, and their laws.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "src/model/structure.h"

namespace gapscope {
namespace {

bool Limited(int flag, const double* range) {
  return flag == mjLIMITED_TRUE || (flag == mjLIMITED_AUTO && range[0] < range[1]);
}

// What gapscope.torch calls a term of a joint's springs.
std::string SpringArgument(const std::string& key) {
  static const std::map<std::string, std::string> kOthers = {{"stiffness_n_m_per_rad", "spring.stiffness"},
                                                             {"cubic_n_m_per_rad3", "spring.cubic"},
                                                             {"cogging_periods_per_rev", "spring.cogging_periods"},
                                                             {"stop_n_m_per_rad", "stop.stiffness"},
                                                             {"stop_rad", "stop.stop_rad"}};
  const auto other = kOthers.find(key);
  return other == kOthers.end() ? "spring." + key : other->second;
}

constexpr double kShareOfStop = 0.5;  // of the speed that a law's friction may take away in a step

}  // namespace

// Late commands are the engine's own, where nothing else is there; so is a limit where the engine has the drive's gains
// itself, by the implicit integrator that a law in their place would do without.
std::set<std::string> Structure::LawJoints() const {
  std::set<std::string> joints;
  if (!features.drive_laws) return joints;
  std::set<std::string> own = {"command_delay_s"};
  if (SpringsByLaw()) own.insert({"torque_limit_n_m", "limit_softness"});
  for (const auto& [joint, terms] : motor_) {
    if (std::ranges::any_of(terms, [&](const auto& term) { return !own.contains(term.first); })) joints.insert(joint);
  }
  for (const auto& [joint, terms] : spring_) {
    if (SpringsByLaw() && !ActuatorsOn(joint).empty()) joints.insert(joint);
  }
  const bool all = std::ranges::all_of(joints, [&](const std::string& joint) { return TakesLaw(joint); });
  return all ? joints : std::set<std::string>{};
}

// A plain servo or motor, whose limit is the same both ways. Plain motors beside it (feed-forward) get no command
// there.
bool Structure::TakesLaw(const std::string& joint) const {
  const std::vector<mjsActuator*> inputs = ActuatorsOn(joint);
  const bool plain = std::ranges::all_of(inputs, [&](const mjsActuator* input) {
    const bool affine = input->biastype == mjBIAS_AFFINE && input == inputs.front();
    return !input->plugin.active && input->gaintype == mjGAIN_FIXED && input->dyntype == mjDYN_NONE &&
           (affine || input->biastype == mjBIAS_NONE) && input->gear[0] == inputs.front()->gear[0] &&
           (input == inputs.front() || !Limited(input->ctrllimited, input->ctrlrange));
  });
  const mjsActuator& drive = *inputs.front();
  return plain && (!Limited(drive.forcelimited, drive.forcerange) || drive.forcerange[0] == -drive.forcerange[1]);
}

void Structure::TellLaw(const std::string& group, const std::string& joint, const std::string& key) {
  Tell(group, joint, key, Fidelity::kExact, "the drive's law in PyTorch, beside the MJCF", true);
}

void Structure::NativeLaw(const std::string& joint) {
  const mjsActuator& input = *ActuatorsOn(joint).front();
  const std::string drive = mjs_getString(mjs_getName(input.element));
  DriveLaw& law = laws[drive];
  const bool volts = IsElectric(rig_.KindOfCommand(drive)),
             servo = input.biastype == mjBIAS_AFFINE && input.biasprm[1] != 0;
  if (const auto motor = motor_.find(joint); motor != motor_.end()) {
    for (const auto& [key, expression] : motor->second) {
      std::string argument = key;
      if (volts && key == "dead_zone") argument = "command_dead_zone";
      if (!servo && key == "second_time_constant_s") argument = "command_time_constant_s";  // an amplifier's
      law[argument] = value_of(expression);
      TellLaw(kMotorTerms, joint, key);
    }
  }
  if (Limited(input.forcelimited, input.forcerange)) {
    const double most = input.forcerange[1];
    double& limit = law["torque_limit_n_m"];
    limit = limit > 0 ? std::min(limit, most) : most;
    law["force_limit_n_m"] = most;  // MuJoCo's own, after all that the drive does
  }
  if (Limited(input.ctrllimited, input.ctrlrange))
    law["command_low"] = input.ctrlrange[0], law["command_high"] = input.ctrlrange[1];
  NativeLawFriction(joint, &law);
  const auto spring = spring_.find(joint);
  if (!SpringsByLaw() || spring == spring_.end()) return;
  for (const auto& [key, expression] : spring->second) {
    law[SpringArgument(key)] = value_of(expression);
    TellLaw(kSpringTerms, joint, key);
  }
  if (const mjsJoint* element = FindJoint(joint); law.contains("stop.stop_rad"))
    law["stop.middle_rad"] = 0.5 * (element->range[0] + element->range[1]);
}

// Friction that the engine's solver lacks, of a drive that has a law anyway: for it alone the gains would be explicit,
// which costs more than it brings. Sliding, it is the plugin's. Where that holds, the law is damping, so steep that it
// takes a share of the speed away in a step.
void Structure::NativeLawFriction(const std::string& joint, DriveLaw* law) {
  const auto friction = friction_.find(joint);
  if (friction == friction_.end()) return;
  const Terms& terms = friction->second;
  const double gear = std::abs(ActuatorsOn(joint).front()->gear[0]),
               slope = kShareOfStop * inertia_of(joint) / spec->option.timestep;
  if (!terms.contains("load_coefficient") && !terms.contains("breakaway_n_m")) return;
  if (!(slope > 0)) return;  // a log says the inertia
  const auto told_as = [&](const char* key, const char* what) {
    Tell(kFrictionTerms, joint, key, Fidelity::kApproximated,
         fmt::format("{} by the drive's law in PyTorch, which creeps where it should hold: damping of {:.3g} N m s/rad",
                     what, slope));
  };
  (*law)[kFrictionSlope] = slope / (gear * gear);
  if (terms.contains("load_coefficient")) {
    (*law)["friction.load_coefficient"] = ValueIn(terms, "load_coefficient");
    told_as("load_coefficient", "dry friction in proportion to the drive's torque");
  }
  if (terms.contains("breakaway_n_m")) {
    const double level =
        ValueIn(terms, "friction_n_m") + ValueOf("joint/" + joint + "/frictionloss", FindJoint(joint)->frictionloss);
    (*law)["friction.hump_n_m"] = std::max(0.0, ValueIn(terms, "breakaway_n_m") - level) / gear;
    (*law)["friction.hump_speed_rad_per_s"] = gear * ValueIn(terms, "stribeck_speed_rad_per_s");
    told_as("breakaway_n_m", "the hump of dry friction");
  }
}

}  // namespace gapscope

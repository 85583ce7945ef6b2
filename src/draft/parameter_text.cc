#include "src/draft/parameter_text.h"

#include <algorithm>
#include <set>

#include "src/core/mujoco_handles.h"
#include "src/draft/yaml_text.h"
#include "src/experiment/added_actuators.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

struct Proposal {
  std::string element, unit;
  double nominal, low, high;
  std::string field = "", comment = "";  // an added actuator's parameters set their fields themselves
};

// What the joint carries, weighed at the distance of its centre of mass: about as much torque as its drive is made for.
double WeightOn(const mjModel& m, int joint) {
  const DataPtr data(mj_makeData(&m));
  mj_kinematics(&m, data.get());
  mj_comPos(&m, data.get());
  const int body = m.jnt_bodyid[joint];
  const double weight = m.body_subtreemass[body] * mju_norm3(m.opt.gravity);
  return m.jnt_type[joint] == mjJNT_SLIDE ? weight
                                          : weight * mju_dist3(data->subtree_com + 3 * body, data->xanchor + 3 * joint);
}

class Writer {
 public:
  Writer(const mjModel& model, const Pairing& pairing) : m_(model), p_(pairing) {}

  std::string Run(const std::vector<ServoGains>& gains) {
    for (std::size_t a = 0; a < gains.size(); ++a) {
      if (gains[a].armature > 0) rotors_.insert(p_.actuators[a].joint);
      if (gains[a].kp > 0 || gains[a].kd > 0) damped_.insert(p_.actuators[a].joint);
    }
    std::string unknown;
    for (int j = 0; j < static_cast<int>(p_.joints.size()); ++j) {
      if (Shows(j))
        OfJoint(j);
      else
        unknown += (unknown.empty() ? "" : ", ") + p_.joints[j].name;
    }
    for (int a = 0; a < m_.nactuator; ++a) OfActuator(a);
    for (std::size_t a = 0; a < gains.size(); ++a) OfAdded(p_.actuators[a], gains[a]);
    if (!unknown.empty())
      unknown = "# Neither driven, measured nor sprung, so without parameters here: " + unknown + "\n";
    if (parameters_.empty()) return unknown;
    return unknown + "parameters:\n" + parameters_ + (set_.empty() ? "" : "set:\n" + set_);
  }

 private:
  // What neither a command moves nor a column says anything of is only carried along. A spring may swing unseen.
  bool Shows(int slot) const {
    const int joint = p_.joints[slot].joint;
    if (p_.positions[slot].column >= 0 || p_.velocities[slot].column >= 0 || m_.jnt_stiffness[joint] > 0) return true;
    const auto drives = [&](const ActuatorSlot& actuator) { return actuator.joint == slot; };
    return std::any_of(p_.actuators.begin(), p_.actuators.end(), drives);
  }

  // A name that expressions can use, and no other parameter has.
  std::string ParameterName(const std::string& element) {
    std::string name = NameForExpressions(element);
    while (!names_.insert(name).second) name += "_";
    return name;
  }

  void Propose(const Proposal& proposal) {
    const auto& [element, unit, nominal, low, high, field, comment] = proposal;
    const std::string name = ParameterName(element);
    parameters_ += "  " + Quote(name) + ": {unit: " + Quote(unit) + ", nominal: " + Num(nominal) + ", bounds: [" +
                   Num(low) + ", " + Num(high) + "]}" + (comment.empty() ? "" : "  # " + comment) + "\n";
    if (!field.empty()) set_ += "  " + Quote(field) + ": " + Quote(name) + "\n";
  }

  void OfJoint(int slot) {
    const JointSlot& joint = p_.joints[slot];
    const int dof = m_.jnt_dofadr[joint.joint];
    const std::string &name = joint.name, field = "joint/" + name + "/";
    const std::string unit = joint.slide ? "N" : "N m", per = joint.slide ? "/m" : "/rad";
    const double inertia = m_.dof_M0[dof], damping = m_.dof_damping[dof], armature = m_.dof_armature[dof];
    // Without a value to start from: a damping that stops the joint within about ten seconds.
    const double scale = damping > 0 ? damping : 0.1 * inertia;
    // An added servo's kd damps its joint, and no log tells the two apart.
    if (!damped_.contains(slot))
      Propose({name + ".damping", unit + " s" + per, damping, 0, 20 * scale, field + "damping",
               damping > 0 ? "" : "the MJCF has none; the upper bound follows from the inertia"});
    // A rotor that the MJCF lacks may be several times what the joint turns without it.
    if (!rotors_.contains(slot))
      Propose({name + ".armature", joint.slide ? "kg" : "kg m^2", armature, 0,
               armature > 0 ? std::max(5 * armature, inertia) : 5 * inertia, field + "armature"});
    if (const double k = m_.jnt_stiffness[joint.joint]; k > 0)
      Propose({name + ".stiffness", unit + per, k, 0.2 * k, 5 * k, field + "stiffness"});
    // An MJCF's dry friction is often a guess, far below what a gear has.
    if (const double f = m_.dof_frictionloss[dof]; f > 0)
      Propose(
          {name + ".frictionloss", unit, f, 0, std::max(10 * f, WeightOn(m_, joint.joint)), field + "frictionloss"});
  }

  void OfActuator(int a) {
    const std::string name = NameOf(m_, mjOBJ_ACTUATOR, a), field = "actuator/" + name + "/";
    if (name.empty() || m_.actuator_plugin[a] >= 0 || m_.actuator_gaintype[a] != mjGAIN_FIXED) return;
    const double gain = m_.actuator_gainprm[a * mjNGAIN], b1 = m_.actuator_biasprm[a * mjNBIAS + 1],
                 b2 = m_.actuator_biasprm[a * mjNBIAS + 2];
    if (gain > 0 && b1 == -gain)
      Propose({name + ".kp", "N m/rad", gain, 0.5 * gain, 2 * gain, field + "kp"});
    else if (gain > 0)
      Propose({name + ".gain", "N m per unit of command", gain, 0.5 * gain, 2 * gain, field + "gain"});
    if (b2 < 0) Propose({name + ".kv", "N m s/rad", -b2, -0.3 * b2, -3 * b2, field + "kv"});
  }

  void OfAdded(const ActuatorSlot& slot, const ServoGains& gains) {
    const double room = gains.certain ? 2 : 10;
    const bool slide = slot.joint >= 0 && p_.joints[slot.joint].slide;
    if (gains.kp > 0)
      Propose({slot.name + ".kp", slide ? "N/m" : "N m/rad", gains.kp, gains.kp / room, gains.kp * room});
    if (gains.armature > 0)
      Propose({slot.name + ".armature_kg_m2", slide ? "kg" : "kg m^2", gains.armature, 0, gains.armature * room});
    if (gains.kd > 0 || gains.kp > 0)
      Propose(
          {slot.name + ".kd", slide ? "N s/m" : "N m s/rad", gains.kd, 0, std::max(gains.kd * room, 0.1 * gains.kp)});
  }

  const mjModel& m_;
  const Pairing& p_;
  std::string parameters_, set_;
  std::set<std::string> names_;
  std::set<int> rotors_, damped_;  // joints of which an added actuator makes the armature; the damping
};

}  // namespace

std::string ParameterText(const mjModel& model, const Pairing& pairing, const std::vector<ServoGains>& gains) {
  return Writer(model, pairing).Run(gains);
}

}  // namespace gapscope

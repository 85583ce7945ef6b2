#include "src/draft/torque_scale.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "src/draft/motion.h"

namespace gapscope {
namespace {

constexpr double kClearTorque = 0.9, kAgreeTorque = 0.25;  // correlation from which a slope counts; how near it must be

// What a command column is.
enum class Choice { kOpen, kInput, kReversedInput, kJointTorque, kReversedJointTorque };

// Torque at the joint per unit of the actuator's input.
double GainOf(const mjModel& m, int actuator) {
  return m.actuator_gear[6 * actuator] * m.actuator_gainprm[actuator * mjNGAIN];
}

class TorqueScales {
 public:
  TorqueScales(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
               Scalings* scalings)
      : m_(model), samples_(samples), guesses_(guesses), p_(pairing), s_(*scalings) {}

  void Run() {
    const auto families = FamiliesOf(p_.commands, guesses_, [&](std::size_t a) { return IsMotor(a); });
    if (families.empty()) return;
    choices_.assign(p_.actuators.size(), Choice::kOpen);
    // A wider parabola sees slow motion through more noise.
    for (const double half_width_s : {kHalfWidth_s, 3 * kHalfWidth_s}) {
      const auto torques = TorquesOf(m_, p_, MotionsOf({&samples_}, guesses_, p_, s_, half_width_s));
      for (const auto& [family, motors] : families) {
        for (const std::size_t a : motors) {
          if (choices_[a] == Choice::kOpen) choices_[a] = ChoiceOf(a, torques[p_.actuators[a].joint]);
        }
      }
    }
    for (const auto& [family, motors] : families) OfFamily(motors);
  }

 private:
  bool IsMotor(std::size_t a) const {
    const ActuatorSlot& slot = p_.actuators[a];
    return slot.actuator >= 0 && m_.actuator_plugin[slot.actuator] < 0 && slot.wants == Quantity::kTorque &&
           slot.joint >= 0 && p_.positions[slot.joint].column >= 0 && GainOf(m_, slot.actuator) != 0;
  }

  // By the torque that the motion takes.
  Choice ChoiceOf(std::size_t a, const std::vector<double>& torque) const {
    FittedLine best;
    for (const int late : samples_.Lags(kLatest_s, kLagStep_s)) {
      const FittedLine line = LineThrough(samples_.values_before(guesses_[p_.commands[a].column].column, late), torque);
      if (std::abs(line.correlation) > std::abs(best.correlation)) best = line;
    }
    if (std::abs(best.correlation) < kClearTorque) return Choice::kOpen;
    const double per_input = best.slope / s_.commands[a].factor / GainOf(m_, p_.actuators[a].actuator);
    const double per_torque = best.slope / s_.commands[a].factor;
    const auto is_one = [](double ratio) { return std::abs(ratio - 1) < kAgreeTorque; };
    if (is_one(per_input)) return Choice::kInput;
    if (is_one(per_torque)) return Choice::kJointTorque;
    if (is_one(-per_input)) return Choice::kReversedInput;
    return is_one(-per_torque) ? Choice::kReversedJointTorque : Choice::kOpen;
  }

  // A family is of one kind: what more than half of its members tell.
  void OfFamily(const std::vector<std::size_t>& motors) {
    std::map<Choice, std::size_t> votes;
    for (const std::size_t a : motors) ++votes[choices_[a]];
    for (const auto& [choice, count] : votes) {
      if (choice == Choice::kOpen || 2 * count <= motors.size()) continue;
      for (const std::size_t a : motors) Take(choice, a);
    }
  }

  void Take(Choice choice, std::size_t a) {
    Scaling& scaling = s_.commands[a];
    scaling.by_data = true;
    if (choice == Choice::kInput) {
      scaling.certain = true;
      scaling.doubt.clear();
      return;
    }
    const Guess& command = guesses_[p_.commands[a].column];
    const double gain = GainOf(m_, p_.actuators[a].actuator);
    const bool at_joint = choice == Choice::kJointTorque || choice == Choice::kReversedJointTorque;
    const bool reversed = choice == Choice::kReversedInput || choice == Choice::kReversedJointTorque;
    const double scale = (reversed ? -1 : 1) / (at_joint ? gain : 1);
    scaling.scale *= scale;
    scaling.factor *= scale;
    scaling.certain = false;
    scaling.doubt = "by the torque that the motion takes " + LabelOf(command.name, command.said) + " is " +
                    (at_joint ? "that at the joint, which gear and gain make of the input" : "the input") +
                    (reversed ? ", with the other sign" : "");
  }

  const mjModel& m_;
  const Samples& samples_;
  const std::vector<Guess>& guesses_;
  const Pairing& p_;
  Scalings& s_;
  std::vector<Choice> choices_;  // per actuator
};

}  // namespace

void FindTorqueScales(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses,
                      const Pairing& pairing, Scalings* scalings) {
  TorqueScales(model, samples, guesses, pairing, scalings).Run();
}

}  // namespace gapscope

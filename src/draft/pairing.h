// Which column is of which joint and which actuator: by name, by number, by what the data say, by order, in this order.
#ifndef GAPSCOPE_DRAFT_PAIRING_H_
#define GAPSCOPE_DRAFT_PAIRING_H_

#include <mujoco/mujoco.h>

#include <map>
#include <string>
#include <vector>

#include "src/draft/guess_columns.h"
#include "src/draft/samples.h"

namespace gapscope {

// A hinge or slide joint of the model that has a name.
struct JointSlot {
  int joint = 0;  // of the model
  std::string name;
  bool slide = false;
  std::vector<int> actuators;  // of the model, on this joint
};

struct ActuatorSlot {
  int actuator = -1;  // of the model; -1: one that the draft proposes
  std::string name;
  int joint = -1;                       // of the slots; -1: on none of them
  Quantity wants = Quantity::kUnknown;  // kOther: a supply or a switch
};

// The column that a slot gets, and why one may doubt it.
struct Pick {
  int column = -1;     // of the guesses; -1: none
  int runner_up = -1;  // the next best; -1: none came near
  bool certain = false;
  std::string why;        // it is not certain: "only a part of its name fits"
  bool by_order = false;  // it is the next in the file
};

struct Pairing {
  std::vector<JointSlot> joints;
  std::vector<Pick> positions, velocities;  // per joint
  std::vector<ActuatorSlot> actuators;
  std::vector<Pick> commands, torques;  // per actuator
};

// Indices of picks by the family of their columns (FamilyOf), of those that have a column and that `accept` takes.
template <class Accept>
std::map<std::string, std::vector<std::size_t>> FamiliesOf(const std::vector<Pick>& picks,
                                                           const std::vector<Guess>& guesses, const Accept& accept) {
  std::map<std::string, std::vector<std::size_t>> families;
  for (std::size_t i = 0; i < picks.size(); ++i) {
    if (picks[i].column >= 0 && accept(i)) families[FamilyOf(guesses[picks[i].column].said)].push_back(i);
  }
  return families;
}

// Without actuators in the model one is proposed for each joint that a command column pairs with.
Pairing PairColumns(const mjModel& model, const Samples& samples, std::vector<Guess>* guesses);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_PAIRING_H_

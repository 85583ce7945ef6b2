// The rigs under models/, and what tests know of each beside its experiment: models/RIG/facts.yaml. A rig is added by
// its folder alone.
#ifndef GAPSCOPE_TESTS_MODELS_RIG_FACTS_H_
#define GAPSCOPE_TESTS_MODELS_RIG_FACTS_H_

#include <map>
#include <string>
#include <vector>

namespace gapscope::testing {

struct RigFacts {
  std::vector<std::string> joints;           // of the MJCF
  std::string motor = "motor";               // the actuator on the first of them
  std::string spring;                        // the joint that has one; empty: none
  bool dry_friction = false;                 // the published base model has Coulomb friction
  std::vector<std::string> signals;          // measured
  std::string command;                       // column of the motor's; its signals' columns then bear their names
  std::map<std::string, double> log_values;  // of the log for which the MJCF's own values stand
  bool own_values = false;                   // the experiment gives another rig's mechanism its own values
  double rounded = 1e-9;                     // how far the MJCF's numbers are from the experiment's, as a share
};

// All folders of models/ that hold an experiment.yaml, in order of their names.
const std::vector<std::string>& RigNames();

// Of one of those. A key that is none of the members above, but for `logs` (scripts/results_replay: where its real logs
// lie in the data folder), throws, as does a file that cannot be read.
const RigFacts& FactsOfRig(const std::string& rig);

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_MODELS_RIG_FACTS_H_

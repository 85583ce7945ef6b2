// What an experiment adds to an MJCF that holds bodies alone: servos, which training frameworks keep in code, and a
// stand that holds floating bodies.
#ifndef GAPSCOPE_EXPERIMENT_ADDED_ACTUATORS_H_
#define GAPSCOPE_EXPERIMENT_ADDED_ACTUATORS_H_

#include "src/experiment/experiment.h"
#include "src/experiment/yaml_reader.h"

namespace gapscope {

// Reads `actuators:` and the parameters that each brings: NAME.kp, NAME.kd, NAME.force_limit_n_m, NAME.armature_kg_m2,
// set in the model and frozen. `parameters:` and `set:` are read before: what they say of a name or a field holds.
// Errors: a name twice, a number out of range, gains that the kind does not have.
Status ReadAddedActuators(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment);

// Reads `hold:` or `inertia:`, names of bodies. Errors: not a list of names, a name twice.
Status ReadBodies(const YAML::Node& node, const std::string& path, const char* key, std::vector<NamedBody>* bodies);

// The name as expressions can read it: other characters than letters, digits, '_' and '.' become '_'.
std::string NameForExpressions(std::string name);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_ADDED_ACTUATORS_H_

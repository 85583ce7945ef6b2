// The parts of an experiment file that state effects: candidates of one's own, and what is switched off.
#ifndef GAPSCOPE_EXPERIMENT_OWN_EFFECTS_H_
#define GAPSCOPE_EXPERIMENT_OWN_EFFECTS_H_

#include <string>
#include <vector>

#include "src/experiment/experiment.h"
#include "src/experiment/yaml_reader.h"

namespace gapscope {

// `candidates:` into experiment->candidates; `parameters` and `values` must have been read. Errors, with their place:
// as docs/reference/experiment.md says of each key; an expression with an unknown name, or without one of its
// parameters. Whether joints, fields and names of effects exist is the model's to say.
Status ReadOwnEffects(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment);
// `without:`, a list of EFFECT or EFFECT@PLACE.
Status ReadSwitchedOff(const YAML::Node& node, const std::string& path, Experiment* experiment);
// A map of FIELD: expression or list of expressions.
Status ReadFieldSettings(const YAML::Node& node, const std::string& path, std::vector<FieldSetting>* settings);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_OWN_EFFECTS_H_

// `gapscope init`: a commented experiment file for a user's own robot, drafted from its MJCF and one log.
#ifndef GAPSCOPE_MODEL_DRAFT_H_
#define GAPSCOPE_MODEL_DRAFT_H_

#include <string>
#include <vector>

#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

struct Draft {
  std::string yaml;
  std::vector<std::string> unsure;  // one sentence per guess that the user should check; they stand in the file too
};

// `model_text` is what the file says for the model's path. Pairs columns with joints and actuators by name first, then
// by correlation; proposes parameters with bounds. Errors: the MJCF does not load, it has no hinge or slide joint, no
// column pairs with any joint.
Result<Draft> DraftExperiment(const std::string& model_path, const std::string& model_text, const Log& log,
                              const Timeline& timeline);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_DRAFT_H_

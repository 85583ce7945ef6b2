// `gapscope init`: a commented experiment file for a user's own robot, drafted from its MJCF and one log.
#ifndef GAPSCOPE_DRAFT_DRAFT_H_
#define GAPSCOPE_DRAFT_DRAFT_H_

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

// What the user says of all servos that the draft adds.
struct ServoSaid {
  double kp = 0, kd = 0;           // N m/rad, N m s/rad
  std::optional<double> limit;     // N m
  std::optional<double> armature;  // kg m^2
};

struct DraftOptions {
  std::optional<ServoSaid> servo;
};

struct DraftLog {
  Log log;
  Timeline timeline;
};

struct Draft {
  std::string head, body;           // of the YAML, before and after the model's path
  std::vector<std::string> unsure;  // one sentence per guess that the user should check; they stand in the file too
  std::size_t measured = 0, commanded = 0, joints = 0;  // joints with a column, actuators with one, joints in all
  // The file; `model_text` is what it says for the model's path.
  std::string Yaml(const std::string& model_text) const;
};

// Pairs columns with joints and actuators (pairing.h), finds units and signs (scaling.h), proposes actuators for an
// MJCF without any, holds floating bases, and proposes parameters with bounds. The first log is looked at (`logs` must
// outlive the call and have one); servos' gains are of all that have its columns and its step. Errors: the MJCF does
// not load, it has no hinge or slide joint, no column pairs with any joint.
Result<Draft> DraftExperiment(const std::string& model_path, std::span<const DraftLog> logs,
                              const DraftOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_DRAFT_H_

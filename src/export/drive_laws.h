// Laws of drives that an engine lacks: gapscope.torch's Drive makes their torques. What the targets that run it share.
#ifndef GAPSCOPE_EXPORT_DRIVE_LAWS_H_
#define GAPSCOPE_EXPORT_DRIVE_LAWS_H_

#include <string>
#include <vector>

#include "src/export/target.h"

namespace gapscope {

// One argument of a drive's law that may vary, and its row in kLaws.
struct LawArgument {
  std::string drive, name;
  std::size_t row = 0;
  double value = 0;
};
std::vector<LawArgument> LawArguments(const ExportedModel& exported);
// Those that the randomisation varies.
std::vector<LawArgument> VaryingLawArguments(const TargetInput& input);

// LAWS, the arguments of each drive; empty: no drive has a law.
std::string LawsText(const TargetInput& input);
// gapscope_torch.py; none: no drive has a law.
std::vector<TargetFile> LawFiles(const TargetInput& input);

// Which of its joint's targets a drive with a law takes for its command: "position", "velocity" or "effort". As mjlab
// detects it itself; of what it does not know, feedback of the angle is a servo's.
std::string CommandField(const mjModel& model, int actuator);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_DRIVE_LAWS_H_

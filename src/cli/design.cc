#include "src/cli/commands.h"

namespace gapscope::cli {

Command DesignCommand() {
  Command design = {.name = "design",
                    .what = "Excitation for the next experiment, within the rig's limits",
                    .example =
                        "gapscope design optimal models/qube/experiment.yaml --separate cable_spring@arm "
                        "--separate torque_bias@arm --out input.csv"};
  const auto add = [&](std::vector<Command> commands) {
    for (Command& command : commands) design.commands.push_back(std::move(command));
  };
  add({ChirpCommand()});
  add(InputCommands());
  add(FeedbackCommands());
  add({OptimalCommand()});
  return design;
}

}  // namespace gapscope::cli

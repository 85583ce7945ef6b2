// The built program as a user runs it, in a scratch folder.
#ifndef GAPSCOPE_TESTS_CLI_FIXTURE_H_
#define GAPSCOPE_TESTS_CLI_FIXTURE_H_

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {

inline const std::string kModels = std::string(GAPSCOPE_SOURCE_DIR) + "/models/";

class CliTest : public ::testing::Test {
 protected:
  // Runs `gapscope ARGUMENTS` (a shell line) in the scratch folder's own sub-folder "cwd".
  Answer Run(const std::string& arguments) {
    std::filesystem::create_directories(scratch_.Path("cwd"));
    return scratch_.Shell("cd '" + scratch_.Path("cwd") + "' && '" GAPSCOPE_PROGRAM "' " + arguments);
  }
  // Status 2, one line on stderr that says all of this, nothing on stdout.
  void ExpectRefused(const std::string& arguments, const std::vector<std::string>& says) {
    SCOPED_TRACE(arguments);
    const Answer answer = Run(arguments);
    EXPECT_EQ(answer.status, 2) << answer.err;
    EXPECT_EQ(answer.out, "");
    for (const auto& part : says)
      EXPECT_NE(answer.err.find(part), std::string::npos) << answer.err << "\nlacks: " << part;
    EXPECT_EQ(answer.err.find("internal error"), std::string::npos) << answer.err;
  }
  // A log of the joint rig: a servo that follows a sine with a lag and hangs back by `offset`.
  std::string JointLog(const std::string& name = "run.csv", double offset = 0.02) {
    std::string text = "time_s,target_rad,position_rad\n";
    for (int k = 0; k < 400; ++k) {
      const double t = 0.002 * k, s = std::max(t - 0.05, 0.0);
      text += std::to_string(t) + "," + std::to_string(0.4 * std::sin(8 * s)) + "," +
              std::to_string(0.4 * std::sin(8 * s - 0.3 * std::min(1.0, 8 * s)) + offset * std::min(1.0, 4 * s)) + "\n";
    }
    return scratch_.Write(name, text);
  }
  std::set<std::string> Files(const std::string& folder) {
    std::set<std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (entry.is_regular_file()) files.insert(std::filesystem::relative(entry.path(), folder).string());
    }
    return files;
  }
  std::string Joint() const { return "'" + kModels + "joint/experiment.yaml'"; }
  Scratch scratch_;
};

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_CLI_FIXTURE_H_

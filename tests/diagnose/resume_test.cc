// A diagnosis that was killed goes on to the same bytes, wherever it was.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "src/core/file.h"
#include "src/diagnose/diagnosis_journal.h"
#include "src/report/diagnose_report.h"

namespace gapscope {
namespace {

namespace fs = std::filesystem;

class ResumeTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("gapscope_resume_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    experiment_ = LoadExperiment(GAPSCOPE_SOURCE_DIR "/models/qube/experiment.yaml").value();
    // The first seconds of the demo's log.
    std::istringstream demo(ReadFile(GAPSCOPE_SOURCE_DIR "/demo/qube.csv").value());
    std::ofstream cut(Path("cut.csv"));
    std::string line;
    for (int i = 0; i < 700 && std::getline(demo, line); ++i) cut << line << "\n";
    cut.close();
    log_ = LoadRecording(experiment_, Path("cut.csv")).value();
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  Result<Diagnosis> Run(DiagnoseOptions options) {
    ThreadPool pool(2);
    options.effort = SearchEffort::kQuick;
    options.window_s = 0.3;
    options.replay_steps = 60;  // two windows
    options.sample_s = 0.01;
    options.next_experiment = false;  // no part of the journal
    options.warn = [this](const std::string& text) { warnings_ += text + "\n"; };
    return Diagnose(experiment_, SplitData({log_}, {}), options, pool);
  }
  // The whole result but the time that it took.
  static std::string Bytes(Result<Diagnosis> diagnosis) {
    if (!diagnosis.ok()) return diagnosis.error().Text();
    return ToJson(DiagnoseRun{.info = {}, .diagnosis = std::move(diagnosis).value()}, Timing::kLeaveOut).dump();
  }
  // The journal of a whole run as it was each time that the run told what it does: a kill leaves the same.
  std::vector<std::string> Killed(std::string* whole) {
    std::vector<std::string> left;
    const auto copy = [&](const DiagnoseProgress&) {
      left.push_back(Path("killed_" + std::to_string(left.size())));
      fs::copy(Path("journal"), left.back(), fs::copy_options::recursive);
    };
    *whole = Bytes(Run({.progress = copy, .journal = Path("journal")}));
    return left;
  }

  void ExpectSameFrom(const std::string& left, const std::string& whole) {
    // Killed while a record is written: it says that more follows than does.
    std::ofstream(left + "/calls.bin", std::ios::app)
        << std::string(8, 'h') << std::string("\x05\0\0\0\0\0\0\0torn", 12);
    EXPECT_EQ(whole, Bytes(Run({.journal = left, .resume = true}))) << left;
    // And once more, now that all of it is there.
    const std::string once = ReadFile(left + "/calls.bin").value();
    EXPECT_EQ(once, ReadFile(Path("journal/calls.bin")).value());
  }

  fs::path folder_;
  Experiment experiment_;
  Recording log_;
  std::string warnings_;
};

TEST_F(ResumeTest, KilledRunEndsInTheSameBytes) {
  std::string whole;
  const std::vector<std::string> left = Killed(&whole);
  EXPECT_EQ(whole, Bytes(Run({})));
  ASSERT_GT(left.size(), 8u);
  for (const std::size_t i : {left.size() / 3, left.size() - 1}) ExpectSameFrom(left[i], whole);
  EXPECT_EQ(whole, Bytes(Run({.journal = Path("journal"), .resume = true})));
  EXPECT_EQ(warnings_, "");
}

// Each place costs a diagnosis: apart from the others, so that one test is not too long.
TEST_F(ResumeTest, KilledElsewhereEndsInTheSameBytes) {
  std::string whole;
  const std::vector<std::string> left = Killed(&whole);
  for (const std::size_t i : {std::size_t{0}, 2 * left.size() / 3}) ExpectSameFrom(left[i], whole);
  EXPECT_EQ(warnings_, "");
}

// Asked to stop at any stage, it looks at nothing more, and tells nothing of what was not looked at.
TEST_F(ResumeTest, StopsWhereItIs) {
  std::atomic<bool> stop = false;
  const auto at_columns = [&](const DiagnoseProgress& p) { stop = stop || p.stage == "columns of all effects"; };
  const Diagnosis stopped = Run({.progress = at_columns, .stop = &stop, .journal = Path("journal")}).value();
  ASSERT_TRUE(stop.load());
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_TRUE(stopped.statements.empty());
  EXPECT_NE(stopped.explanation.find("It was interrupted"), std::string::npos) << stopped.explanation;
  EXPECT_EQ(Bytes(Run({})), Bytes(Run({.journal = Path("journal"), .resume = true})));
}

TEST_F(ResumeTest, JournalOfAnotherJobIsRefused) {
  std::string whole;
  const std::string left = Killed(&whole).at(3);
  log_.measured[0].values[5] += 1e-6;
  const auto other = Run({.journal = left, .resume = true});
  ASSERT_FALSE(other.ok());
  for (const char* part : {"another job", "calls.bin", "logs", "without --resume"})
    EXPECT_NE(other.error().Text().find(part), std::string::npos) << other.error().Text();
  log_.measured[0].values[5] -= 1e-6;
  EXPECT_FALSE(Run({.seed = 3, .journal = left, .resume = true}).ok());
  EXPECT_FALSE(Run({.priors = {{"coulomb_friction", 0.9}}, .journal = left, .resume = true}).ok());
}

TEST_F(ResumeTest, WhatIsDamagedIsSaid) {
  std::string whole;
  const std::string left = Killed(&whole).back();
  std::string largest;
  for (const auto& file : fs::directory_iterator(left)) {
    if (largest.empty() || file.file_size() > fs::file_size(largest)) largest = file.path().string();
  }
  fs::resize_file(largest, 100);
  EXPECT_EQ(whole, Bytes(Run({.journal = left, .resume = true})));  // columns are made again
  EXPECT_NE(warnings_.find(largest + " is missing or damaged"), std::string::npos) << warnings_;
}

TEST_F(ResumeTest, DiskThatIsFullIsSaid) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  std::string whole;
  const std::string left = Killed(&whole).at(1);
  // The next large file has no room.
  std::set<long> numbers;
  for (const auto& file : fs::directory_iterator(Path("journal"))) {
    if (file.path().filename() != "calls.bin") numbers.insert(std::stol(file.path().stem()));
  }
  for (const long n : numbers) {
    const std::string name = left + "/" + std::to_string(n) + ".bin";
    if (!fs::exists(name)) fs::create_symlink("/dev/full", name);
  }
  EXPECT_EQ(whole, Bytes(Run({.journal = left, .resume = true})));
  EXPECT_NE(warnings_.find("the journal cannot be written"), std::string::npos) << warnings_;
  EXPECT_EQ(std::count(warnings_.begin(), warnings_.end(), '\n'), 1);
}

}  // namespace
}  // namespace gapscope

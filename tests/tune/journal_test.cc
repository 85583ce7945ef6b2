// An interrupted run continues to the same bytes, wherever it was cut.
#include "src/fit/journal.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/report/tune_report.h"
#include "src/tune/each_log.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

class JournalTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gapscope_journal_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    rig_ = LoadCart();
    const auto truth = rig_.Values({{"cart.gain", 2.1}, {"cart.damping", 0.7}});
    for (int k = 0; k < 3; ++k) {
      const auto command = [k](double t) { return 3 * std::sin((3 + k) * t + 2 * t * t); };
      logs_.push_back(MakeLog(rig_, truth, command, 1.5, kCartStep_s, 1e-2, static_cast<unsigned long>(k)));
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  TuneOptions Options(const std::string& journal, bool resume) const {
    TuneOptions options;
    options.free = {rig_.Index("cart.gain"), rig_.Index("cart.damping")};
    options.starts = 2;
    options.journal = journal;
    options.resume = resume;
    options.solve.max_iterations = 8;
    options.solve.optimizer = optimizer_;
    return options;
  }
  Result<TuneSummary> Run(const std::string& journal, bool resume, int jobs = 1, unsigned long seed = 0) {
    ThreadPool pool(jobs);
    TuneOptions options = Options(journal, resume);
    options.solve.seed = seed;
    std::atomic<bool> stop = false;
    if (stop_at_ > 0) {
      options.solve.deadline.stop = &stop;
      options.solve.progress = [&, calls = 0](const auto&) mutable { stop = ++calls >= stop_at_; };
    }
    return Tune(*rig_.model, SplitData(logs_, {}), rig_.model->Nominal(), options, pool);
  }
  // The whole result but the time that it took.
  std::string Bytes(const Result<TuneSummary>& summary) {
    return ToJson(TuneRunOf(summary.value(), *rig_.model, 0), Timing::kLeaveOut).dump();
  }

  std::string optimizer_ = "lm";
  int stop_at_ = 0;  // the iteration at whose end the run is interrupted; 0: none
  std::filesystem::path folder_;
  Rig rig_;
  std::vector<Recording> logs_;
};

TEST_F(JournalTest, ResumedRunEndsInTheSameBytes) {
  const std::string whole = Bytes(Run(Path("journal"), false));
  EXPECT_TRUE(whole == Bytes(Run("", false)));
  const std::string bytes = ReadFile(Path("journal")).value();
  ASSERT_GT(bytes.size(), 1000u);
  for (const double share : {0.0, 0.001, 0.2, 0.5, 0.83, 0.999, 1.0}) {
    const auto size = std::max<std::size_t>(16, static_cast<std::size_t>(share * static_cast<double>(bytes.size())));
    ASSERT_TRUE(WriteFile(Path("cut"), bytes.substr(0, size)).ok());
    EXPECT_TRUE(whole == Bytes(Run(Path("cut"), true))) << "cut after " << size << " bytes";
    // What was lost has been written again.
    EXPECT_TRUE(bytes == ReadFile(Path("cut")).value()) << "cut after " << size << " bytes";
  }
}

// It ends in order, with a result of what it has, whose numbers are in the journal too.
TEST_F(JournalTest, InterruptedRunGoesOnToTheSameBytes) {
  const std::string whole = Bytes(Run("", false));
  for (stop_at_ = 1; stop_at_ <= 16; ++stop_at_) {
    ASSERT_TRUE(Run(Path("stopped"), false).ok());
    const int stopped = std::exchange(stop_at_, 0);
    const auto resumed = Run(Path("stopped"), true);
    stop_at_ = stopped;
    ASSERT_TRUE(resumed.ok()) << stopped << ": " << resumed.error().Text();
    EXPECT_TRUE(whole == Bytes(resumed)) << "interrupted in iteration " << stopped;
  }
}

TEST_F(JournalTest, FitsToEachLogGoOnToo) {
  ThreadPool pool(1);
  const TuneSummary joint = Run("", false).value();
  const auto fit = [&](bool resume) {
    std::vector<double> found;
    const auto options = Options(Path("journal.bin"), resume);
    for (const LogFit& log : FitEachLog(*rig_.model, logs_, joint, options, pool).logs) {
      for (const TunedParameter& tuned : log.tuned) found.insert(found.end(), {tuned.value, tuned.low, tuned.high});
    }
    return found;
  };
  const std::vector<double> whole = fit(false);
  ASSERT_EQ(whole.size(), 3 * 2 * 3u);
  const std::vector<std::string> files = {Path("journal.log_0.bin"), Path("journal.log_1.bin"),
                                          Path("journal.log_2.bin")};
  const auto bytes = Collect(files, [](const std::string& file) { return ReadFile(file).value(); });
  ASSERT_TRUE(WriteFile(files[1], bytes[1].substr(0, bytes[1].size() / 2)).ok());
  std::filesystem::remove(files[2]);
  EXPECT_EQ(fit(true), whole);
  for (std::size_t l = 0; l < files.size(); ++l) EXPECT_TRUE(ReadFile(files[l]).value() == bytes[l]) << l;
  ForgetLogFits(Options(Path("journal.bin"), false), logs_.size());
  for (const std::string& file : files) EXPECT_FALSE(std::filesystem::exists(file)) << file;
}

TEST_F(JournalTest, RoundsOfNloptAreResumedToo) {
  optimizer_ = "nlopt:slsqp";
  const std::string whole = Bytes(Run(Path("journal"), false)), bytes = ReadFile(Path("journal")).value();
  for (const double share : {0.3, 0.7, 1.0}) {
    const auto size = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
    ASSERT_TRUE(WriteFile(Path("cut"), bytes.substr(0, size)).ok());
    EXPECT_TRUE(whole == Bytes(Run(Path("cut"), true))) << "cut after " << size << " bytes";
    EXPECT_TRUE(bytes == ReadFile(Path("cut")).value()) << "cut after " << size << " bytes";
  }
}

TEST_F(JournalTest, JournalCutInItsHeadStartsAnew) {
  const std::string whole = Bytes(Run(Path("journal"), false)), bytes = ReadFile(Path("journal")).value();
  for (const std::size_t size : {0u, 5u, 15u}) {
    ASSERT_TRUE(WriteFile(Path("cut"), bytes.substr(0, size)).ok());
    EXPECT_TRUE(whole == Bytes(Run(Path("cut"), true))) << size;
    EXPECT_TRUE(bytes == ReadFile(Path("cut")).value()) << size;
  }
}

TEST_F(JournalTest, GarbageAfterTheLastRecordIsDropped) {
  const std::string whole = Bytes(Run(Path("journal"), false)), bytes = ReadFile(Path("journal")).value();
  // A record that says it is longer than the file; a record whose numbers were flipped.
  for (const std::string& tail : {std::string(8, '\x11') + std::string(8, '\x7f'), std::string(40, '\xff')}) {
    ASSERT_TRUE(WriteFile(Path("torn"), bytes.substr(0, bytes.size() / 2) + tail).ok());
    EXPECT_TRUE(whole == Bytes(Run(Path("torn"), true)));
  }
  std::string flipped = bytes;
  flipped[bytes.size() / 2] = static_cast<char>(flipped[bytes.size() / 2] ^ 0x40);
  ASSERT_TRUE(WriteFile(Path("flipped"), flipped).ok());
  EXPECT_TRUE(whole == Bytes(Run(Path("flipped"), true)));
}

TEST_F(JournalTest, JournalOfAnotherJobIsRefused) {
  ASSERT_TRUE(Run(Path("journal"), false).ok());
  const auto other = Run(Path("journal"), true, 1, 7);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().Text().find("another job"), std::string::npos);
  ASSERT_TRUE(WriteFile(Path("text"), "this is no journal at all\n").ok());
  EXPECT_FALSE(Run(Path("text"), true).ok());
}

// What the numbers depend on is not only what the options and the measurements say.
TEST_F(JournalTest, ChangedModelIsAnotherJob) {
  ASSERT_TRUE(Run(Path("journal"), false).ok());
  const auto refused = [&](const std::string& what) {
    const auto again = Run(Path("journal"), true);
    ASSERT_FALSE(again.ok()) << what;
    EXPECT_NE(again.error().Text().find("another job"), std::string::npos) << what;
  };
  const Rig before = rig_;
  rig_ = LoadCart(-10, 9.5);
  refused("a bound");
  rig_.experiment = before.experiment;
  rig_.experiment.settings.push_back({"option/gravity", {"0", "0", "-1"}, "test"});
  rig_.model = Model::Load(rig_.experiment).value();
  refused("a setting");
  rig_ = before;
  rig_.experiment.measured[0].resolution = 1e-3;
  rig_.model = Model::Load(rig_.experiment).value();
  refused("a sensor's resolution");
  rig_ = before;
  const auto logs = logs_;
  logs_[0].values["log.supply_v"] = 7.4;
  refused("a log's value");
  logs_ = logs;
  EXPECT_TRUE(Run(Path("journal"), true).ok());
}

TEST_F(JournalTest, DiskThatIsFullIsSaidAndLosesNothing) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this system";
  const auto refused = Run("/dev/full", false);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().Text().find("cannot be written"), std::string::npos);
}

TEST_F(JournalTest, NumberOfWorkersDoesNotMatter) {
  const std::string one = Bytes(Run("", false, 1));
  EXPECT_TRUE(one == Bytes(Run("", false, 2)));
  EXPECT_TRUE(one == Bytes(Run("", false, 5)));
}

TEST(JournalPackTest, LinearizationComesBack) {
  Linearization l{.cost = 2.5, .valid = true};
  l.hessian = Eigen::MatrixXd::Random(3, 3);
  l.gradient = Eigen::VectorXd::Random(3);
  l.block_gradients = {Eigen::VectorXd::Random(3), Eigen::VectorXd::Random(3)};
  l.block_series = {0, 4};
  l.state_gain = {Eigen::MatrixXd::Random(2, 3), Eigen::MatrixXd(0, 3)};
  l.state_step = {Eigen::VectorXd::Random(2), Eigen::VectorXd(0)};
  const auto again = UnpackLinearization(Pack(l));
  ASSERT_TRUE(again.valid);
  EXPECT_EQ(again.hessian, l.hessian);
  EXPECT_EQ(again.gradient, l.gradient);
  EXPECT_EQ(again.block_gradients[1], l.block_gradients[1]);
  EXPECT_EQ(again.block_series, l.block_series);
  EXPECT_EQ(again.state_gain[0], l.state_gain[0]);
  EXPECT_EQ(again.state_step[1].size(), 0);
}

}  // namespace
}  // namespace gapscope::testing

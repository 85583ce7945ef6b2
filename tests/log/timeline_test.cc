#include "src/log/timeline.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <random>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();
constexpr double kRounding = 1e-12;

Timeline Build(const std::vector<double>& stamps, const TimelineOptions& options = {},
               const std::string& name = "time_s") {
  const auto timeline = BuildTimeline(MakeLog({{name, stamps}}), options);
  EXPECT_TRUE(timeline.ok()) << (timeline.ok() ? "" : timeline.error().Text());
  return timeline.ok() ? timeline.value() : Timeline{};
}

void ExpectFinding(const std::vector<Finding>& findings, const char* kind, std::size_t count, std::size_t first_row) {
  const Finding* finding = FindFinding(findings, kind);
  ASSERT_TRUE(finding) << kind;
  EXPECT_EQ(finding->count, count) << kind << ": " << finding->text;
  EXPECT_EQ(finding->first_row, first_row) << kind;
  EXPECT_FALSE(finding->text.empty());
}

std::vector<double> Regular(std::size_t count, double step, double start = 0) {
  std::vector<double> stamps;
  for (std::size_t k = 0; k < count; ++k) stamps.push_back(start + static_cast<double>(k) * step);
  return stamps;
}

TEST(TimelineTest, StartsAtZeroAndKeepsTheStart) {
  const Timeline timeline = Build(Regular(5, 0.25, -7));
  EXPECT_EQ(timeline.time_s, (std::vector<double>{0, 0.25, 0.5, 0.75, 1}));
  EXPECT_EQ(timeline.start_s, -7);
  EXPECT_EQ(timeline.median_step_s, 0.25);
  EXPECT_EQ(timeline.jitter_s, 0);
  EXPECT_TRUE(timeline.findings.empty());
}

TEST(TimelineTest, UnitFromNameHeadingCallerDateOrStep) {
  const struct {
    const char* name;
    const char* heading_unit;
    const char* wanted;
    double start, step;
    const char* unit;
    double step_s;
    bool guessed;
  } rows[] = {
      {"time_s", "", "", 0, 0.004, "s", 0.004, false},
      {"time_ms", "", "", 0, 4, "ms", 0.004, false},
      {"timestamp_us", "", "", 0, 4000, "us", 0.004, false},
      {"t_ns", "", "", 0, 4e6, "ns", 0.004, false},
      {"timestampNs", "", "", 0, 4e6, "ns", 0.004, false},
      {"millis", "", "", 0, 4, "ms", 0.004, false},
      {"%time", "", "", 1.7e18, 4e6, "ns", 0.004, false},
      {"__time", "", "", 1.7e9, 0.0078125, "s", 0.0078125, false},
      {"Time", "ms", "", 0, 4, "ms", 0.004, false},
      {"Time", "", "us", 0, 4000, "us", 0.004, false},
      {"t", "", "", 0, 0.004, "s", 0.004, true},
      {"t", "", "", 0, 0.5, "s", 0.5, true},
      {"t", "", "", 0, 4, "ms", 0.004, true},
      {"t", "", "", 0, 4000, "us", 0.004, true},
      {"t", "", "", 0, 4e6, "ns", 0.004, true},
      {"t", "", "", 1.7e9, 0.0078125, "s", 0.0078125, true},
      {"t", "", "", 1.7e12, 4, "ms", 0.004, true},
      {"t", "", "", 1.7e15, 4000, "us", 0.004, true},
      {"t", "", "", 1.7e18, 4'096'000, "ns", 0.004096, true},
      {"time", "", "", 1.7e9, 2, "s", 2, true},
  };
  for (const auto& row : rows) {
    Log log = MakeLog({{row.name, Regular(20, row.step, row.start)}});
    log.columns[0].unit = row.heading_unit;
    const auto timeline = BuildTimeline(log, {.time_unit = row.wanted});
    ASSERT_TRUE(timeline.ok()) << row.name << " " << timeline.error().Text();
    EXPECT_EQ(timeline.value().time_unit, row.unit) << row.name << " step " << row.step;
    EXPECT_NEAR(timeline.value().median_step_s, row.step_s, 1e-9) << row.name << " step " << row.step;
    EXPECT_EQ(FindFinding(timeline.value().findings, "time_unit") != nullptr, row.guessed)
        << row.name << " step " << row.step;
  }
}

TEST(TimelineTest, TimeColumnByName) {
  const struct {
    std::vector<std::string> names;
    const char* found;
  } rows[] = {
      {{"x", "t"}, "t"},
      {{"x", "Time (s)"}, "Time (s)"},
      {{"x", "TIMESTAMP"}, "TIMESTAMP"},
      {{"x", "/time"}, "/time"},
      {{"target", "time_s"}, "time_s"},
      {{"uptime", "time"}, "time"},
      {{"x", "field.header.stamp"}, "field.header.stamp"},
      {{"torque", "theta", "elapsed_time"}, "elapsed_time"},
      {{"%time", "field.t"}, "%time"},
      {{"x", "tick_ms"}, "tick_ms"},
  };
  for (const auto& row : rows) {
    Log log = MakeLog({});
    for (const auto& name : row.names) log.columns.push_back({name, "", Regular(9, name == "%time" ? 1e7 : 0.01)});
    const auto timeline = BuildTimeline(log, {});
    ASSERT_TRUE(timeline.ok()) << row.found;
    EXPECT_EQ(timeline.value().time_column, row.found);
  }
  EXPECT_FALSE(
      BuildTimeline(MakeLog({{"torque", Regular(9, 1)}, {"theta", Regular(9, 1)}, {"target", Regular(9, 1)}}), {})
          .ok());
}

TEST(TimelineTest, StatedUnitThatLooksWrongIsReported) {
  EXPECT_TRUE(FindFinding(Build(Regular(9, 4)).findings, "time_unit_doubt"));
  EXPECT_FALSE(FindFinding(Build(Regular(9, 0.004)).findings, "time_unit_doubt"));
}

TEST(TimelineTest, RepeatsAreDropped) {
  const Timeline timeline = Build({0, 0.1, 0.1, 0.1, 0.2, 0.2, 0.3});
  EXPECT_EQ(timeline.rows, (std::vector<std::size_t>{0, 1, 4, 6}));
  ExpectFinding(timeline.findings, "repeated_stamp", 3, 2);
}

TEST(TimelineTest, ReversalsDropAsFewRowsAsPossible) {
  // One late stamp, and one far ahead: one row each, not all that follow.
  const Timeline timeline = Build({0, 0.1, 0.2, 0.15, 0.3, 9.0, 0.4, 0.5, 0.6});
  EXPECT_EQ(timeline.rows.size(), 7u);
  EXPECT_EQ(std::count(timeline.rows.begin(), timeline.rows.end(), 5), 0);
  ExpectFinding(timeline.findings, "time_reversal", 2, 3);
}

TEST(TimelineTest, RestartKeepsTheLongestStretch) {
  std::vector<double> stamps = Regular(10, 0.1);
  const std::vector<double> second = Regular(30, 0.1), third = Regular(5, 0.1);
  stamps.insert(stamps.end(), second.begin(), second.end());
  stamps.insert(stamps.end(), third.begin(), third.end());
  const Timeline timeline = Build(stamps);
  ASSERT_EQ(timeline.rows.size(), 30u);
  EXPECT_EQ(timeline.rows.front(), 10u);
  EXPECT_EQ(timeline.rows.back(), 39u);
  ExpectFinding(timeline.findings, "clock_reset", 2, 10);
  EXPECT_FALSE(FindFinding(timeline.findings, "time_reversal"));
}

TEST(TimelineTest, SingleZeroStampIsAGlitchNotARestart) {
  const Timeline timeline = Build({0.1, 0.2, 0.3, 0, 0.5, 0.6, 0.7, 0.8});
  EXPECT_EQ(timeline.rows, (std::vector<std::size_t>{0, 1, 2, 4, 5, 6, 7}));
  ExpectFinding(timeline.findings, "time_reversal", 1, 3);
}

TEST(TimelineTest, CounterThatRunsOverIsCarriedOn) {
  for (const double period : {65536.0, 4294967296.0}) {
    std::vector<double> stamps;
    for (int k = 0; k < 100; ++k) stamps.push_back(std::fmod(period - 200 + 4 * k, period));
    const Timeline timeline = Build(stamps, {}, "time_ms");
    ASSERT_EQ(timeline.rows.size(), 100u);
    EXPECT_NEAR(timeline.time_s.back(), 0.396, kRounding);
    ExpectFinding(timeline.findings, "clock_wrap", 1, 50);
  }
}

TEST(TimelineTest, RowsWithoutStampAreDropped) {
  const Timeline timeline = Build({kNoTime, 0.1, kNoTime, 0.3, 0.4});
  EXPECT_EQ(timeline.rows, (std::vector<std::size_t>{1, 3, 4}));
  ExpectFinding(timeline.findings, "missing_stamp", 2, 0);
}

TEST(TimelineTest, GapsAndIrregularStepsAreReported) {
  std::vector<double> stamps = Regular(50, 0.01);
  for (std::size_t k = 20; k < 50; ++k) stamps[k] += 0.5;
  for (std::size_t k = 40; k < 50; ++k) stamps[k] += 0.1;
  const Timeline timeline = Build(stamps);
  ExpectFinding(timeline.findings, "gap", 2, 19);
  EXPECT_NEAR(timeline.longest_step_s, 0.51, kRounding);
  EXPECT_NEAR(timeline.jitter_s, 0, kRounding);

  for (std::size_t k = 0; k < 50; k += 2) stamps[k] += 0.004;
  ASSERT_TRUE(FindFinding(Build(stamps).findings, "irregular"));
}

TEST(TimelineTest, PoliciesOfErrorNameFileAndLine) {
  const struct {
    std::vector<double> stamps;
    TimelineOptions options;
    const char* where;
  } rows[] = {
      {{0, 1, 1, 2}, {.repeated = TimeRepair::kError}, "made.csv:4, column time_s"},
      {{0, 2, 1, 3}, {.reversed = TimeRepair::kError}, "made.csv:4, column time_s"},
      {{0, kNoTime, 1, 3}, {.missing = MissingRepair::kError}, "made.csv:3, column time_s"},
  };
  for (const auto& row : rows) {
    const auto timeline = BuildTimeline(MakeLog({{"time_s", row.stamps}}), row.options);
    ASSERT_FALSE(timeline.ok());
    EXPECT_EQ(timeline.error().where, row.where) << timeline.error().Text();
    EXPECT_NE(timeline.error().cure.find("drop_rows"), std::string::npos);
  }
}

TEST(TimelineTest, RequiredColumnsDropRows) {
  const Log log = MakeLog({{"t", {0, 0.1, 0.2, 0.3}}, {"x", {1, kNoTime, 3, 4}}});
  const auto timeline = BuildTimeline(log, {.missing = MissingRepair::kDropRows, .required = {"x"}});
  ASSERT_TRUE(timeline.ok());
  EXPECT_EQ(timeline.value().rows, (std::vector<std::size_t>{0, 2, 3}));
  ExpectFinding(timeline.value().findings, "missing", 1, 1);
}

// Whatever the stamps, the timeline grows, points at rows in order, and every dropped row is accounted for.
TEST(TimelineTest, RandomStampsGiveAGrowingTimeline) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 300; ++round) {
    std::vector<double> stamps;
    double t = 0;
    for (int k = 0; k < 60; ++k) {
      const int what = static_cast<int>(random() % 12);
      t = what == 0 ? 0 : what == 1 ? t : what == 2 ? t - 0.05 : what == 3 ? t + 0.7 : t + 0.01;
      stamps.push_back(random() % 20 == 0 ? kNoTime : t);
    }
    const auto result = BuildTimeline(MakeLog({{"time_s", stamps}}), {});
    if (!result.ok()) continue;
    const Timeline& timeline = result.value();
    ASSERT_EQ(timeline.time_s.size(), timeline.rows.size());
    EXPECT_EQ(timeline.time_s.front(), 0);
    for (std::size_t k = 1; k < timeline.rows.size(); ++k) {
      EXPECT_LT(timeline.time_s[k - 1], timeline.time_s[k]);
      EXPECT_LT(timeline.rows[k - 1], timeline.rows[k]);
    }
    EXPECT_TRUE(timeline.rows.size() == stamps.size() || !timeline.findings.empty());
  }
}

class ExtractTest : public testing::Test {
 protected:
  Result<std::vector<double>> Extract(const std::vector<double>& values, const ColumnOptions& options) {
    findings_.clear();
    const Log log = MakeLog({{"time_s", Regular(values.size(), 0.01)}, {"x", values}});
    const auto timeline = BuildTimeline(log, {});
    EXPECT_TRUE(timeline.ok());
    return ExtractColumn(log, timeline.value(), log.columns[1], options, &findings_);
  }
  std::vector<Finding> findings_;
};

TEST_F(ExtractTest, ScalesAndHolds) {
  const auto values = Extract({kNoTime, 1, kNoTime, kNoTime, 4}, {.factor = 2, .offset = 1});
  ASSERT_TRUE(values.ok());
  EXPECT_EQ(values.value(), (std::vector<double>{3, 3, 3, 3, 9}));
  ExpectFinding(findings_, "held", 3, 0);
}

TEST_F(ExtractTest, MissingUnderErrorNamesTheLine) {
  const auto values = Extract({0, 1, kNoTime, 3}, {.missing = MissingRepair::kError});
  ASSERT_FALSE(values.ok());
  EXPECT_EQ(values.error().where, "made.csv:4, column x");
}

TEST_F(ExtractTest, OverflowOnScalingIsAnError) {
  const auto values = Extract({0, 1e308, 2}, {.factor = 100});
  ASSERT_FALSE(values.ok());
  EXPECT_EQ(values.error().where, "made.csv:3, column x");
}

TEST_F(ExtractTest, WrapsAreRemovedOrReported) {
  const double turn = 2 * std::numbers::pi;
  std::vector<double> truth, wrapped;
  for (int k = 0; k < 400; ++k) {
    truth.push_back(9 * std::sin(0.02 * k));
    wrapped.push_back(std::remainder(truth.back(), turn));
  }
  std::size_t jumps = 0;
  for (std::size_t k = 1; k < wrapped.size(); ++k) jumps += std::abs(wrapped[k] - wrapped[k - 1]) > 3;
  ASSERT_GT(jumps, 0u);
  const auto unwrapped = Extract(wrapped, {.wrap = WrapRepair::kUnwrap, .wrap_period = turn});
  ASSERT_TRUE(unwrapped.ok());
  ASSERT_TRUE(FindFinding(findings_, "wrap"));
  EXPECT_EQ(FindFinding(findings_, "wrap")->count, jumps);
  for (std::size_t k = 0; k < truth.size(); ++k) EXPECT_NEAR(unwrapped.value()[k], truth[k], 1e-12);

  for (const double period : {0.0, turn}) {  // undeclared, and declared but kept
    const auto kept = Extract(wrapped, {.wrap_period = period});
    EXPECT_EQ(kept.value(), wrapped);
    ASSERT_TRUE(FindFinding(findings_, "wrap"));
    EXPECT_EQ(FindFinding(findings_, "wrap")->count, jumps);
  }
}

TEST_F(ExtractTest, SaturationIsReported) {
  std::vector<double> clipped;
  for (int k = 0; k < 400; ++k) clipped.push_back(std::clamp(std::sin(0.05 * k), -0.8, 0.7));
  ASSERT_TRUE(Extract(clipped, {}).ok());
  const auto at_limit = std::count_if(clipped.begin(), clipped.end(), [](double x) { return x == 0.7 || x == -0.8; });
  ASSERT_TRUE(FindFinding(findings_, "saturation"));
  EXPECT_NEAR(static_cast<double>(FindFinding(findings_, "saturation")->count), static_cast<double>(at_limit), 8);
}

}  // namespace
}  // namespace gapscope

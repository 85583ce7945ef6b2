#include "src/log/inspect.h"

#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "src/log/inspect_json.h"
#include "src/log/inspect_parts.h"
#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

Timeline RegularTimeline(std::size_t count, double step_s) {
  std::vector<double> stamps;
  for (std::size_t k = 0; k < count; ++k) stamps.push_back(static_cast<double>(k) * step_s);
  return BuildTimeline(MakeLog({{"time_s", stamps}}), {}).value();
}

std::vector<double> Sample(const Timeline& timeline, const std::function<double(double)>& f) {
  std::vector<double> values;
  for (const double t : timeline.time_s) values.push_back(f(t));
  return values;
}

bool Says(const std::vector<std::string>& sentences, const std::string& part) {
  return std::any_of(sentences.begin(), sentences.end(),
                     [&](const auto& s) { return s.find(part) != std::string::npos; });
}

double Chirp(double t) { return t < 0 ? 0 : std::sin(kTurn * (0.2 * t + 0.25 * t * t)); }  // 0.2 to 5.2 Hz in 10 s

TEST(InspectTest, DelayIsFoundBetweenSamples) {
  const Timeline timeline = RegularTimeline(2500, 0.004);
  for (const double delay_s : {0.0, 0.004, 0.0137, 0.05}) {
    const InspectReport report = Inspect(
        timeline,
        {{"u", "V", ChannelRole::kCommand, Sample(timeline, Chirp)},
         {"y", "rad", ChannelRole::kMeasured, Sample(timeline, [&](double t) { return 0.5 * Chirp(t - delay_s); })}},
        {}, 2500);
    ASSERT_EQ(report.delays.size(), 1u);
    EXPECT_NEAR(report.delays[0].delay_s, delay_s, 0.0002) << delay_s;
    EXPECT_GT(report.delays[0].correlation, 0.99);
    EXPECT_TRUE(report.delays[0].reliable);
  }
}

TEST(InspectTest, OppositeSignIsReported) {
  const Timeline timeline = RegularTimeline(2500, 0.004);
  const InspectReport report = Inspect(
      timeline,
      {{"target", "rad", ChannelRole::kCommand, Sample(timeline, Chirp)},
       {"position", "rad", ChannelRole::kMeasured, Sample(timeline, [](double t) { return -Chirp(t - 0.01); })}},
      {}, 2500);
  EXPECT_LT(report.delays[0].correlation, -0.95);
  EXPECT_TRUE(Says(report.verdict, "is a sign wrong?"));
}

TEST(InspectTest, SineHasItsPowerInItsDecade) {
  const Timeline timeline = RegularTimeline(5000, 0.002);
  const auto excitation = MeasureExcitation(
      {"u", "V", ChannelRole::kCommand, Sample(timeline, [](double t) { return 2 * std::sin(kTurn * 3 * t); })},
      timeline.time_s, timeline.median_step_s);
  EXPECT_NEAR(excitation.peak_hz, 3, 0.1);
  EXPECT_NEAR(excitation.bandwidth_95_hz, 3, 0.25);
  double sum = 0;
  for (const auto& band : excitation.bands) {
    sum += band.share;
    if (band.low_hz < 3 && band.high_hz > 3) {
      EXPECT_GT(band.share, 0.99);
    }
  }
  EXPECT_NEAR(sum, 1, 1e-9);
  EXPECT_NEAR(excitation.amplitude_ratio, 1, 0.01);
  EXPECT_EQ(excitation.half_cycles, 60u);
  EXPECT_NEAR(excitation.range, 4, 0.01);
}

TEST(InspectTest, CoverageCountsReversalsAndRest) {
  const Timeline timeline = RegularTimeline(5000, 0.002);
  // Two full swings, then rest, on an encoder of 4096 counts.
  const auto angle = [](double t) {
    const double x = t < 5 ? 1 - std::cos(kTurn * 0.4 * t) : 0;
    return kTurn / 4096 * std::round(x * 4096 / kTurn);
  };
  const InspectReport report =
      Inspect(timeline, {{"q", "rad", ChannelRole::kMeasured, Sample(timeline, angle)}}, {}, 5000);
  ASSERT_EQ(report.coverage.size(), 1u);
  EXPECT_EQ(report.coverage[0].reversals, 3u);
  EXPECT_NEAR(report.coverage[0].rest_share, 0.5, 0.03);
  EXPECT_NEAR(report.coverage[0].speed_max, kTurn * 0.4, 0.1);
  EXPECT_NEAR(report.coverage[0].positive_share, 0.5, 0.02);
  EXPECT_NEAR(report.channels[0].quantisation_step, kTurn / 4096, 1e-9);
}

TEST(InspectTest, VerdictNamesWhatIsMissing) {
  const Timeline timeline = RegularTimeline(2000, 0.005);
  // A ramp: one direction, one speed, a slow command.
  const InspectReport ramp =
      Inspect(timeline,
              {{"u", "V", ChannelRole::kCommand, Sample(timeline, [](double t) { return 0.1 * t; })},
               {"q", "rad", ChannelRole::kMeasured, Sample(timeline, [](double t) { return 0.5 * t; })}},
              {}, 2000);
  EXPECT_TRUE(ramp.fit);
  EXPECT_TRUE(Says(ramp.verdict, "no reversal of 'q': Coulomb friction and a bias cannot be told apart"));
  EXPECT_TRUE(Says(ramp.verdict, "no content of 'u' above"));
  EXPECT_TRUE(Says(ramp.verdict, "no slow motion of 'q'"));
  EXPECT_TRUE(Says(ramp.verdict, "never at rest"));

  const InspectReport sine =
      Inspect(timeline,
              {{"u", "V", ChannelRole::kCommand, Sample(timeline, [](double t) { return std::sin(6 * t); })},
               {"q", "rad", ChannelRole::kMeasured, Sample(timeline, [](double t) { return std::sin(6 * t - 0.3); })}},
              {}, 2000);
  EXPECT_TRUE(Says(sine.verdict, "one amplitude of 'u'"));
  EXPECT_FALSE(Says(sine.verdict, "no reversal"));
}

TEST(InspectTest, UnfitWithReasons) {
  const Timeline timeline = RegularTimeline(200, 0.005);
  const auto zero = Sample(timeline, [](double) { return 0.0; });
  const auto wave = Sample(timeline, [](double t) { return std::sin(20 * t); });
  auto holes = wave;
  for (std::size_t k = 0; k < 50; ++k) holes[k] = NAN;
  const struct {
    std::vector<InspectChannel> channels;
    std::size_t rows_in_log;
    const char* reason;
  } rows[] = {
      {{{"u", "V", ChannelRole::kCommand, wave}}, 200, "no measured channel"},
      {{{"u", "V", ChannelRole::kCommand, wave}, {"q", "rad", ChannelRole::kMeasured, zero}},
       200,
       "no measured channel moves"},
      {{{"u", "V", ChannelRole::kCommand, holes}, {"q", "rad", ChannelRole::kMeasured, wave}},
       200,
       "'u' has no value in 25.0 %"},
      {{{"u", "V", ChannelRole::kCommand, wave}, {"q", "rad", ChannelRole::kMeasured, wave}},
       400,
       "dropped by repairs"},
  };
  for (const auto& row : rows) {
    const InspectReport report = Inspect(timeline, row.channels, {}, row.rows_in_log);
    EXPECT_FALSE(report.fit) << row.reason;
    EXPECT_TRUE(Says(report.unfit_because, row.reason)) << row.reason;
  }
  const Timeline few = RegularTimeline(5, 0.005);
  EXPECT_FALSE(
      Inspect(few, {{"q", "rad", ChannelRole::kMeasured, Sample(few, [](double t) { return t; })}}, {}, 5).fit);
}

TEST(InspectTest, SurvivesNaNHugeAndTinyValues) {
  const Timeline timeline = RegularTimeline(60, 0.01);
  std::mt19937 random(4);
  for (int round = 0; round < 60; ++round) {
    std::vector<InspectChannel> channels;
    for (int c = 0; c < 4; ++c) {
      const int kind = static_cast<int>(random() % 5);
      auto values = Sample(timeline, [&](double t) {
        if (kind == 0 || random() % 10 == 0) return std::numeric_limits<double>::quiet_NaN();
        if (kind == 1) return random() % 2 ? 1.7e308 : -1.7e308;
        if (kind == 2) return 5e-324 * static_cast<double>(random() % 5);
        return kind == 3 ? 1e300 * std::sin(9 * t) : std::sin(9 * t);
      });
      channels.push_back({std::to_string(c), c % 2 ? "rad" : "V",
                          c % 2 ? ChannelRole::kMeasured : ChannelRole::kCommand, std::move(values)});
    }
    const InspectReport report = Inspect(timeline, channels, {}, 60);
    // As it is printed: what is no number, or no finite one, is null.
    const auto json = nlohmann::ordered_json::parse(ToJson(report, "log.csv").dump());
    EXPECT_EQ(json["time"]["rows"], 60);
    ASSERT_EQ(json["channels"].size(), channels.size());
    for (std::size_t c = 0; c < channels.size(); ++c) {
      SCOPED_TRACE(c);
      const auto& x = channels[c].values;
      double least = INFINITY, most = -INFINITY, missing = 0;
      for (const double value : x) {
        std::isnan(value) ? ++missing : (least = std::min(least, value), most = std::max(most, value));
      }
      EXPECT_EQ(report.channels[c].name, channels[c].name);
      EXPECT_NEAR(report.channels[c].missing_share, missing / 60, 1e-12);
      if (missing == 60) {
        EXPECT_TRUE(std::isnan(report.channels[c].minimum));
        EXPECT_TRUE(json["channels"][c]["minimum"].is_null()) << json["channels"][c];
      } else {
        EXPECT_EQ(report.channels[c].minimum, least);
        EXPECT_EQ(report.channels[c].maximum, most);
        EXPECT_EQ(json["channels"][c]["maximum"], most);
      }
    }
  }
}

TEST(InspectTest, ResamplingKeepsSamplesAndHoldsCommands) {
  const std::vector<double> t = {0, 0.1, 0.3, 0.4}, x = {1, 2, 4, NAN};
  const auto linear = ResampleUniform(t, x, 0.1, false);
  ASSERT_EQ(linear.values.size(), 5u);
  const std::vector<double> wanted = {1, 2, 3, 4, 4};
  for (std::size_t k = 0; k < 5; ++k) EXPECT_NEAR(linear.values[k], wanted[k], 1e-12);
  EXPECT_EQ(ResampleUniform(t, x, 0.1, true).values, (std::vector<double>{1, 2, 2, 4, 4}));
  EXPECT_LE(ResampleUniform({0, 1, 1e9}, {0, 1, 2}, 1e-3, true, 1000).values.size(), 1000u);
}

TEST(InspectTest, JsonHoldsTheReport) {
  const Timeline timeline = RegularTimeline(500, 0.01);
  const InspectReport report = Inspect(timeline,
                                       {{"u", "V", ChannelRole::kCommand, Sample(timeline, Chirp)},
                                        {"q\xFF", "rad", ChannelRole::kMeasured, Sample(timeline, Chirp)}},
                                       {{"gap", "t", 2, 7, "two gaps"}}, 500);
  const auto json = ToJson(report, "log.csv");
  EXPECT_EQ(json["log"], "log.csv");
  EXPECT_EQ(json["time"]["rows"], 500);
  EXPECT_NEAR(json["time"]["rate_hz"].get<double>(), 100, 1e-9);
  EXPECT_EQ(json["channels"].size(), 2u);
  EXPECT_EQ(json["channels"][0]["role"], "command");
  EXPECT_EQ(json["findings"][0]["count"], 2);
  EXPECT_EQ(json["delays"][0]["command"], "u");
  EXPECT_EQ(json["excitation"].size(), 1u);
  EXPECT_EQ(json["coverage"].size(), 1u);
  EXPECT_EQ(nlohmann::ordered_json::parse(json.dump()), json);
}

}  // namespace
}  // namespace gapscope

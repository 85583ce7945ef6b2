// The document's table, and the closed forms behind it.
#include "src/design/chirp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <sstream>

#include "src/report/design_report.h"

namespace gapscope {
namespace {

ChirpRequest Document() {
  return {.inertia_kg_m2 = 0.159221308,
          .natural_frequency_hz = 5,
          .damping_ratios = {0.707, 1.2, 2},
          .speed_limit_rad_per_s = 116 * 2 * std::numbers::pi / 60,
          .amplitude_factor = 0.8,
          .end_over_bandwidth = {2, 3, 5}};
}

TEST(ChirpTest, TableHasTheDocumentsDigits) {
  const auto rows = DesignChirps(Document());
  ASSERT_TRUE(rows.ok());
  std::vector<std::vector<std::string>> cells;
  std::istringstream table(ToTable(ChirpRun{.info = {}, .rows = rows.value()}));
  for (std::string line; std::getline(table, line);) {
    std::istringstream words(line.substr(34));
    cells.emplace_back();
    for (std::string word; words >> word;) cells.back().push_back(word);
  }
  const std::vector<std::vector<std::string>> document = {
      {"0.707", "1.2", "2.0"},         {"157.1451", "157.1451", "157.1451"},
      {"7.0729", "12.005", "20.0083"}, {"22.2179", "13.0900", "7.8540"},
      {"0.1801", "0.1061", "0.0637"},  {"5.0", "2.5", "1.33"},
      {"10.0", "4.99", "2.67"},        {"8.860409", "17.744336", "33.241674"},
      {"15.0", "7.49", "4.0"},         {"5.906939", "11.829558", "22.161116"},
      {"25.0", "12.49", "6.66"},       {"3.544164", "7.097735", "13.29667"},
  };
  EXPECT_EQ(cells, document);
}

// At the bandwidth the response w^2 / (s^2 + 2 z w s + w^2) is 1 / sqrt 2.
TEST(ChirpTest, BandwidthIsWhereTheResponseIsThreeDecibelsDown) {
  constexpr double kTolerance = 1e-9;
  for (const double z : {0.01, 0.3, 0.707, 1.0, 1.2, 2.0, 50.0, 1e4}) {
    const std::complex<double> s(0, BandwidthRatio(z));
    EXPECT_NEAR(std::abs(1.0 / (s * s + 2 * z * s + 1.0)), std::sqrt(0.5), kTolerance) << z;
  }
}

TEST(ChirpTest, CsvKeepsTheSpeedLimitAndIsTheDocumentsFormula) {
  ChirpRequest request = Document();
  request.damping_ratios = {0.707};
  request.end_over_bandwidth = {2};
  const auto rows = DesignChirps(request);
  ASSERT_TRUE(rows.ok());
  const auto csv = ChirpCsv(rows.value(), request, 0.1, 20, 500);
  ASSERT_TRUE(csv.ok());
  std::istringstream lines(csv.value());
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line.substr(0, 38), "time_s,target_rad,target_rad_per_s,tar");
  const double amplitude = rows.value()[0].chirps[0].amplitude_rad, end_hz = rows.value()[0].chirps[0].end_frequency_hz;
  double fastest = 0, last = 0, last_time = 0;
  std::size_t count = 0;
  while (std::getline(lines, line)) {
    double t = 0, target = 0, speed = 0;
    char comma = 0;
    std::istringstream(line) >> t >> comma >> target >> comma >> speed;
    const double phase = 2 * std::numbers::pi * (0.1 * t + (end_hz - 0.1) / 40 * t * t);
    EXPECT_NEAR(target, amplitude * std::sin(phase), 1e-9);
    if (count > 0) fastest = std::max(fastest, std::abs(target - last) / (t - last_time));
    last = target, last_time = t;
    ++count;
  }
  EXPECT_EQ(count, 10001u);
  const double limit = 0.8 * request.speed_limit_rad_per_s;
  EXPECT_LE(fastest, limit);
  EXPECT_GT(fastest, 0.98 * limit);  // the chirp uses what it may
}

TEST(ChirpTest, RefusesWhatMakesNoChirp) {
  const double bad[] = {0, -1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()};
  for (const double value : bad) {
    for (double ChirpRequest::* field : {&ChirpRequest::inertia_kg_m2, &ChirpRequest::natural_frequency_hz,
                                         &ChirpRequest::speed_limit_rad_per_s, &ChirpRequest::amplitude_factor}) {
      ChirpRequest request = Document();
      request.*field = value;
      EXPECT_FALSE(DesignChirps(request).ok()) << value;
    }
    ChirpRequest request = Document();
    request.damping_ratios[1] = value;
    EXPECT_FALSE(DesignChirps(request).ok()) << value;
  }
  ChirpRequest fast = Document();
  fast.amplitude_factor = 1.1;
  EXPECT_FALSE(DesignChirps(fast).ok());
}

}  // namespace
}  // namespace gapscope

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <random>
#include <string>

#include "bench/rows.h"
#include "src/core/file.h"
#include "src/log/log.h"

namespace gapscope::bench {
namespace {

constexpr std::size_t kColumns = 7;
constexpr int kRepeats = 5;

// A log as the real Qube's are: 250 Hz, nine significant digits.
std::string MakeCsv(double bytes) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1);
  std::string csv = "t,u_cmd,u_applied,theta,alpha,theta_dot,alpha_dot\n";
  csv.reserve(static_cast<std::size_t>(bytes) + 200);
  for (std::size_t k = 0; static_cast<double>(csv.size()) < bytes; ++k) {
    const double t = 0.004 * static_cast<double>(k), u = std::clamp(2 * noise(random), -5.0, 5.0);
    const double theta = 0.00306796158 * std::round(100 * noise(random)),
                 alpha = 0.00306796158 * std::round(300 * noise(random));
    fmt::format_to(std::back_inserter(csv), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t, u, u, theta, alpha,
                   noise(random), 3 * noise(random));
  }
  return csv;
}

// The least that any reader must do: every number once.
double FromCharsPass(const std::string& csv) {
  const char* p = csv.data() + csv.find('\n') + 1;
  const char* end = csv.data() + csv.size();
  double sum = 0;
  while (p < end) {
    double value = 0;
    p = std::from_chars(p, end, value).ptr + 1;
    sum += value;
  }
  return sum;
}

}  // namespace

Result<std::vector<Row>> ReadRows(const BenchOptions& options) {
  const std::string path = options.folder + "/gapscope_bench_" + std::to_string(getpid()) + ".csv";
  struct Remover {
    const std::string& path;
    ~Remover() { std::remove(path.c_str()); }
  } remover{path};
  const std::string csv = MakeCsv(1e6 * options.csv_mb);
  GS_RETURN_IF_ERROR(WriteFile(path, csv));
  volatile double sink = 0;
  std::size_t rows = 0, columns = 0;
  const Pairs pairs = TimePairs(
      Clock::kThread, kRepeats,
      [&] {
        const auto log = ReadLog(path, {});
        rows = log.ok() ? log.value().rows() : 0;
        columns = log.ok() ? log.value().columns.size() : 0;
      },
      [&] { sink = sink + FromCharsPass(csv); });
  const auto lines = static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n'));
  if (rows + 1 != lines || columns != kColumns) {
    return Error{.what = "the CSV came back with another shape",
                 .where = path,
                 .actual = std::to_string(rows) + " rows",
                 .allowed = std::to_string(lines - 1)};
  }
  const double megabytes = 1e-6 * static_cast<double>(csv.size());
  std::vector<double> rates, ratios;
  for (std::size_t i = 0; i < pairs.a_s.size(); ++i) {
    rates.push_back(megabytes / pairs.a_s[i]);
    ratios.push_back(pairs.b_s[i] / pairs.a_s[i]);
  }
  Row rate{.name = "read_csv_mb_per_s", .target = 150}, ratio{.name = "read_csv_vs_from_chars", .target = 0.9};
  Summarise(rates, rate);
  Summarise(ratios, ratio);
  rate.detail = fmt::format("{:.0f} MB, {:.1f} million numbers", megabytes, 1e-6 * static_cast<double>(rows * columns));
  ratio.detail = fmt::format("std::from_chars alone {:.0f} MB/s", megabytes / Quantile(pairs.b_s, 0.5));
  return std::vector<Row>{rate, ratio};
}

}  // namespace gapscope::bench

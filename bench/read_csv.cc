// How fast a CSV log is read, against the least that any reader must do: one pass of std::from_chars over the same
// bytes. Both on one core, in the same run, the file in the page cache; rates in 10^6 bytes per second.
//   bench_read_csv [--megabytes N] [--repeats N] [--json FILE]
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "src/core/file.h"
#include "src/log/csv_reader.h"
#include "src/log/log.h"

namespace {

// A log of a qube: 250 Hz, nine significant digits, as the real ones have.
std::string MakeCsv(std::size_t bytes) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1);
  std::string csv = "t,u_cmd,u_applied,theta,alpha,theta_dot,alpha_dot\n";
  csv.reserve(bytes + 200);
  for (std::size_t k = 0; csv.size() < bytes; ++k) {
    const double t = 0.004 * static_cast<double>(k), u = std::clamp(2 * noise(random), -5.0, 5.0);
    fmt::format_to(std::back_inserter(csv), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t, u, u,
                   0.00306796158 * std::round(100 * noise(random)), 0.00306796158 * std::round(300 * noise(random)),
                   noise(random), 3 * noise(random));
  }
  return csv;
}

// Every number of the file, and nothing else.
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

double BestSeconds(int repeats, const std::function<void()>& work) {
  double best = 1e300;
  for (int k = 0; k < repeats; ++k) {
    const auto start = std::chrono::steady_clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

}  // namespace

int main(int argc, char** argv) {
  std::size_t megabytes = 200;
  int repeats = 3;
  std::string json;
  for (int k = 1; k + 1 < argc; k += 2) {
    const std::string flag = argv[k];
    if (flag == "--megabytes") megabytes = static_cast<std::size_t>(std::atoi(argv[k + 1]));
    if (flag == "--repeats") repeats = std::atoi(argv[k + 1]);
    if (flag == "--json") json = argv[k + 1];
  }
  const std::string csv = MakeCsv(megabytes * 1'000'000);
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("gapscope_bench_{}.csv", std::random_device{}())).string();
  if (!gapscope::WriteFile(path, csv).ok()) return 2;

  volatile double sink = 0;
  std::size_t rows = 0;
  const double plain_s = BestSeconds(repeats, [&] { sink = sink + FromCharsPass(csv); });
  const double parse_s = BestSeconds(repeats, [&] { rows = gapscope::ReadCsv(path, csv).value().rows(); });
  const double whole_s = BestSeconds(repeats, [&] { rows = gapscope::ReadLog(path, {}).value().rows(); });
  std::filesystem::remove(path);

  const double size = static_cast<double>(csv.size()) / 1e6;
  std::printf("%.0f MB, %zu rows, 7 columns, best of %d, one core\n", size, rows, repeats);
  std::printf("  std::from_chars alone      %7.1f MB/s\n", size / plain_s);
  std::printf("  ReadCsv, bytes to columns  %7.1f MB/s  %.2f of from_chars\n", size / parse_s, plain_s / parse_s);
  std::printf("  ReadLog, file to columns   %7.1f MB/s  %.2f of from_chars\n", size / whole_s, plain_s / whole_s);
  if (json.empty()) return 0;
  const std::string text = fmt::format(
      "{{\"schema\": \"gapscope.bench/1\", \"rows\": [\n"
      "  {{\"name\": \"read_csv.mb_per_s\", \"value\": {0:.1f}, \"low\": {0:.1f}, \"high\": {0:.1f}, \"target\": 150, "
      "\"better\": \"higher\"}},\n"
      "  {{\"name\": \"read_csv_vs_from_chars\", \"value\": {1:.3f}, \"low\": {1:.3f}, \"high\": {1:.3f}, \"target\": "
      "0.5, \"better\": \"higher\"}}]}}\n",
      size / whole_s, plain_s / whole_s);
  return gapscope::WriteFile(json, text).ok() ? 0 : 2;
}

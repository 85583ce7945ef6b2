#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "bench/rows.h"
#include "src/log/log.h"

namespace gapscope::bench {
namespace {

constexpr std::size_t kColumns = 6;

// Rows as a logger writes them: a stamp, a command with few digits, encoder angles and speeds with all of theirs.
std::size_t WriteCsv(const std::string& path, double bytes_wanted) {
  std::ofstream file(path, std::ios::binary);
  std::string block = "time_s,voltage_v,arm_rad,pendulum_rad,arm_speed_rad_per_s,current_a\n";
  std::size_t bytes = 0, rows = 0;
  const auto append = [&block](double value, char after) {
    char text[32];
    block.append(text, std::to_chars(text, text + sizeof text, value).ptr);
    block += after;
  };
  while (static_cast<double>(bytes) < bytes_wanted) {
    const double t = 0.002 * static_cast<double>(rows);
    append(t, ',');
    append(std::round(1000 * std::sin(t)) / 1000, ',');
    append(std::round(300 * std::sin(3 * t)) * 0.0030679615757712823, ',');
    append(std::round(200 * std::cos(7 * t)) * 0.0030679615757712823, ',');
    append(3 * std::cos(3.1 * t), ',');
    append(0.1 * std::sin(5.3 * t), '\n');
    ++rows;
    if (block.size() > (1u << 20)) {
      bytes += block.size();
      file << block;
      block.clear();
    }
  }
  file << block;
  return file.good() ? rows : 0;
}

}  // namespace

Result<std::vector<Row>> ReadRows(const BenchOptions& options) {
  const std::string path = options.folder + "/gapscope_bench_" + std::to_string(std::hash<std::string>{}(options.folder) % 10000) + ".csv";
  struct Remover {
    const std::string& path;
    ~Remover() { std::remove(path.c_str()); }
  } remover{path};
  const std::size_t rows = WriteCsv(path, 1e6 * options.csv_mb);
  if (rows == 0) return Error{.what = "cannot write the benchmark's CSV", .where = path};
  const double megabytes = 1e-6 * static_cast<double>(std::filesystem::file_size(path));
  std::vector<double> rates;
  for (int i = 0; i < 5; ++i) {
    const double begin = Now_s(Clock::kWall);
    GS_ASSIGN(const Log log, ReadLog(path, {}));
    rates.push_back(megabytes / (Now_s(Clock::kWall) - begin));
    if (log.rows() != rows || log.columns.size() != kColumns) {
      return Error{.what = "the CSV came back with another shape", .where = path, .actual = std::to_string(log.rows()) + " rows", .allowed = std::to_string(rows)};
    }
  }
  Row row{.name = "read_csv_mb_per_s", .target = 150};
  Summarise(rates, row);
  row.detail = fmt::format("{:.0f} MB, {:.1f} million numbers", megabytes, 1e-6 * static_cast<double>(rows * kColumns));
  return std::vector<Row>{row};
}

}  // namespace gapscope::bench

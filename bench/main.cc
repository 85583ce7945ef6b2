// gapscope_bench: every row is a ratio or a rate whose two sides are measured in the same run. Table on stdout, JSON
// with --json FILE.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/rows.h"
#include "src/core/file.h"

namespace gapscope::bench {
namespace {

void Print(const Row& row) {
  const bool met = row.better == "higher" ? row.value >= row.target : row.value <= row.target;
  fmt::print("{:<34} {:>8.4g} {:>8.4g} {:>8.4g} {:>8.4g} {:<5} {}\n", row.name, row.value, row.low, row.high,
             row.target, met ? "met" : "MISSED", row.detail);
  std::fflush(stdout);
}

std::string ToJson(const std::vector<Row>& rows) {
  nlohmann::ordered_json json = {{"schema", "gapscope.bench/1"}, {"rows", nlohmann::ordered_json::array()}};
  for (const Row& row : rows) {
    json["rows"].push_back({{"name", row.name},
                            {"value", row.value},
                            {"low", row.low},
                            {"high", row.high},
                            {"target", row.target},
                            {"better", row.better},
                            {"detail", row.detail}});
  }
  return json.dump(2) + "\n";
}

Result<std::vector<Row>> RunAll(const BenchOptions& options, const std::string& only) {
  using Group = Result<std::vector<Row>> (*)(const BenchOptions&);
  const std::pair<const char*, Group> groups[] = {{"replay", ReplayRows},   {"windows", WindowRows},
                                                  {"scaling", ScalingRows}, {"plugins", PluginRows},
                                                  {"read", ReadRows},       {"render", RenderRows}};
  fmt::print("{:<34} {:>8} {:>8} {:>8} {:>8}\n", "row", "median", "10 %", "90 %", "target");
  std::vector<Row> rows;
  for (const auto& [name, group] : groups) {
    if (!only.empty() && only != name) continue;
    GS_ASSIGN(const std::vector<Row> made, group(options));
    for (const Row& row : made) Print(row);
    rows.insert(rows.end(), made.begin(), made.end());
  }
  return rows;
}

}  // namespace
}  // namespace gapscope::bench

int main(int argc, char** argv) {
  using namespace gapscope;
  CLI::App program{"Benchmarks of gapscope; both sides of a ratio are measured in the same run.", "gapscope_bench"};
  bench::BenchOptions options;
  std::string json, only;
  program.add_option("--json", json, "File for the rows as JSON");
  program.add_option("--only", only, "One group")
      ->check(CLI::IsMember({"replay", "windows", "scaling", "plugins", "read", "render"}));
  program.add_option("--repeats", options.repeats, "Pairs per ratio")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  program.add_option("--csv-mb", options.csv_mb, "Size of the CSV, MB")
      ->check(CLI::Range(1.0, 10000.0))
      ->capture_default_str();
  program.add_option("--folder", options.folder, "Where the CSV is made")->capture_default_str();
  CLI11_PARSE(program, argc, argv);
  const auto rows = bench::RunAll(options, only);
  if (!rows.ok()) {
    fmt::print(stderr, "gapscope_bench: {}\n", rows.error().Text());
    return 2;
  }
  if (!json.empty()) {
    if (const auto written = WriteFile(json, bench::ToJson(rows.value())); !written.ok()) {
      fmt::print(stderr, "gapscope_bench: {}\n", written.error().Text());
      return 2;
    }
  }
  return 0;
}

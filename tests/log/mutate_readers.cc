// A seeded mutation test of the log readers: valid samples of each format are damaged at random and taken the whole way
// (reading, timeline, columns, inspect). It must end without a crash; broken inputs must be refused with file and line.
//   mutate_readers [--seconds N] [--seed S]
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "src/log/bam_reader.h"
#include "src/log/csv_reader.h"
#include "src/log/inspect.h"
#include "src/log/list_reader.h"
#include "src/log/npz_reader.h"
#include "src/log/timeline.h"
#include "tests/log/npz_fixture.h"

namespace gapscope {
namespace {

struct Sample {
  const char* path;
  std::string bytes;
  Result<Log> (*read)(const std::string& path, std::string_view bytes);
};

// Damage to an archive is found by its checksums; here it is done to the arrays, and packed behind right ones.
Result<Log> ReadPacked(const std::string& path, std::string_view bytes) {
  std::vector<Member> members;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t end = std::min(bytes.find("|||", at), bytes.size());
    const std::size_t name = std::min(bytes.find(':', at), end);
    members.push_back({std::string(bytes.substr(at, name - at)),
                       std::string(bytes.substr(std::min(name + 1, end), end - std::min(name + 1, end))),
                       members.size() % 2 == 1});
    at = end + 3;
  }
  return ReadNpz(path, Zip(members));
}

std::vector<Sample> NpzSamples() {
  std::vector<double> t, q;
  for (int k = 0; k < 40; ++k) t.push_back(0.004 * k), q.push_back(0.1 * k);
  const std::string meta = "{\"schema\": \"gapscope.log/1\", \"names\": [\"t\", \"q\"], \"units\": [\"s\", \"rad\"]}";
  const std::string table = Npy("|u1", "(" + std::to_string(meta.size()) + ",)", meta);
  return {{"log.npz", Zip({{"t.npy", Npy(t)}, {"q.npy", Npy("<f4", "(40, 2)", BytesOf(t)), true}}), ReadNpz},
          {"log.npz", "t.npy:" + Npy(t) + "|||q.npy:" + Npy("<i2", "(40, 4)", BytesOf(q)), ReadPacked},
          {"log.npz", "meta.npy:" + table + "|||c0.npy:" + Npy(t) + "|||c1.npy:" + Npy(q), ReadPacked}};
}

std::vector<Sample> Samples() {
  std::string csv = "time_s,voltage_v,arm_rad\n", german = "\xEF\xBB\xBFZeit [ms];\"u (V)\";x [\xC2\xB0]\r\n";
  std::string json = "{\"mass\": 0.49, \"kp\": 100, \"motor\": \"xl330\", \"entries\": [";
  for (int k = 0; k < 40; ++k) {
    csv += std::to_string(0.004 * k) + "," + std::to_string(k % 7 - 3) + "," + std::to_string(0.1 * k) + "\n";
    german += std::to_string(4 * k) + ",0;1," + std::to_string(k) + ";\"-2,5\"\r\n";
    json += std::string(k ? ", " : "") + "{\"timestamp\": " + std::to_string(0.005 * k) +
            ", \"position\": " + std::to_string(0.3 * k - 2) + ", \"load\": " + std::to_string(65530 + k) +
            ", \"on\": " + (k % 2 ? "true" : "false") + "}";
  }
  return {
      {"log.csv", csv, ReadCsv},
      {"log.csv", german, ReadCsv},
      {"log.csv",
       "# rig 3\n%time,field.x, "
       "field.y\n1700000000000000000,1,nan\n1700000000004000000,2,\n1700000000008000000,inf,3\n",
       ReadCsv},
      {"log.csv", "time,x,time,y\nUnit: s,Unit: V,Unit: ms,Unit: rad\n0,1,0,1\n0.1,true,,2\n0.1,3,2,\n0,4,3,1\n",
       ReadCsv},
      {"log.csv", "t x  y\n0 1.5 2\n# note\n0.1 -2e-3 +4\nt x  y\n0.2 .5 nan\n", ReadCsv},
      {"log.csv",
       "type,timestamp,positions,torques\nS,1,\"[0.1, -2]\",\"[nan, 1e-3]\"\nS,2,\"[3, 4]\",\n"
       "S,3,\"[5,6]\",\"[7,8]\"\n",
       ReadCsvLists},
      {"log.json", json + "]}", ReadBamJson},
      {"log.json",
       "{\n \"a\": {\"b\": [1, {\"c\": null}]},\n \"entries\": [\n  {\"t\": 0, \"x\": NaN},\n  {\"t\": 1e-3, \"y\": "
       "-Infinity}\n ]\n}\n",
       ReadBamJson},
  };
}

using Random = std::mt19937_64;

// Pieces that have broken readers before.
const std::vector<std::string>& Dictionary() {
  static const std::vector<std::string> pieces = {",",
                                                  ";",
                                                  "\t",
                                                  "\"",
                                                  "\n",
                                                  "\r",
                                                  "\r\n",
                                                  " ",
                                                  "nan",
                                                  "inf",
                                                  "-inf",
                                                  "1e308",
                                                  "-1e308",
                                                  "1e999",
                                                  "1e-999",
                                                  "4294967295",
                                                  "-0",
                                                  "+",
                                                  "-",
                                                  ".",
                                                  "e",
                                                  "E+",
                                                  "0x",
                                                  "true",
                                                  "#",
                                                  "%",
                                                  "//",
                                                  "sep=;",
                                                  "Unit: s",
                                                  "{",
                                                  "}",
                                                  "[",
                                                  "]",
                                                  ":",
                                                  "null",
                                                  "NaN",
                                                  "\\u00",
                                                  "\\",
                                                  std::string(1, '\0'),
                                                  "\xFF",
                                                  "\xEF\xBB\xBF",
                                                  "\xC2",
                                                  "1000000000",
                                                  "18446744073709551616",
                                                  "\"entries\": [",
                                                  "time",
                                                  "[[[[[[[[",
                                                  "{\"a\":{\"a\":",
                                                  "9999999999999999999999999999999999999999",
                                                  "0.000000000000000000000000000001"};
  return pieces;
}

void Mutate(Random* random, std::string* bytes) {
  const auto pick = [&](std::size_t below) { return below > 0 ? static_cast<std::size_t>((*random)() % below) : 0; };
  // Often only digits: such files are mostly read, and try what comes after reading.
  if (pick(3) == 0) {
    for (std::size_t n = 1 + pick(20); n-- > 0 && !bytes->empty();) {
      char& c = (*bytes)[pick(bytes->size())];
      if (c >= '0' && c <= '9') c = "0123456789-e."[pick(pick(5) == 0 ? 13 : 10)];
    }
    return;
  }
  for (std::size_t n = 1 + pick(pick(2) == 0 ? 1 : 6); n-- > 0;) {
    const std::size_t at = pick(bytes->size() + 1);
    const std::size_t length = std::min(bytes->size() - at, pick(pick(4) == 0 ? 200 : 6));
    switch (pick(8)) {
      case 0:
        bytes->erase(at, length);
        break;
      case 1:
        bytes->resize(at);
        break;
      case 2:
        bytes->insert(at, Dictionary()[pick(Dictionary().size())]);
        break;
      case 3:
        bytes->replace(at, length, Dictionary()[pick(Dictionary().size())]);
        break;
      case 4:
        bytes->insert(pick(bytes->size() + 1), bytes->substr(at, length));
        break;
      case 5:
        if (at < bytes->size()) (*bytes)[at] = static_cast<char>((*random)());
        break;
      case 6:
        if (at < bytes->size()) (*bytes)[at] = static_cast<char>((*bytes)[at] ^ (1 << pick(8)));
        break;
      default: {  // many times the same
        std::string piece = bytes->substr(at, 1 + pick(8)), many;
        for (std::size_t k = pick(300); k-- > 0;) many += piece;
        bytes->insert(at, many);
      }
    }
  }
}

struct Outcome {
  bool accepted = false;
  std::string complaint;  // of this test: an error without a place
};

Outcome Take(const Sample& sample, const std::string& bytes) {
  const auto refused = [&](const Error& error) {
    const bool lines = sample.path != std::string_view("log.npz");
    const bool placed =
        error.where.starts_with(std::string(sample.path) + (lines ? ":" : "")) && error.Text().size() < 20'000;
    return Outcome{false, placed && !error.what.empty() ? "" : "an error without file and line: " + error.Text()};
  };
  const Result<Log> log = sample.read(sample.path, bytes);
  if (!log.ok()) return refused(log.error());
  for (const auto& column : log.value().columns) {
    if (column.values.size() != log.value().rows()) return {true, "columns of different lengths"};
  }
  const Result<Timeline> timeline = BuildTimeline(log.value(), {});
  if (!timeline.ok()) return refused(timeline.error());
  for (std::size_t k = 1; k < timeline.value().time_s.size(); ++k) {
    if (!(timeline.value().time_s[k] > timeline.value().time_s[k - 1])) return {true, "a timeline that does not grow"};
  }
  std::vector<InspectChannel> channels;
  std::vector<Finding> findings = log.value().findings;
  for (const auto& column : log.value().columns) {
    auto values = ExtractColumn(log.value(), timeline.value(), column,
                                {.wrap = WrapRepair::kUnwrap, .wrap_period = 6.28}, &findings);
    if (!values.ok()) {
      const Outcome outcome = refused(values.error());
      if (!outcome.complaint.empty()) return outcome;
      continue;
    }
    channels.push_back({column.name, "rad", channels.size() % 2 ? ChannelRole::kMeasured : ChannelRole::kCommand,
                        std::move(values).value()});
    if (channels.size() == 3) break;
  }
  const InspectReport report = Inspect(timeline.value(), channels, findings, log.value().rows());
  return {true, report.fit || !report.unfit_because.empty() ? "" : "unfit without a reason"};
}

int Run(double seconds, std::uint64_t seed) {
  std::vector<Sample> samples = Samples();
  for (Sample& sample : NpzSamples()) samples.push_back(std::move(sample));
  for (const auto& sample : samples) {
    if (const Outcome outcome = Take(sample, sample.bytes); !outcome.accepted) {
      std::fprintf(stderr, "a sample that must be read was refused: %s\n%s\n", outcome.complaint.c_str(),
                   sample.bytes.c_str());
      return 1;
    }
  }
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  std::size_t runs = 0, accepted = 0;
  for (; elapsed_s() < seconds; ++runs) {
    // Each run has its own seed, so that a crash can be repeated alone.
    Random random(seed * 1'000'003 + runs);
    const Sample& sample = samples[random() % samples.size()];
    std::string bytes = sample.bytes;
    Mutate(&random, &bytes);
    const Outcome outcome = Take(sample, bytes);
    accepted += outcome.accepted;
    if (!outcome.complaint.empty()) {
      std::fprintf(stderr, "run %zu of seed %llu: %s\n", runs, static_cast<unsigned long long>(seed),
                   outcome.complaint.c_str());
      return 1;
    }
  }
  std::printf("%zu mutated logs in %.1f s: %zu read, %zu refused, none without file and line\n", runs, elapsed_s(),
              accepted, runs - accepted);
  return 0;
}

}  // namespace
}  // namespace gapscope

int main(int argc, char** argv) {
  double seconds = 1;
  unsigned long long seed = 1;
  for (int k = 1; k < argc; k += 2) {
    const std::string flag = argv[k];
    const char* text = k + 1 < argc ? argv[k + 1] : "";
    const char* end = text + std::strlen(text);
    const bool known = flag == "--seconds" ? std::from_chars(text, end, seconds).ec == std::errc{}
                                           : flag == "--seed" && std::from_chars(text, end, seed).ec == std::errc{};
    if (!known) {
      std::fprintf(stderr, "usage: mutate_readers [--seconds N] [--seed S]\n");
      return 2;
    }
  }
  return gapscope::Run(seconds, seed);
}

// Coverage of the tuner's intervals: logs that a rig's own model makes with random known parameters, noise and encoder
// counts are fitted, and the known values looked for in the 95 % intervals. Run by scripts/recovery.
//   tune_recovery [RUNS] [SECONDS_PER_LOG] [RIG...]
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <random>

#include "tests/tune/fixture.h"

int main(int argc, char** argv) {
  using namespace gapscope;
  using namespace gapscope::testing;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 100;
  const double seconds = argc > 2 ? std::atof(argv[2]) : 2;
  struct Case {
    const char* rig;
    double amplitude;
    std::vector<std::string> known;  // from a data sheet, say: without them the rest is known up to a common factor
  };
  const std::vector<Case> cases = {
      {"joint", 0.3, {}},    {"joint", 0.3, {"motor.kp"}},
      {"qube", 1.5, {}},     {"qube", 1.5, {"motor.resistance", "motor.kt", "pendulum.mass"}},
      {"flexjoint", 2, {}},  {"flexjoint", 2, {"motor.resistance", "motor.kt", "motor.km"}},
      {"flexlink", 0.3, {}}, {"flexlink", 0.3, {"motor.torque_per_ampere"}}};
  ThreadPool pool(DefaultWorkers());
  int status = 0;
  for (const Case& c : cases) {
    bool asked = argc <= 3;
    for (int i = 3; i < argc; ++i) asked = asked || std::string(argv[i]) == c.rig;
    if (!asked) continue;
    const auto begin = std::chrono::steady_clock::now();
    const auto rig = LoadRig(c.rig);
    const auto& parameters = rig.model->parameters();
    std::vector<int> inside(parameters.size(), 0), known(parameters.size(), 0);
    std::vector<double> width(parameters.size(), 0);
    int converged = 0, done = 0;
    const auto given = [&](const Parameter& p) {
      return std::find(c.known.begin(), c.known.end(), p.name) != c.known.end();
    };
    std::vector<int> free;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (!parameters[i].frozen && parameters[i].low < parameters[i].high && !given(parameters[i]))
        free.push_back(static_cast<int>(i));
    }
    for (int run = 0; run < runs; ++run) {
      std::mt19937_64 random(static_cast<unsigned long>(1000 + run));
      std::normal_distribution<double> normal(0, 1);
      std::vector<double> truth = rig.model->Nominal();
      for (std::size_t i = 0; i < truth.size(); ++i) {
        const Parameter& p = parameters[i];
        const double draw = normal(random);
        if (!p.frozen && p.low > 0 && !given(p))
          truth[i] = std::clamp(p.nominal * std::exp(0.12 * draw), p.low * 1.05, p.high / 1.05);
      }
      std::vector<Recording> logs;
      for (int k = 0; k < 3; ++k) {
        const auto command = [&](double t) {
          return c.amplitude * (std::sin((3 + 2 * k) * t + (3 + k) * t * t) + 0.5 * (std::fmod(t, 1.0) < 0.5 ? 1 : -1));
        };
        logs.push_back(
            MakeLog(rig, truth, command, seconds, 0.004, 1e-3, static_cast<unsigned long>(7919 * run + k), 0.002));
      }
      const auto found = Tune(*rig.model, SplitData(std::move(logs), {}), rig.model->Nominal(),
                              {.free = free, .time_step_s = 0.002, .starts = 1}, pool);
      if (!found.ok()) continue;
      ++done;
      converged += found.value().termination == Termination::kConverged;
      for (const auto& t : found.value().tuned) {
        const auto i = static_cast<std::size_t>(t.index);
        if (!t.identifiable) continue;
        ++known[i];
        inside[i] += t.low <= truth[i] && truth[i] <= t.high;
        width[i] += (t.high - t.low) / truth[i];
      }
    }
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    fmt::print("{}{}{}: {} runs of 2 + 1 logs of {} s, {} converged, {:.0f} s\n", c.rig,
               c.known.empty() ? "" : ", known: ", fmt::join(c.known, ", "), done, seconds, converged, wall_s);
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      if (std::find(free.begin(), free.end(), static_cast<int>(i)) == free.end()) continue;
      if (known[i] == 0) {
        fmt::print("  {:<28} reported flat in all runs\n", parameters[i].name);
        continue;
      }
      const int missed = known[i] - inside[i];
      status = missed > 0.1 * done ? 1 : status;
      fmt::print(
          "  {:<28} known in {:>3} runs, flat in the others; outside its interval in {:>3}, mean width {:.2g} of the "
          "value\n",
          parameters[i].name, known[i], missed, width[i] / known[i]);
    }
    std::fflush(stdout);
  }
  return status;
}

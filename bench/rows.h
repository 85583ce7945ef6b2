// What the benchmark measures, one function per group of rows.
#ifndef GAPSCOPE_BENCH_ROWS_H_
#define GAPSCOPE_BENCH_ROWS_H_

#include <string>
#include <vector>

#include "bench/measure.h"
#include "src/core/result.h"

namespace gapscope::bench {

struct BenchOptions {
  int repeats = 31;
  double csv_mb = 200;          // size of the file that is read
  std::string folder = "/tmp";  // where it is made
};

// replay_vs_mj_step.RIG: steps per second of Replay() with one worker, free run of 10 s, over those of a loop that
// writes the command of each log row and calls mj_step as often: same compiled model and parameters, time step, length,
// disable flags and initial state. Processor time.
Result<std::vector<Row>> ReplayRows(const BenchOptions& options);

// replay_windows_vs_mj_step.qube: the same with 1,000 windows of 50 ms, each started from the log, against one loop
// that is never reset.
Result<std::vector<Row>> WindowRows(const BenchOptions& options);

// scaling_1_to_2.qube: wall time of those 1,000 windows with one worker over that with two. The detail says what two
// threads of bare mj_step gain over one in the same minute, which is what the machine had to give.
Result<std::vector<Row>> ScalingRows(const BenchOptions& options);

// read_csv_mb_per_s: ReadLog() of a CSV in the page cache, one thread; bytes of the file per second of its processor
// time, MB = 1e6.
// read_csv_vs_from_chars: the same as a share of the rate of one pass of std::from_chars over the same bytes in memory.
Result<std::vector<Row>> ReadRows(const BenchOptions& options);

// plugin_cost.PLUGIN.{neutral,active}: processor time of a step of one servo joint with the plugin, neutral or with all
// stages at work, over the same model with native elements only (friction: over a native frictionloss).
Result<std::vector<Row>> PluginRows(const BenchOptions& options);

// render_vs_real_time.RIG: seconds of a video over the wall seconds to make it: 10 s at 30 frames per second, 1280x720,
// measured over simulated, all workers, replay and encoding included.
Result<std::vector<Row>> RenderRows(const BenchOptions& options);

}  // namespace gapscope::bench

#endif  // GAPSCOPE_BENCH_ROWS_H_

#include <fmt/core.h>
#include <unistd.h>

#include <filesystem>

#include "bench/case.h"
#include "bench/rows.h"
#include "src/video/video.h"

namespace gapscope::bench {
namespace {

constexpr double kSeconds = 10;
constexpr int kRenders = 3;

}  // namespace

Result<std::vector<Row>> RenderRows(const BenchOptions& options) {
  std::vector<Row> rows;
  ThreadPool pool(DefaultWorkers());
  for (const std::string rig : {"qube", "flexlink"}) {
    GS_ASSIGN(Case bench_case, MakeCase(rig, kSeconds));
    // Measured and simulated apart, so that both mechanisms are drawn.
    Recording& recording = bench_case.recordings.front();
    for (auto& measured : recording.measured) {
      for (double& value : measured.values) value += 0.1;
    }
    const std::string out =
        (std::filesystem::path(options.folder) / fmt::format("gapscope_bench_{}.mp4", getpid())).string();
    const std::vector<VideoModel> models = {{"nominal", bench_case.model, bench_case.values}};
    std::vector<double> ratios;
    VideoSummary last;
    for (int k = 0; k <= kRenders; ++k) {
      GS_ASSIGN(last, RenderVideo(recording, models, {.out = out, .frames_per_s = 30}, pool));
      if (k > 0) ratios.push_back(last.length_s / last.wall_s);  // the first one warms the shader compiler's caches
      std::filesystem::remove(out);
    }
    Row row{.name = "render_vs_real_time." + rig, .target = 2};
    Summarise(ratios, row);
    row.detail = fmt::format("{} frames of 1280x720, overlay, in {:.2f} s with {} workers", last.frames, last.wall_s,
                             pool.workers());
    rows.push_back(row);
  }
  return rows;
}

}  // namespace gapscope::bench

#include "src/report/render_report.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/report/json.h"

namespace gapscope {

using nlohmann::ordered_json;

ordered_json ToJson(const RenderRun& run) {
  ordered_json json = {{"schema", "gapscope.render/1"},
                       {"out", run.out},
                       {"log", run.log},
                       {"frames", run.frames},
                       {"width", run.width},
                       {"height", run.height},
                       {"frames_per_s", run.frames_per_s},
                       {"first_s", run.first_s},
                       {"last_s", run.last_s},
                       {"video_s", run.video_s},
                       {"models", ordered_json::array()},
                       {"gl", run.gl},
                       {"wall_s", run.wall_s},
                       {"versions", JsonVersions(run.info)}};
  for (const auto& model : run.models)
    json["models"].push_back({{"label", model.label}, {"error", JsonNumber(model.error)}});
  return json;
}

std::string ToTable(const RenderRun& run) {
  std::string text = run.out + "\n";
  if (!run.shown_in.empty()) text += fmt::format("  shown in {}\n", run.shown_in);
  for (const auto& model : run.models) text += fmt::format("  {:<32} error {:.4g}\n", model.label, model.error);
  if (run.video_s > 0) {
    text += fmt::format("  {} frames of {}x{}, {:.2f} s of video for {:.2f} s of the log; {:.1f} s to make ({})\n",
                        run.frames, run.width, run.height, run.video_s, run.last_s - run.first_s, run.wall_s, run.gl);
  } else {
    text += fmt::format("  {}x{} at {:.3f} s of the log\n", run.width, run.height, run.first_s);
  }
  return text;
}

}  // namespace gapscope

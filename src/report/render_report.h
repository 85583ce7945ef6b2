// What a rendered video, GIF or still shows, for people and programs: console lines, JSON (gapscope.render/1).
#ifndef GAPSCOPE_REPORT_RENDER_REPORT_H_
#define GAPSCOPE_REPORT_RENDER_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/report/run.h"

namespace gapscope {

struct RenderRun {
  struct Model {
    std::string label;
    double error = 0;  // normalised
  };
  RunInfo info;
  std::string out, log;       // paths
  std::string shown_in;       // a report that shows the video now; empty: none
  std::vector<Model> models;  // that were drawn
  std::size_t frames = 0;
  int width = 0, height = 0;
  double frames_per_s = 0;
  double first_s = 0, last_s = 0;  // of the log
  double video_s = 0;              // its length; 0: a still
  std::string gl;                  // OpenGL backend
  double wall_s = 0;
};

nlohmann::ordered_json ToJson(const RenderRun& run);
std::string ToTable(const RenderRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_RENDER_REPORT_H_

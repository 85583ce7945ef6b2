// A frame of a comparison video: scenes, each with its label and errors, and traces with a cursor at the frame's time.
// Up to three signals stand below the scenes; of more the first ones stand beside them, a small picture each. Drawn
// with cairo.
#ifndef GAPSCOPE_VIDEO_PAGE_H_
#define GAPSCOPE_VIDEO_PAGE_H_

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "replay/scene.h"

namespace gapscope {

class Canvas;

struct PageTraces {
  struct Signal {
    std::string name, unit;
    bool moves = false;  // a position: seen in the scene
    std::vector<double> measured;
    std::vector<std::vector<double>> predicted;  // by model
  };
  struct Command {
    std::string name, unit;
    std::vector<double> values;  // held from stamp to stamp
  };
  std::vector<double> time_s;
  std::vector<Signal> signals;  // the most important first: as many as fit are drawn
  std::vector<Command> commands;
};
// So many signals are drawn in full below the scenes.
inline constexpr std::size_t kSignalsBelow = 3;

struct PageModel {
  std::string label;
  double error = 0;           // of the log, normalised
  double diverged_at_s = -1;  // from here on there is nothing to show; negative: never
};

struct PageOptions {
  int width = 1280, height = 720;
  double from_s = 0, to_s = 0;  // what the time axis shows
  double speed = 1;
  std::string title;
  bool side_by_side = false;  // a panel with the measured mechanism first; else it is a ghost in every panel
};

// The colour that stands for what was measured, and those of the models, as red, green, blue.
std::array<float, 3> MeasuredColour();
std::array<float, 3> ModelColour(std::size_t model);

// Thread-safe once made: workers compose frames at once.
class Page {
 public:
  Page(PageOptions options, PageTraces traces, std::vector<PageModel> models);
  ~Page();

  // Size of one scene, and how many there are: one for each model, and the measured one's first when side by side.
  int scene_width() const { return scene_width_; }
  int scene_height() const { return scene_height_; }
  std::size_t panels() const { return panels_; }

  // The frame at `time_s`; `scenes` has panels() pictures of the scenes' size. `frame` becomes width x height.
  void Compose(std::span<const Picture> scenes, double time_s, Picture& frame) const;

 private:
  struct Row {
    double top, height, low, high;  // in pixels of the traces' part; in the signal's unit
  };
  void LayOut();
  void AddRow(const std::vector<const std::vector<double>*>& shown, double height, double pad);
  void DrawPaper(Canvas& canvas) const;
  void DrawScale(Canvas& canvas, const Row& row, const std::string& name, const std::string& unit) const;
  void DrawStrip(Canvas& canvas, bool past) const;
  // `steps`: held from stamp to stamp.
  void DrawLine(Canvas& canvas, const Row& row, const std::vector<double>& values, bool steps) const;
  void DrawTimeAxis(Canvas& canvas, double left) const;
  void CopyStrip(double time_s, Picture& frame) const;
  void DrawCursor(Canvas& canvas, double time_s) const;
  std::vector<std::array<std::string, 3>> ErrorsNow(std::size_t model, double time_s) const;
  void DrawErrors(Canvas& canvas, double time_s) const;
  void DrawPanel(Canvas& canvas, std::size_t panel, double time_s) const;
  void DrawClock(Canvas& canvas, double time_s) const;
  bool shows_command() const { return !beside_ && !traces_.commands.empty(); }
  int StripBegin(double time_s) const;  // what of the strip is seen, pixels

  PageOptions options_;
  PageTraces traces_;
  std::vector<PageModel> models_;
  double unit_ = 1;  // one pixel of a picture 720 high
  int scene_width_ = 0, scene_height_ = 0;
  std::size_t panels_ = 1, signals_in_all_ = 0;
  bool beside_ = false;                              // the traces stand beside the scenes
  int left_ = 0, top_ = 0;                           // of the traces' part
  int plot_left_ = 0, plot_width_ = 0, margin_ = 0;  // in it; a plot reaches `margin_` further
  double pixels_per_s_ = 1;                          // of the strip
  bool rolls_ = false;                               // the strip is longer than the plot
  double axis_top_ = 0;
  std::vector<Row> rows_;  // signals, then the first command where it is shown
  Picture paper_;          // names, units and limits
  Picture future_, past_;  // the plots over the whole time, pale and full
};

}  // namespace gapscope

#endif  // GAPSCOPE_VIDEO_PAGE_H_

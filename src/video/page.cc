#include "src/video/page.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "src/compare/decimate.h"
#include "src/core/statistics.h"
#include "src/video/canvas.h"

namespace gapscope {
namespace {

constexpr Colour kInk = {0.11, 0.14, 0.18}, kFaint = {0.42, 0.46, 0.52}, kGrid = {0.89, 0.91, 0.93},
                 kError = {0.86, 0.20, 0.18};
// Blue against orange: told apart by every eye.
constexpr Colour kMeasured = {0.0, 0.50, 0.86};
constexpr Colour kModels[] = {{0.91, 0.42, 0.04}, {0.18, 0.60, 0.28}, {0.55, 0.27, 0.78}, {0.60, 0.45, 0.10}};

Colour OfModel(std::size_t model) { return kModels[model % std::size(kModels)]; }

// Places in a picture 720 pixels high.
constexpr double kGutter = 132, kRightMargin = 74, kAxisHeight = 24, kRowGap = 7, kTopGap = 8;
constexpr double kSignalRow = 62, kCommandRow = 40, kMargin = 8;
// Beside the scenes: the traces' part, what stands over all of it, and over each plot.
constexpr double kColumn = 440, kColumnGutter = 16, kColumnTitle = 26, kRowTitle = 17;
constexpr std::size_t kSignalsBeside = 8, kPanelsBeside = 2;
// A strip that rolls shows so many seconds of the video, and is never wider than kWidestStrip pixels.
constexpr double kRolling_s = 8, kWidestStrip = 16000;

// -0.312, +1.2e-05: four digits and a sign.
std::string Signed(double value) {
  if (!std::isfinite(value)) return "-";
  const std::string size = std::abs(value) < 1e-3 && value != 0 ? fmt::format("{:.1e}", std::abs(value))
                                                                : fmt::format("{:.3f}", std::abs(value));
  return fmt::format("{}{}", value < 0 ? "\u2212" : "+", size);
}
std::string Short(double value) { return fmt::format("{}{:.3g}", value < 0 ? "\u2212" : "", std::abs(value)); }

double Interpolate(const std::vector<double>& time, const std::vector<double>& values, double t) {
  const std::size_t after = static_cast<std::size_t>(std::upper_bound(time.begin(), time.end(), t) - time.begin());
  if (after == 0) return values.front();
  if (after == time.size()) return values.back();
  const double a = values[after - 1], b = values[after];
  // A prediction that restarts at a stamp has none there: the neighbour's serves.
  if (!std::isfinite(a) || !std::isfinite(b)) return std::isfinite(a) ? a : b;
  return a + (b - a) * (t - time[after - 1]) / (time[after] - time[after - 1]);
}
double Held(const std::vector<double>& time, const std::vector<double>& values, double t) {
  const std::size_t after = static_cast<std::size_t>(std::upper_bound(time.begin(), time.end(), t) - time.begin());
  return values[after > 0 ? after - 1 : 0];
}

// 1, 2 or 5 times a power of ten: about `count` steps in `range`.
double NiceStep(double range, double count) {
  const double raw = range / count, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

}  // namespace

std::array<float, 3> MeasuredColour() {
  return {static_cast<float>(kMeasured.r), static_cast<float>(kMeasured.g), static_cast<float>(kMeasured.b)};
}
std::array<float, 3> ModelColour(std::size_t model) {
  const Colour c = OfModel(model);
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)};
}

Page::Page(PageOptions options, PageTraces traces, std::vector<PageModel> models)
    : options_(std::move(options)), traces_(std::move(traces)), models_(std::move(models)) {
  GS_CHECK(!models_.empty() && options_.to_s > options_.from_s && !traces_.signals.empty());
  LayOut();
  paper_.width = options_.width - left_;
  future_.width = past_.width =
      2 * margin_ + static_cast<int>(std::ceil((options_.to_s - options_.from_s) * pixels_per_s_));
  for (Picture* picture : {&paper_, &future_, &past_}) {
    picture->height = options_.height - top_;
    picture->pixels.assign(static_cast<std::size_t>(picture->width) * static_cast<std::size_t>(picture->height),
                           0xffffffffu);
    Canvas canvas(*picture);
    picture == &paper_ ? DrawPaper(canvas) : DrawStrip(canvas, picture == &past_);
  }
}

Page::~Page() = default;

void Page::LayOut() {
  unit_ = options_.height / 720.0;
  panels_ = models_.size() + (options_.side_by_side ? 1 : 0);
  signals_in_all_ = traces_.signals.size();
  beside_ = signals_in_all_ > kSignalsBelow && panels_ <= kPanelsBeside;
  traces_.signals.resize(std::min(signals_in_all_, beside_ ? kSignalsBeside : kSignalsBelow));
  const double signals = static_cast<double>(traces_.signals.size());
  double row = kSignalRow;
  if (beside_) {
    left_ = options_.width - static_cast<int>(std::min(kColumn * unit_, 0.45 * options_.width));
    left_ -= left_ % 2;
    scene_height_ = options_.height;
    row = (720 - kColumnTitle - kAxisHeight) / signals - kRowTitle - kRowGap;
  } else {
    const double height = kTopGap + kAxisHeight + signals * (kSignalRow + kRowGap) +
                          (traces_.commands.empty() ? 0 : kCommandRow + kRowGap);
    scene_height_ = options_.height - static_cast<int>(height * unit_);
    scene_height_ -= scene_height_ % 2;
    top_ = scene_height_;
  }
  scene_width_ = (beside_ ? left_ : options_.width) / static_cast<int>(panels_);
  axis_top_ = (beside_ ? kColumnTitle : kTopGap) * unit_;
  for (const auto& signal : traces_.signals) {
    std::vector<const std::vector<double>*> shown = {&signal.measured};
    for (const auto& predicted : signal.predicted) shown.push_back(&predicted);
    AddRow(shown, row * unit_, 0.06);
  }
  if (shows_command()) AddRow({&traces_.commands.front().values}, kCommandRow * unit_, 0.08);
  axis_top_ = rows_.back().top + rows_.back().height;

  margin_ = static_cast<int>(kMargin * unit_);
  plot_left_ = static_cast<int>((beside_ ? kColumnGutter : kGutter) * unit_);
  plot_width_ = options_.width - left_ - plot_left_ - static_cast<int>(kRightMargin * unit_);
  const double span = options_.to_s - options_.from_s, seen = kRolling_s * options_.speed;
  rolls_ = beside_ && span > 1.5 * seen;
  pixels_per_s_ = rolls_ ? std::min(plot_width_ / seen, kWidestStrip / span) : plot_width_ / span;
}

// Limits of what is shown, from the rows within the page's time; a model that runs away does not squeeze the first one
// of `shown`, what was measured.
void Page::AddRow(const std::vector<const std::vector<double>*>& shown, double height, double pad) {
  double low = kInfinity, high = -kInfinity, lowest = -kInfinity, highest = kInfinity;
  for (const auto* values : shown) {
    for (std::size_t r = 0; r < values->size(); ++r) {
      const double value = (*values)[r];
      if (traces_.time_s[r] < options_.from_s || traces_.time_s[r] > options_.to_s || !std::isfinite(value)) continue;
      low = std::min(low, std::max(value, lowest));
      high = std::max(high, std::min(value, highest));
    }
    if (values != shown.front()) continue;
    if (!(low <= high)) low = high = 0;
    const double room = std::max(1.5 * (high - low), 1e-9);
    lowest = low - room, highest = high + room;
  }
  if (high - low < 1e-12) low -= 0.5, high += 0.5;
  const double more = pad * (high - low);
  const double top = axis_top_ + (beside_ ? kRowTitle * unit_ : 0);
  rows_.push_back({.top = top, .height = height, .low = low - more, .high = high + more});
  axis_top_ = top + height + kRowGap * unit_;
}

void Page::DrawPaper(Canvas& c) const {
  c.Ink(kPaper);
  Cairo().cairo_paint(c.cr);
  for (std::size_t s = 0; s < traces_.signals.size(); ++s)
    DrawScale(c, rows_[s], traces_.signals[s].name, traces_.signals[s].unit);
  if (shows_command()) DrawScale(c, rows_.back(), traces_.commands.front().name, traces_.commands.front().unit);
  if (!rolls_) DrawTimeAxis(c, plot_left_);
  c.Ink(kFaint);
  c.Font(11.5 * unit_);
  if (!beside_) return c.Text("time, s", 12 * unit_, axis_top_ + 17 * unit_);
  c.Text("time, s", options_.width - left_ - 12 * unit_, axis_top_ + 17 * unit_, 1);
  c.Text(signals_in_all_ > traces_.signals.size()
             ? fmt::format("the worst {} of {} signals; right: error now", traces_.signals.size(), signals_in_all_)
             : "the worst first; right: error now",
         plot_left_, 17 * unit_);
}

void Page::DrawScale(Canvas& c, const Row& row, const std::string& name, const std::string& unit) const {
  const double right = plot_left_ + plot_width_ + (kMargin + 4) * unit_;
  c.Ink(kInk);
  c.Font(13 * unit_, true);
  const std::string fitted = c.Fit(name, beside_ ? 0.6 * plot_width_ : (kGutter - 20) * unit_);
  const double after = c.Width(fitted + " ");
  c.Text(fitted, beside_ ? plot_left_ : 12 * unit_,
         beside_ ? row.top - 4 * unit_ : row.top + row.height / 2 - 1 * unit_);
  c.Ink(kFaint);
  c.Font(11.5 * unit_);
  beside_ ? c.Text(unit, plot_left_ + after, row.top - 4 * unit_)
          : c.Text(unit, 12 * unit_, row.top + row.height / 2 + 14 * unit_);
  c.Text(Short(row.high), right, row.top + 11 * unit_);
  c.Text(Short(row.low), right, row.top + row.height - 3 * unit_);
}

void Page::DrawLine(Canvas& c, const Row& row, const std::vector<double>& values, bool steps) const {
  const auto& time = traces_.time_s;
  const std::size_t first =
      static_cast<std::size_t>(std::lower_bound(time.begin(), time.end(), options_.from_s) - time.begin());
  const std::size_t last =
      static_cast<std::size_t>(std::upper_bound(time.begin(), time.end(), options_.to_s) - time.begin());
  const std::size_t begin = first > 0 ? first - 1 : 0, end = std::min(last + 1, time.size());
  const std::span<const double> part(values.data() + begin, end - begin);
  const std::span<const double> parts[] = {part};
  bool pen_down = false;
  double y_before = 0;
  for (const std::size_t r : ExtremeRows(parts, static_cast<std::size_t>(future_.width))) {
    if (!std::isfinite(part[r])) {
      pen_down = false;
      continue;
    }
    const double x = margin_ + (time[begin + r] - options_.from_s) * pixels_per_s_,
                 y = row.top + row.height * (row.high - part[r]) / (row.high - row.low);
    if (pen_down && steps) Cairo().cairo_line_to(c.cr, x, y_before);
    pen_down ? Cairo().cairo_line_to(c.cr, x, y) : Cairo().cairo_move_to(c.cr, x, y);
    pen_down = true;
    y_before = y;
  }
  Cairo().cairo_stroke(c.cr);
}

void Page::DrawStrip(Canvas& c, bool past) const {
  c.Ink(kPaper);
  Cairo().cairo_paint(c.cr);
  const double strength = past ? 1 : 0.28, width = future_.width - 2 * margin_;
  for (std::size_t s = 0; s < rows_.size(); ++s) {
    const Row& row = rows_[s];
    Cairo().cairo_save(c.cr);
    Cairo().cairo_rectangle(c.cr, margin_, row.top, width, row.height);
    Cairo().cairo_clip(c.cr);
    c.Ink({0.972, 0.976, 0.982});
    Cairo().cairo_paint(c.cr);
    if (row.low < 0 && row.high > 0) {
      c.Ink(kGrid);
      Cairo().cairo_set_line_width(c.cr, unit_);
      const double y = row.top + row.height * row.high / (row.high - row.low);
      Cairo().cairo_move_to(c.cr, margin_, y);
      Cairo().cairo_line_to(c.cr, margin_ + width, y);
      Cairo().cairo_stroke(c.cr);
    }
    if (s >= traces_.signals.size()) {
      c.Ink(kFaint, past ? 1 : 0.45);
      Cairo().cairo_set_line_width(c.cr, 1.3 * unit_);
      DrawLine(c, row, traces_.commands.front().values, true);
    } else {
      c.Ink(kMeasured, strength);
      Cairo().cairo_set_line_width(c.cr, 3.4 * unit_);
      DrawLine(c, row, traces_.signals[s].measured, false);
      for (std::size_t m = 0; m < models_.size(); ++m) {
        c.Ink(OfModel(m), strength);
        Cairo().cairo_set_line_width(c.cr, 1.6 * unit_);
        DrawLine(c, row, traces_.signals[s].predicted[m], false);
      }
    }
    Cairo().cairo_restore(c.cr);
  }
  if (rolls_) DrawTimeAxis(c, margin_);
}

// `left`: where the page's time begins.
void Page::DrawTimeAxis(Canvas& c, double left) const {
  const double shown = plot_width_ / pixels_per_s_, step = NiceStep(shown, beside_ ? 5 : 10);
  c.Font(11.5 * unit_);
  for (double t = std::ceil(options_.from_s / step - 1e-9) * step; t <= options_.to_s + 1e-9 * step; t += step) {
    const double x = left + (t - options_.from_s) * pixels_per_s_;
    c.Ink(kGrid);
    Cairo().cairo_set_line_width(c.cr, unit_);
    Cairo().cairo_move_to(c.cr, x, axis_top_);
    Cairo().cairo_line_to(c.cr, x, axis_top_ + 4 * unit_);
    Cairo().cairo_stroke(c.cr);
    c.Ink(kFaint);
    c.Text(fmt::format("{:g}", std::round(t / step) * step + 0.0), x, axis_top_ + 17 * unit_, 0.5);
  }
}

int Page::StripBegin(double time_s) const {
  const double cursor = (time_s - options_.from_s) * pixels_per_s_;
  return static_cast<int>(
      std::clamp(cursor - plot_width_ / 2.0, 0.0, std::max(0.0, future_.width - 2.0 * margin_ - plot_width_)));
}

void Page::CopyStrip(double time_s, Picture& frame) const {
  const int begin = StripBegin(time_s), width = std::min(plot_width_ + 2 * margin_, future_.width - begin);
  const int cursor =
      std::clamp(margin_ + static_cast<int>((time_s - options_.from_s) * pixels_per_s_) - begin, 0, width);
  const auto copy = [&](double from_y, double to_y) {
    for (int y = static_cast<int>(from_y); y < std::min(static_cast<int>(std::ceil(to_y)), past_.height); ++y) {
      const std::ptrdiff_t from = static_cast<std::ptrdiff_t>(y) * past_.width + begin;
      std::uint32_t* to =
          frame.pixels.data() + static_cast<std::ptrdiff_t>(top_ + y) * frame.width + left_ + plot_left_ - margin_;
      std::copy_n(past_.pixels.data() + from, cursor, to);
      std::copy_n(future_.pixels.data() + from + cursor, width - cursor, to + cursor);
    }
  };
  for (const Row& row : rows_) copy(row.top, row.top + row.height);
  if (rolls_) copy(axis_top_ + 1, past_.height);
}

void Page::DrawCursor(Canvas& c, double time_s) const {
  const double shown_s = std::clamp(time_s, options_.from_s, options_.to_s);
  const double x = left_ + plot_left_ + (shown_s - options_.from_s) * pixels_per_s_ - StripBegin(time_s);
  c.Ink(kInk, 0.55);
  Cairo().cairo_set_line_width(c.cr, 1.2 * unit_);
  for (const Row& row : rows_) {
    if (!beside_ && &row != &rows_.front()) continue;
    Cairo().cairo_move_to(c.cr, x, top_ + row.top);
    Cairo().cairo_line_to(c.cr, x, top_ + (beside_ ? row.top + row.height : axis_top_));
  }
  Cairo().cairo_stroke(c.cr);
  const auto dot = [&](const Row& row, double value, const Colour& colour) {
    if (!std::isfinite(value)) return;
    const double y = row.top + row.height * (row.high - std::clamp(value, row.low, row.high)) / (row.high - row.low);
    Cairo().cairo_arc(c.cr, x, top_ + y, 4.2 * unit_, 0, 2 * M_PI);
    c.Ink(colour);
    Cairo().cairo_fill_preserve(c.cr);
    c.Ink(kPaper);
    Cairo().cairo_set_line_width(c.cr, 1.2 * unit_);
    Cairo().cairo_stroke(c.cr);
  };
  for (std::size_t s = 0; s < traces_.signals.size(); ++s) {
    for (std::size_t m = 0; m < models_.size(); ++m)
      dot(rows_[s], Interpolate(traces_.time_s, traces_.signals[s].predicted[m], time_s), OfModel(m));
    dot(rows_[s], Interpolate(traces_.time_s, traces_.signals[s].measured, time_s), kMeasured);
  }
  if (shows_command()) dot(rows_.back(), Held(traces_.time_s, traces_.commands.front().values, time_s), kFaint);
}

// Each model's error over its plot, where the traces stand beside the scenes.
void Page::DrawErrors(Canvas& c, double time_s) const {
  c.Font(12 * unit_, true);
  std::vector<double> right(traces_.signals.size(), left_ + plot_left_ + plot_width_);
  for (std::size_t m = models_.size(); m-- > 0;) {
    const auto errors = ErrorsNow(m, time_s);
    c.Ink(OfModel(m));
    for (std::size_t s = 0; s < errors.size(); ++s) {
      c.Text(errors[s][1], right[s], top_ + rows_[s].top - 4 * unit_, 1);
      right[s] -= c.Width(errors[s][1]) + 10 * unit_;
    }
  }
}

// Of each signal that is shown: name, error of the model, unit.
std::vector<std::array<std::string, 3>> Page::ErrorsNow(std::size_t model, double time_s) const {
  std::vector<std::array<std::string, 3>> lines;
  for (const auto& signal : traces_.signals) {
    const double error = Interpolate(traces_.time_s, signal.measured, time_s) -
                         Interpolate(traces_.time_s, signal.predicted[model], time_s);
    lines.push_back({signal.name, Signed(error), signal.unit});
  }
  return lines;
}

void Page::DrawPanel(Canvas& c, std::size_t panel, double time_s) const {
  const double left = static_cast<double>(panel) * scene_width_ + 14 * unit_, top = 14 * unit_;
  const bool measured_panel = options_.side_by_side && panel == 0;
  const std::size_t m = options_.side_by_side ? panel - 1 : panel;
  const Colour colour = measured_panel ? kMeasured : OfModel(m);
  const double name_room = std::min(240.0 * unit_, scene_width_ - 200 * unit_);
  c.Font(15 * unit_, true);
  const std::string label = c.Fit(measured_panel ? "measured" : models_[m].label, std::max(name_room, 90 * unit_));
  double width = c.Width(label) + 46 * unit_;
  const std::vector<std::array<std::string, 3>> lines =
      measured_panel || beside_ ? std::vector<std::array<std::string, 3>>() : ErrorsNow(m, time_s);
  const std::string whole =
      measured_panel ? "" : fmt::format("{}{:.3g}", beside_ ? "error " : "whole log ", models_[m].error);
  if (!measured_panel) {
    c.Font(12.5 * unit_);
    width = std::max(width, c.Width("error now" + whole) + 40 * unit_);
    for (const auto& [name, value, unit] : lines) width = std::max(width, c.Width(name) + c.Width(unit) + 118 * unit_);
  }
  const bool diverged = !measured_panel && models_[m].diverged_at_s >= 0 && time_s > models_[m].diverged_at_s;
  const bool ghost = !measured_panel && !options_.side_by_side;
  const double line_height = 18 * unit_;
  double height = 34 * unit_ + (ghost ? line_height : 0) +
                  (measured_panel ? 0 : line_height * (static_cast<double>(lines.size()) + 1) + 6 * unit_) +
                  (diverged ? line_height : 0);
  c.Card(left, top, width, height, 7 * unit_);
  c.Ink(colour);
  c.Box(left + 12 * unit_, top + 11 * unit_, 14 * unit_, 14 * unit_, 3 * unit_);
  Cairo().cairo_fill(c.cr);
  c.Ink(kInk);
  c.Font(15 * unit_, true);
  c.Text(label, left + 34 * unit_, top + 23 * unit_);
  double y = top + 23 * unit_;
  c.Font(12.5 * unit_);
  if (ghost) {
    y += line_height;
    c.Ink(kMeasured, 0.5);
    c.Box(left + 12 * unit_, y - 11 * unit_, 14 * unit_, 14 * unit_, 3 * unit_);
    Cairo().cairo_fill(c.cr);
    c.Ink(kInk);
    c.Text("measured", left + 34 * unit_, y);
  }
  if (!measured_panel) {
    y += line_height + 4 * unit_;
    c.Ink(kFaint);
    c.Text(beside_ ? "whole log" : "error now", left + 12 * unit_, y);
    c.Text(whole, left + width - 12 * unit_, y, 1);
    for (const auto& [name, value, unit] : lines) {
      y += line_height;
      c.Ink(kInk);
      c.Text(name, left + 12 * unit_, y);
      c.Text(unit, left + width - 12 * unit_ - c.Width(unit), y);
      c.Text(value, left + width - 18 * unit_ - c.Width(unit), y, 1);
    }
  }
  if (diverged) {
    c.Ink(kError);
    c.Text(fmt::format("diverged at {:.3g} s", models_[m].diverged_at_s), left + 12 * unit_, y + line_height);
  }
}

void Page::DrawClock(Canvas& c, double time_s) const {
  const double width = 168 * unit_, top = 14 * unit_,
               left = static_cast<double>(panels_) * scene_width_ - width - 14 * unit_;
  const bool command = shows_command();
  c.Card(left, top, width, (command ? 92 : 50) * unit_, 7 * unit_);
  c.Ink(kInk);
  c.Font(22 * unit_, true);
  c.Text(fmt::format("{:.2f} s", time_s), left + width - 12 * unit_, top + 27 * unit_, 1);
  c.Ink(kFaint);
  c.Font(12.5 * unit_);
  if (options_.speed != 1) c.Text(fmt::format("\u00d7 {:g}", options_.speed), left + 12 * unit_, top + 26 * unit_);
  c.Text(c.Fit(options_.title, width - 24 * unit_), left + width - 12 * unit_, top + 43 * unit_, 1);
  if (!command) return;
  const auto& shown = traces_.commands.front();
  const Row& row = rows_.back();
  const double value = Held(traces_.time_s, shown.values, time_s);
  c.Ink(kInk);
  c.Text(c.Fit(shown.name, 70 * unit_), left + 12 * unit_, top + 65 * unit_);
  c.Text(Signed(value) + " " + shown.unit, left + width - 12 * unit_, top + 65 * unit_, 1);
  const double bar_left = left + 12 * unit_, bar_width = width - 24 * unit_, bar_top = top + 74 * unit_,
               bar_height = 7 * unit_;
  const auto x_of = [&](double v) {
    return bar_left + bar_width * std::clamp((v - row.low) / (row.high - row.low), 0.0, 1.0);
  };
  c.Box(bar_left, bar_top, bar_width, bar_height, bar_height / 2);
  c.Ink(kGrid);
  Cairo().cairo_fill(c.cr);
  const double zero = x_of(std::clamp(0.0, row.low, row.high));
  c.Ink(kInk, 0.75);
  Cairo().cairo_rectangle(c.cr, std::min(zero, x_of(value)), bar_top,
                          std::max(1.5 * unit_, std::abs(x_of(value) - zero)), bar_height);
  Cairo().cairo_fill(c.cr);
}

void Page::Compose(std::span<const Picture> scenes, double time_s, Picture& frame) const {
  GS_CHECK(scenes.size() == panels_);
  const std::size_t width = static_cast<std::size_t>(options_.width);
  frame.width = options_.width;
  frame.height = options_.height;
  frame.pixels.resize(width * static_cast<std::size_t>(options_.height), 0xffffffffu);
  for (std::size_t p = 0; p < panels_; ++p) {
    GS_CHECK(scenes[p].width == scene_width_ && scenes[p].height == scene_height_);
    for (std::size_t y = 0; y < static_cast<std::size_t>(scene_height_); ++y) {
      std::copy_n(scenes[p].pixels.data() + y * static_cast<std::size_t>(scene_width_), scene_width_,
                  frame.pixels.data() + y * width + p * static_cast<std::size_t>(scene_width_));
    }
  }
  for (int y = 0; y < paper_.height; ++y) {
    std::copy_n(paper_.pixels.data() + static_cast<std::ptrdiff_t>(y) * paper_.width, paper_.width,
                frame.pixels.data() + static_cast<std::ptrdiff_t>(top_ + y) * frame.width + left_);
  }
  CopyStrip(time_s, frame);
  Canvas canvas(frame);
  canvas.Ink(kPaper);
  for (std::size_t p = 1; p < panels_; ++p) {
    Cairo().cairo_rectangle(canvas.cr, static_cast<double>(p) * scene_width_ - unit_, 0, 2 * unit_, scene_height_);
    Cairo().cairo_fill(canvas.cr);
  }
  for (std::size_t p = 0; p < panels_; ++p) DrawPanel(canvas, p, time_s);
  DrawClock(canvas, time_s);
  DrawCursor(canvas, time_s);
  if (beside_) DrawErrors(canvas, time_s);
}

}  // namespace gapscope

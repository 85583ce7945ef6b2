#include "src/fit/choose_windows.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "src/compare/spectrum.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr std::size_t kCells = 8;    // of a grid, along each side
constexpr double kSpacing_s = 0.01;  // of the rows that are looked at, over which rates are taken
constexpr double kSpikes = 1e-3;     // of the rows, at each end, outside of a grid's range
constexpr double kLittle = 0.05;     // of a window: a cell that is visited for less is as good as not visited

// Every few rows of a series, and its rate there.
struct Series {
  std::vector<double> values, rates;
};

Series Thin(const std::vector<double>& values, const std::vector<double>& time_s, std::size_t stride) {
  Series thin;
  for (std::size_t row = 0; row < values.size(); row += stride) {
    const std::size_t next = std::min(row + stride, values.size() - 1), from = next - std::min(next, stride);
    thin.values.push_back(values[row]);
    thin.rates.push_back((values[next] - values[from]) / (time_s[next] - time_s[from]));
  }
  return thin;
}

// Edges of equal cells over what all series have but for their spikes.
class Scale {
 public:
  template <typename Get>
  Scale(const std::vector<Series>& all, const Get& get) {
    std::vector<double> values;
    for (const Series& series : all) {
      for (const double value : get(series)) {
        if (std::isfinite(value)) values.push_back(value);
      }
    }
    if (values.empty()) return;
    low_ = Quantile(values, kSpikes);
    width_ = (Quantile(values, 1 - kSpikes) - low_) / static_cast<double>(kCells);
  }

  std::size_t Cell(double value) const {
    if (!(width_ > 0) || !std::isfinite(value)) return 0;
    return static_cast<std::size_t>(std::clamp((value - low_) / width_, 0.0, static_cast<double>(kCells) - 1));
  }

 private:
  double low_ = 0, width_ = 0;
};

struct Visit {
  std::size_t cell = 0;
  double share = 0;  // of the window's rows
};

// How long each window is in each cell of all grids.
class Cells {
 public:
  Cells(const std::vector<Recording>& recordings, const std::vector<LogWindow>& windows)
      : recordings_(recordings), windows_(windows), visits_(windows.size()) {
    for (const Recording& recording : recordings) {
      const double step_s =
          recording.duration_s() / static_cast<double>(std::max<std::size_t>(1, recording.rows() - 1));
      strides_.push_back(std::max<std::size_t>(1, static_cast<std::size_t>(kSpacing_s / step_s)));
    }
    std::vector<std::size_t> signals;
    std::size_t commands = 0;
    for (const Recording& recording : recordings) {
      for (const auto& measured : recording.measured) signals.push_back(measured.index);
      commands = std::max(commands, recording.commands.size());
    }
    std::sort(signals.begin(), signals.end());
    signals.erase(std::unique(signals.begin(), signals.end()), signals.end());
    for (const std::size_t index : signals) {
      AddGrid([&](const Recording& recording) -> const std::vector<double>* {
        for (const auto& measured : recording.measured) {
          if (measured.index == index) return &measured.values;
        }
        return nullptr;
      });
    }
    for (std::size_t c = 0; c < commands; ++c) {
      AddGrid([&](const Recording& recording) {
        return c < recording.commands.size() ? &recording.commands[c].values : nullptr;
      });
    }
    AddTime();
  }

  std::size_t count() const { return count_; }
  const std::vector<Visit>& visits(std::size_t window) const { return visits_[window]; }

 private:
  // `series_of`: a recording's values; null: it has none.
  template <typename SeriesOf>
  void AddGrid(const SeriesOf& series_of) {
    std::vector<Series> all;
    for (std::size_t l = 0; l < recordings_.size(); ++l) {
      const std::vector<double>* values = series_of(recordings_[l]);
      all.push_back(values ? Thin(FillGaps(*values), recordings_[l].time_s, strides_[l]) : Series());
    }
    const Scale of_value(all, [](const Series& s) -> const auto& { return s.values; }),
        of_rate(all, [](const Series& s) -> const auto& { return s.rates; });
    std::vector<double> rows(kCells * kCells);
    for (std::size_t w = 0; w < windows_.size(); ++w) {
      const auto& [log, window] = windows_[w];
      const Series& series = all[log];
      std::fill(rows.begin(), rows.end(), 0);
      double total = 0;
      const std::size_t stride = strides_[log];
      for (std::size_t i = (window.begin + stride - 1) / stride; i * stride < window.end && i < series.values.size();
           ++i) {
        rows[of_value.Cell(series.values[i]) * kCells + of_rate.Cell(series.rates[i])] += 1;
        total += 1;
      }
      for (std::size_t c = 0; c < rows.size(); ++c) {
        if (rows[c] > 0) visits_[w].push_back({count_ + c, rows[c] / total});
      }
    }
    count_ += rows.size();
  }

  void AddTime() {
    for (std::size_t w = 0; w < windows_.size(); ++w) {
      const Recording& recording = recordings_[windows_[w].log];
      const double at = recording.time_s[windows_[w].rows.begin] / std::max(recording.duration_s(), 1e-9);
      const auto cell = static_cast<std::size_t>(at * static_cast<double>(kCells));
      visits_[w].push_back({count_ + windows_[w].log * kCells + std::min(cell, kCells - 1), 1});
    }
    count_ += recordings_.size() * kCells;
  }

  const std::vector<Recording>& recordings_;
  const std::vector<LogWindow>& windows_;
  std::vector<std::size_t> strides_;  // by log
  std::vector<std::vector<Visit>> visits_;
  std::size_t count_ = 0;
};

}  // namespace

std::vector<LogWindow> ChooseWindows(const std::vector<Recording>& recordings, const std::vector<LogWindow>& windows,
                                     std::size_t most) {
  if (windows.size() <= most) return windows;
  const Cells cells(recordings, windows);
  std::vector<double> covered(cells.count(), kLittle);
  const auto gain = [&](std::size_t window) {
    double sum = 0;
    for (const Visit& visit : cells.visits(window)) sum += std::log1p(visit.share / covered[visit.cell]);
    return sum;
  };
  // What a window gains only falls as others are taken: the first one whose gain is today's is the best.
  struct Offer {
    double gain = 0;
    std::size_t window = 0, taken = 0;
    bool operator<(const Offer& other) const { return gain != other.gain ? gain < other.gain : window > other.window; }
  };
  std::priority_queue<Offer> offers;
  for (std::size_t w = 0; w < windows.size(); ++w) offers.push({gain(w), w, 0});
  std::vector<std::size_t> taken;
  while (taken.size() < most) {
    Offer best = offers.top();
    offers.pop();
    if (best.taken < taken.size()) {
      offers.push({gain(best.window), best.window, taken.size()});
      continue;
    }
    for (const Visit& visit : cells.visits(best.window)) covered[visit.cell] += visit.share;
    taken.push_back(best.window);
  }
  std::sort(taken.begin(), taken.end());
  std::vector<LogWindow> chosen;
  chosen.reserve(taken.size());
  for (const std::size_t w : taken) chosen.push_back(windows[w]);
  return chosen;
}

}  // namespace gapscope

#include "src/report/fleet_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/report/html_assets.h"
#include "src/report/json.h"
#include "src/report/version.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

std::string Quoted(const std::string& text) { return ScriptText(ordered_json(text)); }

std::string Number(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "null"; }

template <class Range, class Text>
std::string List(const Range& range, const Text& text) {
  std::string list = "[";
  for (const auto& one : range) {
    if (list.size() > 1) list += ',';
    list += text(one);
  }
  return list + "]";
}

std::string Texts(const std::vector<std::string>& texts) { return List(texts, Quoted); }

// Of the statements that any of the units says is there: the last probability, on how many units of how many.
std::string Statements(std::span<const UnitResult> units) {
  struct Count {
    double last = kNaN;
    int present = 0, of = 0;
  };
  std::map<std::string, Count> counts;
  for (const auto& unit : units) {
    for (const auto& said : unit.statements) {
      Count& count = counts[said.name];
      count.last = said.probability;
      count.present += said.answer == "present";
      ++count.of;
    }
  }
  std::erase_if(counts, [](const auto& named) { return named.second.present == 0; });
  return List(counts, [](const auto& named) {
    const auto& [name, count] = named;
    return fmt::format("[{},{},{},{}]", Quoted(name), Number(count.last), count.present, count.of);
  });
}

std::string Cell(const UnitResult& unit) {
  const std::string more = unit.state == "done" ? "" : "," + Quoted(unit.state + ": " + unit.error);
  return fmt::format("[{},{},{},{},{},{}{}]", Quoted(unit.time), Number(unit.gap), Number(unit.nominal),
                     Number(unit.left), Quoted(unit.id), Quoted(unit.report), more);
}

double MedianError(std::span<const UnitResult> units) {
  std::vector<double> errors;
  for (const auto& unit : units) {
    const double error = std::isfinite(unit.gap) ? unit.gap : unit.nominal;
    if (std::isfinite(error)) errors.push_back(error);
  }
  return errors.empty() ? 0 : Median(errors);
}

void Put(const std::string& mark, const std::string& text, std::string* page) {
  const std::size_t at = page->find(mark);
  page->replace(at, mark.size(), text);
}

}  // namespace

FleetPage::FleetPage(std::string what, std::string experiment, std::string time)
    : what_(std::move(what)), experiment_(std::move(experiment)), time_(std::move(time)) {}

std::size_t FleetPage::SeriesIndex(const std::string& name, const std::string& unit) {
  const auto [known, is_new] = series_.emplace(name, series_names_.size());
  if (is_new) {
    series_names_.push_back(name);
    series_units_.push_back(unit);
  }
  return known->second;
}

void FleetPage::AddRobot(const std::string& name, std::span<const UnitResult> units,
                         std::span<const RobotChange> changes) {
  std::map<std::size_t, std::string> sizes;  // by series: its points
  for (std::size_t i = 0; i < units.size(); ++i) {
    for (const auto& size : units[i].sizes) {
      if (!std::isfinite(size.value)) continue;
      std::string& points = sizes[SeriesIndex(size.name, size.unit)];
      points += points.empty() ? "" : ",";
      points += std::isfinite(size.low)
                    ? fmt::format("[{},{},{},{}]", i, Number(size.value), Number(size.low), Number(size.high))
                    : fmt::format("[{},{}]", i, Number(size.value));
    }
  }
  const std::string series =
      List(sizes, [](const auto& one) { return fmt::format("[{},[{}]]", one.first, one.second); });
  const std::string changed = List(changes, [](const RobotChange& change) {
    return fmt::format("[{},{},{},{},{:.2g}]", Quoted(change.series), change.first, Number(change.before),
                       Number(change.after), change.chance);
  });
  robots_.push_back({changes.empty() ? 1 : changes.front().chance, MedianError(units),
                     fmt::format("{{\"name\":{},\"units\":{},\"sizes\":{},\"said\":{},\"changes\":{}}}", Quoted(name),
                                 List(units, Cell), series, Statements(units), changed)});
}

std::string FleetPage::Html(const std::vector<std::string>& times) const {
  std::vector<const Robot*> order = Collect(robots_, [](const Robot& robot) { return &robot; });
  std::stable_sort(order.begin(), order.end(), [](const Robot* a, const Robot* b) {
    return a->chance != b->chance ? a->chance < b->chance : a->error > b->error;
  });
  std::string data = fmt::format(
      "{{\"what\":{},\"experiment\":{},\"time\":{},\"version\":{},\"times\":{},\"series\":{},\"unitOf\":{},"
      "\"robots\":[\n",
      Quoted(what_), Quoted(experiment_), Quoted(time_), Quoted(VersionText()), Texts(times), Texts(series_names_),
      Texts(series_units_));
  for (const Robot* robot : order) data += robot->json + (robot == order.back() ? "\n" : ",\n");
  data += "]}";
  // In a script element nothing of a name may look like its end.
  std::string page = assets::kFleetPage;
  Put("/*style*/", std::string(assets::kStyle) + assets::kFleetStyle, &page);
  Put("/*script*/", assets::kFleetScript, &page);
  Put("/*data*/", data, &page);
  return page;
}

}  // namespace gapscope

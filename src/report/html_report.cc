#include "src/report/html_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/compare/comparison.h"
#include "src/compare/decimate.h"
#include "src/compare/frequency_response.h"
#include "src/compare/residual_torque.h"
#include "src/core/digest.h"
#include "src/core/file.h"
#include "src/report/glossary.h"
#include "src/report/html_assets.h"
#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostLogs = 12, kMapAngles = 22, kMapSpeeds = 14, kMostMaps = 6, kMostResponses = 4;
constexpr std::size_t kLeastBuckets = 60;
constexpr const char* kVideoSlot = "data-video=\"\"";

// Six digits are more than a screen shows; what is not a number is null.
ordered_json Rounded(double value, int digits = 6) {
  if (!std::isfinite(value)) return nullptr;
  if (value == 0) return 0;
  const double scale = std::pow(10, digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(value)))));
  return std::round(value * scale) / scale;
}
ordered_json Numbers(const std::vector<double>& values) {
  ordered_json list = ordered_json::array();
  for (const double v : values) list.push_back(Rounded(v, 5));
  return list;
}
ordered_json Column(std::span<const double> values, const std::vector<std::size_t>& rows, int digits = 6) {
  ordered_json list = ordered_json::array();
  for (const std::size_t r : rows) list.push_back(Rounded(values[r], digits));
  return list;
}

// All rows where they are at most `most`; else about so many, all extremes among them.
std::vector<std::size_t> RowsToDraw(std::span<const std::span<const double>> columns, std::size_t most) {
  const std::size_t rows = columns.front().size(), per_bucket = 2 * columns.size();
  return ExtremeRows(columns, rows <= most ? rows : std::max(kLeastBuckets, most / per_bucket));
}

ordered_json FileStamp(const std::string& path) {
  const auto digest = Sha256OfFile(path);
  return {{"path", path}, {"sha256", digest.ok() ? digest.value() : ""}};
}

ordered_json Quality(const Recording& recording) {
  const Timeline& t = recording.timeline;
  ordered_json findings = ordered_json::array();
  for (const auto& finding : recording.findings) findings.push_back(finding.text);
  return {{"rows", recording.rows()},
          {"rows_in_log", recording.rows_in_log},
          {"duration_s", Rounded(recording.duration_s())},
          {"step_s", Rounded(t.median_step_s)},
          {"longest_step_s", Rounded(t.longest_step_s)},
          {"jitter_s", Rounded(t.jitter_s)},
          {"findings", std::move(findings)}};
}

// A signal of a page, and what was predicted of it.
struct Shown {
  std::size_t number;   // in the recording
  int command = -1;     // that drives it; -1: not known
  double error = kNaN;  // of the last prediction, normalised
  std::vector<std::span<const double>> predicted;
};

// What a page shows of a log: its signals, of many the worst first.
struct ShownLog {
  const Recording& recording;
  std::vector<std::string> labels;  // of the predictions
  std::vector<Shown> signals;
};

ShownLog ShowLog(const ReportSource& source, std::size_t index) {
  ShownLog log{.recording = *source.recordings[index], .labels = {}, .signals = {}};
  std::vector<const LogReplay*> replays;
  for (const auto& prediction : source.predictions) {
    if (index >= prediction.logs.size() || prediction.logs[index].signals.empty()) continue;
    replays.push_back(&prediction.logs[index]);
    log.labels.push_back(prediction.label);
  }
  std::vector<SignalScore> scores;
  for (std::size_t s = 0; s < log.recording.measured.size(); ++s) {
    const auto& measured = log.recording.measured[s];
    Shown shown{.number = s, .predicted = {}};
    shown.command = source.model                         ? source.model->rig()->CommandOfSignal(measured.spec.signal)
                    : log.recording.commands.size() == 1 ? 0
                                                         : -1;
    for (const LogReplay* replay : replays) shown.predicted.emplace_back(replay->signals[s].predicted);
    if (!replays.empty())
      shown.error = ScoreSignal(measured.spec.signal, log.recording.time_s, measured.values, shown.predicted.back(),
                                replays.back()->signals[s].resolution)
                        .nrmse;
    scores.push_back({.signal = measured.spec.signal, .nrmse = shown.error});
    log.signals.push_back(std::move(shown));
  }
  if (log.signals.size() <= kFewSignals || replays.empty()) return log;
  std::vector<Shown> ordered;
  for (const std::size_t s : WorstFirst(scores)) ordered.push_back(std::move(log.signals[s]));
  std::ranges::stable_partition(ordered, [&](const Shown& s) { return log.recording.measured[s.number].spec.scored; });
  log.signals = std::move(ordered);
  return log;
}

// Of the joints of the signals that are shown first.
ordered_json Maps(const ReportSource& source, const ShownLog& log) {
  ordered_json maps = ordered_json::array();
  if (!source.model) return maps;
  const auto residuals = EstimateResidualTorque(*source.model, source.values, log.recording);
  std::vector<std::string> joints;
  for (const Shown& signal : log.signals) {
    const std::string joint = source.model->rig()->JointOfSignal(log.recording.measured[signal.number].spec.signal);
    if (std::ranges::find(joints, joint) == joints.end()) joints.push_back(joint);
  }
  for (const std::string& joint : joints) {
    const auto residual = std::ranges::find(residuals, joint, &ResidualTorque::joint);
    if (residual == residuals.end() || maps.size() >= kMostMaps) continue;
    const TorqueMap map = MapTorque(*residual, kMapAngles, kMapSpeeds);
    if (map.mean_n_m.empty()) continue;
    maps.push_back({{"joint", map.joint},
                    {"angle", Numbers(map.angle_edges_rad)},
                    {"speed", Numbers(map.speed_edges_rad_per_s)},
                    {"torque", Numbers(map.mean_n_m)},
                    {"rows", map.rows}});
  }
  return maps;
}

ordered_json Curves(const std::vector<EffectCurve>& curves) {
  ordered_json json = ordered_json::array();
  for (const auto& [title, curve] : curves) {
    const bool is_angle = curve.over == TorqueCurve::Over::kAngle;
    json.push_back({{"title", title},
                    {"over", curve.joint + (is_angle ? " angle" : " speed")},
                    {"unit", is_angle ? "rad" : "rad/s"},
                    {"at", Numbers(curve.at)},
                    {"missing", Numbers(curve.missing_n_m)},
                    {"low", Numbers(curve.low_n_m)},
                    {"high", Numbers(curve.high_n_m)},
                    {"effect", Numbers(curve.effect_n_m)}});
  }
  return json;
}

// Of the signals that are shown first, each over the command that drives it.
ordered_json Responses(const ShownLog& log) {
  ordered_json responses = ordered_json::array();
  if (log.labels.empty()) return responses;
  for (const Shown& signal : log.signals) {
    const auto& measured = log.recording.measured[signal.number];
    if (!measured.spec.scored || signal.command < 0 || responses.size() >= kMostResponses) continue;
    const auto& command = log.recording.commands[static_cast<std::size_t>(signal.command)];
    if (!command.column) continue;
    const auto points =
        EstimateResponse(log.recording.time_s, command.values, measured.values, signal.predicted.back());
    if (points.size() < 4) continue;
    ordered_json entry = {
        {"command", command.actuator}, {"signal", measured.spec.signal}, {"points", ordered_json::array()}};
    for (const auto& p : points) {
      entry["points"].push_back({Rounded(p.hz), Rounded(p.measured_gain), Rounded(p.predicted_gain),
                                 Rounded(p.measured_phase_deg), Rounded(p.predicted_phase_deg),
                                 Rounded(p.coherence, 3)});
    }
    responses.push_back(std::move(entry));
  }
  return responses;
}

// A signal's rows, thinned so that each series and each residual keeps its extremes.
ordered_json Trace(const ShownLog& log, const Shown& shown, std::size_t most_rows) {
  const auto& measured = log.recording.measured[shown.number];
  std::vector<std::vector<double>> residuals;
  for (const auto& predicted : shown.predicted) {
    residuals.emplace_back(predicted.size());
    for (std::size_t r = 0; r < predicted.size(); ++r) residuals.back()[r] = measured.values[r] - predicted[r];
  }
  std::vector<std::span<const double>> columns = {measured.values};
  columns.insert(columns.end(), shown.predicted.begin(), shown.predicted.end());
  columns.insert(columns.end(), residuals.begin(), residuals.end());
  const std::vector<std::size_t> rows = RowsToDraw(columns, most_rows);
  ordered_json signal = {{"name", measured.spec.signal},
                         {"unit", measured.spec.unit},
                         {"scored", measured.spec.scored},
                         {"error", Rounded(shown.error, 3)},
                         {"command", shown.command < 0 ? ordered_json() : ordered_json(shown.command)},
                         {"time", Column(log.recording.time_s, rows, 8)},
                         {"measured", Column(measured.values, rows)},
                         {"predicted", ordered_json::array()}};
  for (std::size_t p = 0; p < shown.predicted.size(); ++p)
    signal["predicted"].push_back({{"label", log.labels[p]}, {"values", Column(shown.predicted[p], rows)}});
  return signal;
}

// Traces of one log, of about `most_numbers` numbers.
ordered_json Traces(const ReportSource& source, const ShownLog& log, std::size_t most_numbers) {
  const std::size_t columns = log.signals.size() * (2 + log.labels.size()) + 2 * log.recording.commands.size();
  const std::size_t most_rows = most_numbers / columns;
  ordered_json json = {{"signals", ordered_json::array()}, {"commands", ordered_json::array()}};
  for (const Shown& shown : log.signals) json["signals"].push_back(Trace(log, shown, most_rows));
  for (std::size_t c = 0; c < log.recording.commands.size(); ++c) {
    const auto& command = log.recording.commands[c];
    if (!command.column) continue;
    const std::span<const double> values[] = {command.values};
    const std::vector<std::size_t> rows = RowsToDraw(values, most_rows);
    json["commands"].push_back({{"name", command.actuator},
                                {"number", c},
                                {"unit", source.experiment->commands[c].unit},
                                {"time", Column(log.recording.time_s, rows, 8)},
                                {"values", Column(command.values, rows)}});
  }
  return json;
}

// "Replay of a.csv and b.csv with qube.xml". `logs`: their short paths, in the order of the page; one may have parts.
std::string Subject(const ReportSource& source, const std::vector<std::string>& logs) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::string> names;
  for (const std::string& log : logs) {
    if (std::ranges::find(names, log) == names.end()) names.push_back(log);
  }
  const bool more = names.size() > kNamed;
  names.resize(std::min(names.size(), kNamed));
  return fmt::format("{} of {}{} with {}", source.content.headline.kind, Listed(names), more ? " ..." : "",
                     std::filesystem::path(source.experiment->model_path).filename().string());
}

ordered_json HeadlineJson(const Headline& headline) {
  ordered_json json = {{"kind", headline.kind},
                       {"title", headline.title},
                       {"sentences", headline.sentences},
                       {"stages", ordered_json::array()},
                       {"confidence", JsonNumber(headline.confidence)},
                       {"confidence_in", headline.confidence_in},
                       {"explanation", headline.explanation},
                       {"notes", headline.notes}};
  for (const Stage& stage : headline.stages) {
    const char* mark = stage.mark == Stage::Mark::kBest ? "best" : stage.mark == Stage::Mark::kFloor ? "floor" : "";
    json["stages"].push_back({{"name", stage.name}, {"error", stage.error}, {"mark", mark}, {"change", stage.change}});
  }
  return json;
}

// What was fitted first, then the other parameters that are not frozen, at the result's values.
ordered_json Parameters(const ReportSource& source) {
  const PageContent& content = source.content;
  const auto named = [](const auto& list, const std::string& name, auto member) {
    return std::ranges::find(list, name, member);
  };
  ordered_json rows = ordered_json::array();
  const auto add = [&](const std::string& name, double value, const PageContent::Fitted* fitted) {
    if (!std::isfinite(value)) return;
    ordered_json row = {{"name", name}, {"value", value}};
    const auto p = named(source.parameters, name, &Parameter::name);
    if (p != source.parameters.end()) {
      row.update({{"unit", p->unit},
                  {"doc", p->doc},
                  {"nominal", JsonNumber(p->nominal)},
                  {"low", JsonNumber(p->low)},
                  {"high", JsonNumber(p->high)}});
    }
    if (fitted) {
      if (fitted->identifiable) row.update({{"from", JsonNumber(fitted->low)}, {"to", JsonNumber(fitted->high)}});
      row.update({{"at_bound", fitted->at_bound}, {"identifiable", fitted->identifiable}});
    }
    rows.push_back(std::move(row));
  };
  for (const auto& fitted : content.fitted) add(fitted.name, fitted.value, &fitted);
  for (const Parameter& p : source.parameters) {
    if (p.frozen || named(content.fitted, p.name, &PageContent::Fitted::name) != content.fitted.end()) continue;
    const auto value = std::ranges::find(content.values, p.name, [](const auto& pair) { return pair.first; });
    if (value != content.values.end()) add(p.name, value->second, nullptr);
  }
  return rows;
}

// What a diagnosis states.
void AddFindings(const PageContent& content, ordered_json* data) {
  ordered_json& json = *data;
  json["findings"] = ordered_json::array();
  for (const Sentence& s : content.findings) {
    json["findings"].push_back({{"what", s.what},
                                {"size", s.size},
                                {"caveat", s.caveat},
                                {"told_apart", s.told_apart},
                                {"share", JsonNumber(s.share_of_gap)},
                                {"probability", s.probability}});
  }
  json["gap"] = content.gap;
  json["remainder"] = ordered_json::array();
  for (const Part& part : content.remainder)
    json["remainder"].push_back({{"name", part.name}, {"share", JsonNumber(part.share)}});
  json["reachable"] = JsonNumber(content.reachable);
  json["statements"] = ordered_json::array();
  for (const PageContent::Looked& s : content.statements) {
    ordered_json entry = {{"title", s.title},       {"answer", s.answer}, {"why", s.why},
                          {"bound", s.bound},       {"prior", s.prior},   {"probability", JsonNumber(s.probability)},
                          {"gains", ordered_json()}};
    if (s.numbers) {
      entry["gains"] = {JsonNumber(s.numbers->gain), JsonNumber(s.numbers->gain_held_out),
                        JsonNumber(s.numbers->gain_free)};
    }
    json["statements"].push_back(std::move(entry));
  }
}

// Words and tables, as they are shown.
void AddContent(const ReportSource& source, ordered_json* data) {
  const PageContent& content = source.content;
  ordered_json& json = *data;
  json["headline"] = HeadlineJson(content.headline);
  json["where"] = ordered_json::array();
  for (const auto& [title, shares] : content.where) {
    if (!shares.empty()) json["where"].push_back({{"title", title}, {"shares", JsonConditions(shares)}});
  }
  AddFindings(content, data);
  json["tables"] = ordered_json::array();
  for (const PageContent::Table& t : content.tables)
    json["tables"].push_back({{"title", t.title}, {"heads", t.heads}, {"rows", t.rows}, {"note", t.note}});
  json["parameters"] = Parameters(source);
  json["next"] = {{"text", content.next_text}, {"command", content.next_command}};
  json["map_of"] = content.mapped;
}

ordered_json Data(const ordered_json& result, const ReportSource& source, std::size_t most_numbers) {
  ordered_json data = {{"result", result}, {"command", source.command_line}};
  data["experiment"] = FileStamp(source.experiment->path);
  data["model"] = FileStamp(source.experiment->model_path);
  AddContent(source, &data);
  data["curves"] = Curves(source.curves);
  data["glossary"] = ordered_json::array();
  for (const Term& term : Glossary()) data["glossary"].push_back({{"word", term.word}, {"means", term.means}});
  data["few_signals"] = kFewSignals;
  data["logs"] = ordered_json::array();
  const std::size_t shown = std::min(kMostLogs, source.recordings.size());
  // Held-out logs first: they are what counts.
  std::vector<std::size_t> order(source.recordings.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto held_out = [&](std::size_t i) {
    return !source.by_windows && i < source.held_out.size() && source.held_out[i];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return held_out(a) && !held_out(b); });
  std::vector<std::string> paths;
  for (std::size_t k = 0; k < order.size(); ++k) {
    const std::size_t i = order[k];
    const Recording& recording = *source.recordings[i];
    ordered_json log = FileStamp(recording.log_path);
    log["held_out"] = held_out(i) ? "held out" : source.by_windows ? "every third window held out" : "";
    log["from_s"] = recording.start_s;
    log["quality"] = Quality(recording);
    if (k < shown) {
      const ShownLog shown_log = ShowLog(source, i);
      log["traces"] = Traces(source, shown_log, most_numbers / shown);
      log["maps"] = Maps(source, shown_log);
      log["responses"] = Responses(shown_log);
      log["response_of"] = shown_log.labels.empty() ? "" : shown_log.labels.back();
    }
    data["logs"].push_back(std::move(log));
    paths.push_back(recording.log_path);
  }
  const std::vector<std::string> names = ShortPaths(paths);
  for (std::size_t k = 0; k < names.size(); ++k) data["logs"][k]["name"] = names[k];
  data["subject"] = Subject(source, names);
  return data;
}

std::string Filled(std::string page, const std::string& slot, const std::string& content) {
  const std::size_t at = page.find(slot);
  GS_CHECK(at != std::string::npos);
  return page.replace(at, slot.size(), content);
}

bool IsPlainName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '.' || c == '_' || c == '-';
  });
}

}  // namespace

std::string ReportHtml(const ordered_json& result, const ReportSource& source, std::size_t most_numbers) {
  GS_CHECK(source.experiment != nullptr);
  std::string page = assets::kPage;
  page = Filled(page, "/*style*/", std::string(assets::kDygraphsStyle) + assets::kStyle);
  page = Filled(page, "/*dygraphs*/", assets::kDygraphs);
  page = Filled(page, "/*script*/", assets::kScript);
  return Filled(page, "/*data*/", ScriptText(Data(result, source, most_numbers)));
}

Status WriteReportHtml(const std::string& folder, const ordered_json& result, const ReportSource& source) {
  const std::filesystem::path path = std::filesystem::path(folder) / "report.html";
  std::string page = ReportHtml(result, source);
  std::error_code failure;
  if (std::filesystem::exists(path.parent_path() / "video.mp4", failure))
    page = Filled(page, kVideoSlot, "data-video=\"video.mp4\"");
  return WriteFile(path.string(), page);
}

Result<bool> AttachVideo(const std::string& report_path, const std::string& video) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(report_path, failure) || !IsPlainName(video)) return false;
  GS_ASSIGN(std::string page, ReadFile(report_path));
  const std::size_t at = page.find(kVideoSlot);
  if (at == std::string::npos) return page.find("data-video=\"" + video + "\"") != std::string::npos;
  page.replace(at, std::char_traits<char>::length(kVideoSlot), "data-video=\"" + video + "\"");
  GS_RETURN_IF_ERROR(WriteFile(report_path, page));
  return true;
}

}  // namespace gapscope

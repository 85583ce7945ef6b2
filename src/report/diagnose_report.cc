#include "src/report/diagnose_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "src/diagnose/policy.h"
#include "src/fit/policy.h"
#include "src/report/console.h"
#include "src/report/sentences.h"
#include "src/report/words.h"
#include "src/report/write_run.h"

namespace gapscope {

using nlohmann::ordered_json;

namespace {

std::string ConditionTable(const char* title, const std::vector<ConditionShare>& shares) {
  if (shares.empty()) return "";
  std::string text = fmt::format("\n{:<18} {:<44} {:>9} {:>9}\n", title, "", "of error", "of time");
  for (const auto& w : shares)
    text += fmt::format("{:<18} {:<44} {:>8.0f}% {:>8.0f}%\n", w.signal, w.condition, 100 * w.share_of_error,
                        100 * w.share_of_time);
  return text;
}

ordered_json JsonSizes(const std::vector<EffectEstimate>& sizes) {
  ordered_json parameters = ordered_json::object();
  for (const auto& p : sizes) {
    parameters[p.key] = {{"value", JsonNumber(p.value)}, {"low", JsonNumber(p.low)}, {"high", JsonNumber(p.high)}};
    if (p.ratio.to.empty()) continue;
    parameters[p.key]["ratio"] = {{"to", p.ratio.to},
                                  {"value", JsonNumber(p.ratio.value)},
                                  {"low", JsonNumber(p.ratio.low)},
                                  {"high", JsonNumber(p.ratio.high)}};
  }
  return parameters;
}

ordered_json Json(const FoundEffect& found) {
  const ordered_json parameters = JsonSizes(found.parameters);
  return {{"name", found.use.effect},
          {"on", found.use.on},
          {"probability", found.probability},
          {"parameters", parameters},
          {"error_before", JsonNumber(found.error_before)},
          {"error_after", JsonNumber(found.error_after)},
          {"share_of_gap", JsonNumber(found.share_of_gap)}};
}

ordered_json Json(const FreeRun& run) {
  ordered_json offsets = ordered_json::object();
  for (const auto& [signal, offset] : run.offsets) offsets[signal] = offset;
  return {{"log", run.log},
          {"from_s", run.from_s},
          {"until_s", run.until_s},
          {"error", JsonNumber(run.error)},
          {"qpos", run.start.qpos},
          {"qvel", run.start.qvel},
          {"commands_late_s", run.commands_late_s},
          {"offsets", std::move(offsets)}};
}

ordered_json Json(const VerdictEvidence& e) {
  ordered_json signals = ordered_json::object();
  for (const SignalFloors& signal : e.signals) signals[signal.signal] = JsonNumber(signal.floors);
  ordered_json runs = ordered_json::array();
  for (const FreeRun& run : e.free_runs) runs.push_back(Json(run));
  return {{"floors_before", JsonNumber(e.floors_before)},       {"floors_left", JsonNumber(e.floors_left)},
          {"floors_left_by_signal", std::move(signals)},        {"removed", JsonNumber(e.removed)},
          {"free_run_before", JsonNumber(e.free_run_before)},   {"free_run_left", JsonNumber(e.free_run_left)},
          {"free_run_removed", JsonNumber(e.free_run_removed)}, {"free_runs", std::move(runs)}};
}

ordered_json Json(const CandidateReport& c) {
  ordered_json entry = {{"name", c.effect ? c.effect->effect : "none"}};
  if (c.effect) entry["on"] = c.effect->on;
  entry["probability"] = c.probability;
  entry["held_out_error"] = JsonNumber(c.held_out_error);
  entry["promise"] = c.promise;
  entry["refitted"] = c.refitted;
  entry["converged"] = c.converged;
  entry["bic"] = JsonNumber(c.bic);
  entry["reason"] = c.reason;
  return entry;
}

// What the statement rests on: the numbers, and what they were taken from.
void AddComparison(const Statement& s, ordered_json* entry) {
  const StatementNumbers& n = s.numbers;
  if (!s.sets) return;
  (*entry)["numbers"] = {{"gain", JsonNumber(n.gain)},
                         {"gain_held_out", JsonNumber(n.gain_held_out)},
                         {"gain_free", JsonNumber(n.gain_free)},
                         {"discrepancy", JsonNumber(n.discrepancy)},
                         {"clear", JsonNumber(n.clear)},
                         {"smooth", n.smooth ? 1 : 0},
                         {"dry", n.dry ? 1 : 0}};
  (*entry)["with"] = JsonModel(s.sets->with);
  (*entry)["without"] = JsonModel(s.sets->without);
  (*entry)["blocks"] = JsonBlocks(s.sets->blocks);
  (*entry)["rivals"] = JsonRivals(s.rivals);
}

ordered_json Json(const Statement& s) {
  const ordered_json parameters = JsonSizes(s.parameters);
  ordered_json entry = {{"name", s.use.effect},
                        {"on", s.use.on},
                        {"answer", AnswerName(s.answer)},
                        {"probability", s.probability},
                        {"prior", s.prior},
                        {"evidence", s.evidence},
                        {"parameters", parameters},
                        {"share_of_gap",
                         {{"value", JsonNumber(s.share_of_gap.value)},
                          {"low", JsonNumber(s.share_of_gap.low)},
                          {"high", JsonNumber(s.share_of_gap.high)}}},
                        {"group", s.group < 0 ? ordered_json() : ordered_json(s.group)},
                        {"rule", s.rule}};
  if (s.beside) entry["seen_beside"] = s.beside->Text();
  if (!s.caveat.empty()) entry["caveat"] = s.caveat;
  for (const auto& bound : s.bounds) entry["bound"][bound.key] = JsonNumber(bound.value);
  AddComparison(s, &entry);
  return entry;
}

// All parameters of what was found: a sentence has the first of each.
std::string SizeTable(const Diagnosis& d) {
  std::size_t width = 0;
  for (const auto& found : d.effects) width = std::max(width, found.use.Text().size());
  std::string text = fmt::format("\n{:<{}} {:<28} {:>11}   {}\n", "size of", width, "", "value", "95 % interval");
  for (const auto& found : d.effects) {
    std::string name = found.use.Text();
    for (const auto& p : found.parameters) {
      text += fmt::format("{:<{}} {:<28} {:>11.4g}   {:.4g} .. {:.4g}{}\n", name, width, p.key, p.value, p.low, p.high,
                          UnitAfter(p.unit));
      if (!p.ratio.to.empty())
        text += fmt::format("{:<{}} {:<28} {:>11.4g}   {:.4g} .. {:.4g}\n", "", width, "  over " + p.ratio.to,
                            p.ratio.value, p.ratio.low, p.ratio.high);
      name.clear();
    }
  }
  return text;
}

std::string RemainderText(const Remainder& remainder) {
  std::string text;
  for (const Part& part : PartsOf(remainder))
    text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", part.name, 100 * part.share);
  if (text.empty()) return "";
  text = "- of the retuned model's squared misfit: " + text;
  if (std::isfinite(remainder.reachable))
    text += fmt::format("; a free-form torque would explain {:.0f} %", 100 * remainder.reachable);
  return Wrapped(text, 120, "  ") + "\n";
}

// What is there, what was considered and is not, and how large the others may be.
std::string StatementTable(const Diagnosis& d) {
  constexpr std::size_t kMostBounds = 30;
  std::string text =
      fmt::format("\n{:>2} {:<34} {:<8} {:>11}  {}\n", "", "effect", "answer", "probability", "rests on");
  std::string bounds;
  std::map<std::string, std::vector<std::string>> unseen;  // by why
  std::size_t absent = 0, unseen_count = 0;
  for (std::size_t i = 0; i < d.statements.size(); ++i) {
    const Statement& s = d.statements[i];
    const StatementNumbers& n = s.numbers;
    if (!s.sets) {
      ++(s.answer == Answer::kUnseen ? unseen_count : absent);
      if (s.answer == Answer::kUnseen) unseen[WhyOf(s)].push_back(s.use.Text());
      if (!s.bounds.empty() && absent <= kMostBounds)
        bounds +=
            fmt::format("{}{} {} {}", bounds.empty() ? "" : ", ", s.use.Text(), s.bounds.front().key, BoundText(s));
      continue;
    }
    text += fmt::format("{:>2} {:<34} {:<8} {:>11.2f}  {}: gains {:.2f}, held out {:.2f}\n", i + 1, s.use.Text(),
                        AnswerName(s.answer), s.probability, s.rule, n.gain, n.gain_held_out);
  }
  text += fmt::format("{} more gain too little, {} cannot be told\n", absent, unseen_count);
  for (const auto& [why, uses] : unseen)
    text += Wrapped(fmt::format("cannot be told: {}; {}", fmt::join(uses, ", "), why), 120, "  ") + "\n";
  if (!bounds.empty()) {
    const char* more = absent > kMostBounds ? ", ... (--json: all)" : "";
    text += Wrapped("at most (of a limit or a compliance: at least; 95 %): " + bounds + more, 120, "  ") + "\n";
  }
  return text;
}

}  // namespace

ordered_json JsonBlocks(const std::vector<BlockGain>& blocks) {
  ordered_json json = ordered_json::array();
  for (const BlockGain& block : blocks)
    json.push_back({{"log", block.log}, {"from_s", block.from_s}, {"to_s", block.to_s}, {"share", block.share}});
  return json;
}

ordered_json JsonRivals(const std::vector<Rival>& rivals) {
  ordered_json json = ordered_json::array();
  for (const Rival& rival : rivals)
    json.push_back({{"name", rival.use.effect}, {"on", rival.use.on}, {"behind", rival.behind}});
  return json;
}

ordered_json Json(const NextExperiment& next) {
  ordered_json separates = ordered_json::array();
  for (const auto& explanation : next.separates) separates.push_back(NameOf(explanation));
  ordered_json json = {{"command", next.command}, {"separates", separates}, {"why", WhyName(next.why)}};
  if (!next.problem.empty()) json["problem"] = next.problem;
  if (next.input_csv.empty()) return json;
  json["file"] = kNextExperimentFile;
  json["probability"] = JsonNumber(next.probability);
  json["if_present"] = JsonNumber(next.if_present);
  json["if_absent"] = JsonNumber(next.if_absent);
  return json;
}

ordered_json JsonSearchPolicy() {
  constexpr const DiagnosePolicy& policy = kDiagnosePolicy;
  return {{"search.widenings", policy.search.widenings},
          {"search.lost", policy.search.lost},
          {"search.least_window_s", policy.search.least_window_s},
          {"search.short_share", policy.search.short_share},
          {"search.least_samples", policy.search.least_samples},
          {"search.beam", policy.search.beam},
          {"search.singles", policy.search.singles},
          {"search.pairs", policy.search.pairs},
          {"search.triples", policy.search.triples},
          {"search.go_on", policy.search.go_on},
          {"search.hopeless", policy.search.hopeless},
          {"search.far_behind", policy.search.far_behind},
          {"search.scan", policy.search.scan},
          {"search.scanned", policy.search.scanned},
          {"search.leaders", policy.search.leaders},
          {"search.additions", policy.search.additions},
          {"search.alone", policy.search.alone},
          {"search.most_effects", policy.search.most_effects},
          {"search.promise", policy.search.promise},
          {"search.member", policy.search.member},
          {"search.rivals", policy.search.rivals},
          {"search.imitates", policy.search.imitates},
          {"search.exchange", policy.search.exchange},
          {"search.tie", policy.search.tie},
          {"search.tie_share", policy.search.tie_share},
          {"search.simpler", policy.search.simpler},
          {"search.jacobians", policy.search.jacobians},
          {"search.least_windows", policy.search.least_windows},
          {"search.coarse_step", policy.search.coarse_step},
          {"search.jacobian_numbers", policy.search.jacobian_numbers},
          {"search.least_replays", policy.search.least_replays},
          {"search.replays", policy.search.replays},
          {"search.until_grown", policy.search.until_grown},
          {"search.until_exchanged", policy.search.until_exchanged}};
}

ordered_json JsonFitPolicy() {
  constexpr const FitPolicy& policy = kFitPolicy;
  return {{"fit.state_prior_samples", policy.state_prior_samples},
          {"fit.unknown_past_s", policy.unknown_past_s},
          {"fit.start_s", policy.start_s},
          {"fit.rest_share", policy.rest_share},
          {"fit.speed_prior_s", policy.speed_prior_s},
          {"fit.motor_side_prior_rad", policy.motor_side_prior_rad},
          {"fit.unseen_prior_rad", policy.unseen_prior_rad},
          {"fit.unseen_prior_m", policy.unseen_prior_m},
          {"fit.unseen_rad_per_s", policy.unseen_rad_per_s},
          {"fit.offset_bound_rad", policy.offset_bound_rad},
          {"fit.anchor", policy.anchor},
          {"fit.least_size_share", policy.least_size_share},
          {"fit.shift_step", policy.shift_step},
          {"fit.offset_step", policy.offset_step},
          {"fit.state_step", policy.state_step},
          {"fit.known_share", policy.known_share},
          {"fit.known_offset_rad", policy.known_offset_rad},
          {"fit.touches", policy.touches},
          {"fit.block_s", policy.block_s},
          {"fit.flat_share", kCovariancePolicy.flat_share},
          {"fit.least_misfit", kCovariancePolicy.least_misfit},
          {"fit.correlated", kCovariancePolicy.correlated},
          {"fit.bound_share", kCovariancePolicy.bound_share}};
}

ordered_json JsonGap(const Diagnosis& d) {
  ordered_json gap = {{"nominal", JsonNumber(d.nominal)}, {"refit", JsonNumber(d.refit)},
                      {"final", JsonNumber(d.final)},     {"floor", JsonNumber(d.floor)},
                      {"closed", JsonNumber(d.closed)},   {"held_out", true}};
  gap["by_log"] = ordered_json::array();
  for (const LogGap& of_log : d.by_log) {
    gap["by_log"].push_back({{"log", of_log.log},
                             {"from_s", of_log.from_s},
                             {"until_s", of_log.until_s},
                             {"refit", JsonNumber(of_log.refit)},
                             {"final", JsonNumber(of_log.final)},
                             {"floor", JsonNumber(of_log.floor)}});
  }
  if (const auto closed = ClosedOf(d.by_log)) {
    gap["further_log"] = {
        {"closed", closed->median}, {"low", closed->least}, {"high", closed->most}, {"logs", closed->logs}};
  }
  return gap;
}

ordered_json JsonPolicy() {
  constexpr const DiagnosePolicy& policy = kDiagnosePolicy;
  ordered_json json = JsonSearchPolicy();
  const ordered_json others = {{"evidence.torques", policy.evidence.torques},
                               {"evidence.free_form", policy.evidence.free_form},
                               {"evidence.bound_deviations", policy.evidence.bound_deviations},
                               {"evidence.ratio_share", policy.evidence.ratio_share},
                               {"evidence.least_data_s", policy.evidence.least_data_s},
                               {"evidence.angle_waves", policy.evidence.angle_waves},
                               {"evidence.speed_waves", policy.evidence.speed_waves},
                               {"evidence.torque_share", policy.evidence.torque_share},
                               {"evidence.per_block", policy.evidence.per_block},
                               {"evidence.free_run_s", policy.evidence.free_run_s},
                               {"evidence.free_runs", policy.evidence.free_runs},
                               {"evidence.interval_factor", policy.evidence.interval_factor},
                               {"evidence.half_seconds", policy.evidence.half_seconds},
                               {"evidence.folds", policy.evidence.folds},
                               {"evidence.left_out_iterations", policy.evidence.left_out_iterations},
                               {"evidence.left_out_tolerance", policy.evidence.left_out_tolerance},
                               {"evidence.draws", policy.evidence.draws},
                               {"evidence.most_gain", policy.evidence.most_gain},
                               {"evidence.alone", policy.evidence.alone},
                               {"evidence.alike", policy.evidence.alike},
                               {"probability.constant", policy.probability.constant},
                               {"probability.gain", policy.probability.gain},
                               {"probability.discrepancy", policy.probability.discrepancy},
                               {"probability.clear", policy.probability.clear},
                               {"probability.smooth", policy.probability.smooth},
                               {"probability.dry", policy.probability.dry},
                               {"probability.most_discrepancy", policy.probability.most_discrepancy},
                               {"probability.most_clear", policy.probability.most_clear},
                               {"probability.least_clear", policy.probability.least_clear},
                               {"probability.present", policy.probability.present},
                               {"verdict.much_missing", policy.verdict.much_missing},
                               {"verdict.retuned", policy.verdict.retuned},
                               {"next.absent", policy.next.absent},
                               {"next.sure", policy.next.sure},
                               {"next.of_one_log", policy.next.of_one_log},
                               {"next.duration_s", policy.next.duration_s},
                               {"next.least_duration_s", policy.next.least_duration_s},
                               {"next.designs", policy.next.designs},
                               {"next.answers", policy.next.answers},
                               {"next.apart", policy.next.apart},
                               {"next.beyond_tie", policy.next.beyond_tie}};
  json.update(others);
  json.update(JsonFitPolicy());
  return json;
}

ordered_json ToJson(const DiagnoseRun& run, Timing timing) {
  const Diagnosis& d = run.diagnosis;
  ordered_json json = {{"schema", kDiagnosisSchema},
                       {"verdict", VerdictName(d.verdict)},
                       {"probability", d.probability},
                       {"effects", ordered_json::array()}};
  for (const auto& found : d.effects) json["effects"].push_back(Json(found));
  json["ambiguous"] = ordered_json::array();
  for (const auto& group : d.ambiguous) {
    ordered_json names = ordered_json::array();
    for (const auto& use : group) names.push_back(use.effect);
    json["ambiguous"].push_back(names);
  }
  json["gap"] = JsonGap(d);
  json["evidence"] = Json(d.evidence);
  json["where"] = JsonConditions(d.where);
  json["remains"] = JsonConditions(d.remains);
  json["candidates"] = ordered_json::array();
  for (const auto& c : d.candidates) json["candidates"].push_back(Json(c));
  json["statements"] = ordered_json::array();
  for (const auto& statement : d.statements) json["statements"].push_back(Json(statement));
  json["remainder"] = {
      {"explained", JsonNumber(d.remainder.explained)},           {"systematic", JsonNumber(d.remainder.systematic)},
      {"not_repeatable", JsonNumber(d.remainder.not_repeatable)}, {"sensors", JsonNumber(d.remainder.sensors)},
      {"reachable", JsonNumber(d.remainder.reachable)},           {"where", JsonConditions(d.remains)}};
  json["at_bounds"] = ordered_json::array();
  for (const auto& p : d.at_bounds)
    json["at_bounds"].push_back({{"name", p.name}, {"value", JsonNumber(p.value)}, {"unit", p.unit}});
  json["left_out"] = ordered_json::array();
  if (d.model) {
    for (const LeftOutCandidate& candidate : d.model->rig()->left_out())
      json["left_out"].push_back({{"name", candidate.name}, {"why", candidate.why}});
  }
  json["next_experiment"] = Json(d.next);
  json["explanation"] = d.explanation;
  if (d.refit_model) {
    const Experiment& experiment = d.refit_model->experiment();
    json["experiment"] = experiment.path;
    if (!experiment.replay.while_column.empty()) json["while"] = experiment.replay.while_column;
  }
  json["logs"] = {{"train", d.train_logs}, {"held_out", d.held_out_logs}, {"held_out_by", d.split}};
  if (d.model) json["model"] = JsonModel(RunModelOf(*d.model, d.values));
  if (d.refit_model) json["refit_model"] = JsonModel(RunModelOf(*d.refit_model, d.refit_values));
  json["time_step_s"] = d.time_step_s;
  json["windows"] = {{"fitted", d.windows.fitted},
                     {"of_sizes", d.windows.of_sizes},
                     {"all", d.windows.all},
                     {"length_s", d.windows.length_s}};
  if (timing == Timing::kInclude) json["wall_s"] = d.wall_s;
  json["budget"] = {{"work", d.most_steps}, {"spent", d.work.steps}, {"unit", "steps"}, {"cut", d.cut}};
  json["termination"] = d.interrupted ? "interrupted" : d.cut.empty() ? "finished" : "budget spent";
  json["policy"] = JsonPolicy();
  json["seed"] = run.info.seed;
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToTable(const DiagnoseRun& run) {
  const Diagnosis& d = run.diagnosis;
  std::string text = fmt::format("verdict: {} (probability {:.2f})\n", VerdictName(d.verdict), d.probability);
  for (const Sentence& sentence : SentencesOf(d)) text += Wrapped("- " + sentence.Text(), 120, "  ") + "\n";
  if (!d.effects.empty()) text += SizeTable(d);
  text += "\nheld-out error, a share of the signals' standard deviation\n";
  for (const std::string& sentence : {GapInWindows(d), GapByLog(d), GapInFreeRuns(d)}) {
    if (!sentence.empty()) text += Wrapped("- " + sentence, 120, "  ") + "\n";
  }
  text += RemainderText(d.remainder);
  text += "\n" + Wrapped(d.explanation, 120) + "\n";
  text += ConditionTable("where", d.where);
  if (MuchRemains(d)) text += ConditionTable("what remains", d.remains);
  text += StatementTable(d);
  if (const auto sentences = NextSentences(d); !sentences.empty()) {
    text += "\nnext experiment\n";
    for (const std::string& sentence : sentences) text += Wrapped("- " + sentence, 120, "  ") + "\n";
    if (!d.next.command.empty()) text += WrappedCommand(d.next.command, 120) + "\n";
  }
  const char* const early = d.interrupted ? ", interrupted" : d.cut.empty() ? "" : ", the whole budget";
  const auto& [fitted, all, of_sizes, length_s] = d.windows;
  const std::string sizes = of_sizes > fitted ? fmt::format(", sizes to {}", of_sizes) : "";
  text += fmt::format("\nfitted: {} of {} windows of {:.3g} s{}; held out: {}; {:.1f} s{}\n", fitted, all, length_s,
                      sizes, d.split, d.wall_s, early);
  return text;
}

}  // namespace gapscope

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "src/compare/noise.h"
#include "src/core/file.h"
#include "src/core/names.h"
#include "src/core/statistics.h"
#include "src/diagnose/base_fit.h"
#include "src/diagnose/coarsen.h"
#include "src/diagnose/columns.h"
#include "src/diagnose/describe.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/search.h"
#include "src/diagnose/short_windows.h"
#include "src/tune/job_key.h"

namespace gapscope {
namespace {

// Noise of each measured signal, from the log itself: the median over logs. SI.
std::vector<double> SignalNoise(const Experiment& experiment, const DataSplit& data) {
  std::vector<std::vector<double>> found(experiment.measured.size());
  for (const auto* part : {&data.train, &data.held_out}) {
    for (const auto& recording : *part) {
      for (const auto& measured : recording.measured)
        found[measured.index].push_back(SensorNoise(recording.time_s, measured.values, measured.spec.resolution));
    }
  }
  std::vector<double> noise(found.size(), 1.0);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i].empty()) continue;
    noise[i] = std::max(Median(found[i]), std::numeric_limits<double>::min());
  }
  return noise;
}

std::vector<double> WeightsOf(const Experiment& experiment, const std::vector<double>& noise) {
  std::vector<double> weights(noise.size());
  for (std::size_t i = 0; i < noise.size(); ++i) weights[i] = experiment.measured[i].scored ? 1 / noise[i] : 0;
  return weights;
}

}  // namespace

std::string NameOf(const Explanation& explanation) { return explanation ? explanation->Text() : "none"; }

std::string NameOfSet(const std::vector<EffectUse>& set) {
  std::string name;
  for (const auto& use : set) name += (name.empty() ? "" : " + ") + use.Text();
  return name.empty() ? "none" : name;
}

std::string TogetherWith(const FoundEffect& found) {
  return found.together.empty() ? "" : " together with " + NameOfSet(found.together);
}

std::string VerdictName(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNone:
      return "none";
    case Verdict::kParameters:
      return "parameters";
    case Verdict::kEffects:
      return "effects";
    case Verdict::kAmbiguous:
      return "ambiguous";
    case Verdict::kUnknown:
      return "unknown";
  }
  return "";
}

std::string WhyName(NextExperiment::Why why) {
  switch (why) {
    case NextExperiment::Why::kNothing:
      return "nothing is open";
    case NextExperiment::Why::kTogether:
      return "told together";
    case NextExperiment::Why::kUnsure:
      return "not sure";
    case NextExperiment::Why::kOneLog:
      return "one log shows it";
    case NextExperiment::Why::kUnseen:
      return "unseen";
  }
  return "";
}

template <>
std::span<const EnumName<SearchEffort>> EnumNames<SearchEffort>() {
  static constexpr EnumName<SearchEffort> kNames[] = {
      {SearchEffort::kQuick, "quick"}, {SearchEffort::kNormal, "normal"}, {SearchEffort::kThorough, "thorough"}};
  return kNames;
}

std::string AnswerName(Answer answer) {
  return answer == Answer::kPresent ? "present" : answer == Answer::kAbsent ? "absent" : "unseen";
}

namespace {

// Every third window of each log held out: for logs of which only some show the gap.
DataSplit InWindows(const DataSplit& data) {
  DataSplit blocks;
  for (const auto* part : {&data.train, &data.held_out})
    blocks.train.insert(blocks.train.end(), part->begin(), part->end());
  std::sort(blocks.train.begin(), blocks.train.end(),
            [](const Recording& a, const Recording& b) { return a.log_path < b.log_path; });
  blocks.held_out = blocks.train;
  blocks.how = "every third window of each log: only some logs show the gap";
  return blocks;
}

double ShareOfWork(SearchEffort effort) {
  return effort == SearchEffort::kQuick ? 0.3 : effort == SearchEffort::kNormal ? 1 : 4;
}

// Priors must be of effects that the rig can have.
Status CheckPriors(const std::map<std::string, double>& priors, const Rig& rig) {
  std::set<std::string> known;
  for (const auto& use : AllUses(rig)) known.insert({use.effect, use.Text()});
  for (const auto& [name, prior] : priors) {
    if (!known.contains(name))
      return NoSuch("no such effect on this rig", name, {known.begin(), known.end()}, "--prior");
    if (!(prior >= 0 && prior <= 1)) {
      return Error{.what = "not a probability",
                   .where = "--prior " + name,
                   .actual = fmt::format("{:g}", prior),
                   .allowed = "0 .. 1",
                   .cure = "0.5 says nothing"};
    }
  }
  return Ok();
}

// Everything that the numbers of a diagnosis depend on, the program among it.
Result<std::uint64_t> JobKey(const Model& model, const DataSplit& data, const DiagnoseOptions& options) {
  Hasher hasher;
  GS_ASSIGN(const std::string program, ReadFile("/proc/self/exe"));
  hasher.Text("diagnosis").Text(program).Text(mj_versionString());
  AddModel(model, &hasher);
  for (const auto* part : {&data.train, &data.held_out}) {
    hasher.Number(static_cast<double>(part->size()));
    for (const auto& recording : *part) AddRecording(recording, &hasher);
  }
  const double numbers[] = {
      static_cast<double>(data.asked),   static_cast<double>(options.effort),      options.window_s, options.sample_s,
      static_cast<double>(options.seed), static_cast<double>(options.replay_steps)};
  hasher.Numbers(numbers);
  for (const auto& [name, prior] : options.priors) hasher.Text(name).Number(prior);
  for (const EffectUse& use : options.known) hasher.Text(use.Text());
  for (const auto& [name, value] : options.values) hasher.Text(name).Number(value);
  for (const std::string& name : options.frozen) hasher.Text("frozen").Text(name);
  return hasher.value();
}

DataSplit Coarsened(DataSplit data, double sample_s) {
  for (auto* part : {&data.train, &data.held_out}) {
    for (auto& recording : *part) recording = Coarsen(recording, sample_s);
  }
  return data;
}

Deadline DeadlineOf(const DiagnoseOptions& options, std::chrono::steady_clock::time_point begin) {
  Deadline deadline{.stop = options.stop};
  if (options.budget_s > 0)
    deadline.time = begin + std::chrono::microseconds(static_cast<long long>(0.9e6 * options.budget_s));
  return deadline;
}

// Null: none is asked for.
Result<std::unique_ptr<DiagnosisJournal>> OpenJournal(const Model& model, const DataSplit& data,
                                                      const DiagnoseOptions& options, const Deadline& deadline) {
  if (options.journal.empty()) return std::unique_ptr<DiagnosisJournal>();
  GS_ASSIGN(const std::uint64_t key, JobKey(model, data, options));
  return DiagnosisJournal::Open(
      {.folder = options.journal, .key = key, .resume = options.resume, .deadline = deadline, .warn = options.warn});
}

// Of the kinematic tree that has the most, free to move on a base that stands.
int DofsOfLargestTree(const mjModel& m) {
  int most = 0;
  for (int tree = 0; tree < m.ntree; ++tree) most = std::max(most, m.tree_dofnum[tree]);
  return most;
}

// So many windows take so many steps of the simulator, each of a model of two joints or less. With each more joint of a
// chain a step costs as much again: it takes longer, and there is more to try. Limbs that stand apart are tried at
// once.
std::size_t WindowsIn(std::size_t steps, const Model& model, const Workbench& bench) {
  const mjModel& m = model.compiled();
  const double joints = static_cast<double>(m.nv), largest = DofsOfLargestTree(m);
  const double cost = std::sqrt(std::max(1.0, joints - 1) * std::max(1.0, largest - 1));
  return std::max<std::size_t>(
      1, static_cast<std::size_t>(static_cast<double>(steps) / cost * bench.time_step_s / bench.window_s));
}

// Where it makes no difference to the base model's replays, no contact is looked for in what is fitted: of an arm with
// collision geometry that is most of a step. Error: as Model::Build.
Result<Contacts> ContactsOf(const Model& model, const DataSplit& data, const ReplayOptions& options, ThreadPool& pool) {
  if (!model.MayCollide()) return Contacts::kAsTheMjcf;
  GS_ASSIGN(const auto without, Model::Build(model.rig(), {}, {}, Contacts::kNone));
  for (const auto* logs : {&data.train, &data.held_out}) {
    const double error = ReplayError(Replay(model, *logs, options, pool).logs),
                 change = std::abs(error - ReplayError(Replay(*without, *logs, options, pool).logs));
    if (!(change < options.step_error_share * error)) return Contacts::kAsTheMjcf;
  }
  return Contacts::kNone;
}

// How the model is stepped. Where too few windows could be fitted by the finer time step, it is a coarser one.
Status ChooseSteps(const Model& model, const DiagnoseOptions& options, Workbench* bench) {
  const SearchPolicy& policy = kDiagnosePolicy.search;
  ReplayOptions replay{.mode = ReplayMode::kWindows, .window_s = options.window_s};
  const auto choose = [&] { return ChooseTimeStep(model, bench->data->held_out, replay, bench->pool).step_s; };
  bench->time_step_s = choose();
  if (WindowsIn(options.replay_steps, model, *bench) < policy.least_windows) {
    replay.step_error_share = policy.coarse_step;
    bench->time_step_s = choose();
  }
  replay.time_step_s = bench->time_step_s;
  GS_ASSIGN(bench->contacts, ContactsOf(model, *bench->data, replay, bench->pool));
  return Ok();
}

// One replay of the training windows.
struct OneReplay {
  std::size_t steps = 0;
  double seconds = 0;
};
OneReplay ReplayOnce(const Workbench& bench) {
  const auto made = MakeCandidate(bench, {});
  if (!made.ok()) return {};
  const Candidate& candidate = made.value();
  const auto begin = std::chrono::steady_clock::now();
  const std::size_t steps = candidate.problem->Evaluate(candidate.problem->Start(), Keep::kCost).work.steps;
  return {steps, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()};
}

// Steps of one replay. Where a time is asked for, fewer windows are fitted if so many replays of them as even a short
// search and its judging take would not fit into it. All effects are looked at twice: at the base model, and beside the
// final set.
std::size_t KeepToTime(const Model& model, const DiagnoseOptions& options, Workbench* bench, bool* fewer_windows) {
  const OneReplay all = ReplayOnce(*bench);
  if (!(options.budget_s > 0)) return all.steps;
  const std::size_t replays = kDiagnosePolicy.search.least_replays + 2 * ColumnCount(*bench, AllUses(*bench->rig));
  const double share = options.budget_s / (all.seconds * static_cast<double>(replays));
  if (share >= 1) return all.steps;
  *fewer_windows = true;
  const double windows = share * static_cast<double>(bench->windows->size());
  ChooseWindows(model, std::max<std::size_t>(1, static_cast<std::size_t>(windows)), bench);
  return ReplayOnce(*bench).steps;
}

double FinestStep(const DataSplit& data) {
  double step_s = kInfinity;
  for (const auto* logs : {&data.train, &data.held_out}) {
    for (const auto& recording : *logs) step_s = std::min(step_s, recording.timeline.median_step_s);
  }
  return step_s;
}

void SayWhatWasFitted(const Workbench& bench, Diagnosis* result) {
  for (const auto& recording : bench.data->train) result->train_logs.push_back(recording.log_path);
  for (const auto& recording : bench.data->held_out) result->held_out_logs.push_back(recording.log_path);
  result->split = bench.data->how;
  result->by_windows = bench.by_windows;
  result->time_step_s = bench.time_step_s;
  result->windows.fitted = bench.windows->size();
  result->windows.all = bench.all_windows;
  result->windows.length_s = bench.window_s;
}

// On every row of the logs, of which fits may have left out some.
void ScoreFreeRuns(const DataSplit& fine, Diagnosis* result) {
  std::vector<const Recording*> logs;
  for (const auto* part : {&fine.train, &fine.held_out}) {
    for (const Recording& recording : *part) logs.push_back(&recording);
  }
  ScoreOnEveryRow(*result->model, result->values, logs, result->time_step_s, &result->evidence.free_runs);
}

// Of the search; `replay_steps`: of one replay of the training windows.
std::size_t MostSteps(SearchEffort effort, std::size_t replay_steps) {
  return static_cast<std::size_t>(ShareOfWork(effort) * static_cast<double>(kDiagnosePolicy.search.replays) *
                                  static_cast<double>(replay_steps));
}

// Tells what is done, and how much of the work of `bench`, once there is one.
Say Teller(const DiagnoseOptions& options, const Workbench* const& bench) {
  return [&](const std::string& stage) {
    if (options.progress) options.progress({stage, bench ? bench->work->steps : 0, bench ? bench->most_steps : 0});
  };
}

}  // namespace

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& fine, const DiagnoseOptions& options,
                           ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  const DataSplit data = Coarsened(fine, options.sample_s);
  if (data.train.empty() || data.held_out.empty())
    return Error{.what = "diagnosis needs logs to fit and logs to judge by", .where = experiment.path};
  GS_ASSIGN(const auto model, Model::Load(experiment));
  GS_RETURN_IF_ERROR(CheckPriors(options.priors, *model->rig()));
  const ScaleTable scales = EstimateScales(*model, fine.train);
  const std::vector<double> noise = SignalNoise(experiment, fine);
  const Workbench* at = nullptr;
  const Say say = Teller(options, at);
  const Deadline deadline = DeadlineOf(options, begin);
  GS_ASSIGN(const auto journal, OpenJournal(*model, fine, options, deadline));
  bool fewer_windows = false;
  const auto make_bench = [&](const DataSplit& part, bool by_windows) -> Result<Workbench> {
    Workbench bench{.rig = model->rig(),
                    .data = &part,
                    .scales = scales,
                    .pool = pool,
                    .weights = WeightsOf(experiment, noise),
                    .window_s = options.window_s,
                    .priors = options.priors,
                    .known = options.known,
                    .values = options.values,
                    .frozen = options.frozen};
    bench.sample_s = FinestStep(fine);
    GS_RETURN_IF_ERROR(ChooseSteps(*model, options, &bench));
    bench.by_windows = by_windows;
    ChooseWindows(*model, WindowsIn(options.replay_steps, *model, bench), &bench);
    bench.most_steps = MostSteps(options.effort, KeepToTime(*model, options, &bench, &fewer_windows));
    bench.deadline = deadline;
    bench.journal = journal.get();
    return bench;
  };
  GS_ASSIGN(const Workbench bench, make_bench(data, false));
  at = &bench;
  GS_ASSIGN(auto found, FitBase(bench, say));
  const DescribeOptions describe{noise, options.seed, options.next_experiment};
  // What only one log shows can be judged on no other: then windows of every log are held out instead of whole logs.
  const bool by_windows = !data.asked && found->uneven;
  const DataSplit blocks = by_windows ? InWindows(data) : DataSplit{};
  std::unique_ptr<const Workbench> again;
  if (by_windows) {
    GS_ASSIGN(Workbench in_windows, make_bench(blocks, true));
    again = std::make_unique<const Workbench>(std::move(in_windows));
    at = again.get();
    found = nullptr;
    GS_ASSIGN(found, FitBase(*again, say));
  }
  GS_ASSIGN(const auto lead, SearchShortWindows(*at, *found->base, say));
  FindEffects(*at, lead.hints, say, found.get());
  GS_ASSIGN(Diagnosis result, Describe(*found, *at, describe, say));
  result.work += lead.work;
  result.most_steps += lead.work.steps;
  SayWhatWasFitted(*at, &result);
  ScoreFreeRuns(fine, &result);
  if (fewer_windows) result.cut.insert(result.cut.begin(), "windows");
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

}  // namespace gapscope

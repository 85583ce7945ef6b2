#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/diagnose_job.h"
#include "src/diagnose/policy.h"

namespace gapscope::cli {
namespace {

Result<int> RunDiagnose(const DiagnoseFlags& flags) {
  GS_ASSIGN(const DiagnoseRun run, DiagnoseLogs(flags));
  fmt::print("{}", flags.common.json ? ToJson(run).dump(2) + "\n" : ToTable(run));
  return kDone;
}

}  // namespace

Command DiagnoseCommand() {
  auto flags = std::make_shared<DiagnoseFlags>();
  const std::vector<Option> own = {
      {.flag = "--hold-out",
       .value = &flags->hold_out,
       .help = "A log to judge by, not to fit; more than once",
       .more = "Without it whole logs are held out where there are several, blocks of time where there is one; the "
               "result says which"},
      {.flag = "--prior",
       .value = &flags->prior,
       .help = "What is known of an effect: EFFECT=P or EFFECT@PLACE=P, P from 0 to 1, more than once",
       .more =
           "Multiplies the odds that the logs give: 0.9 says nine to one before the logs are seen, 0.5 (every other "
           "effect's) nothing. The result has both, `prior` and `evidence`"},
      {.flag = "--from",
       .value = &flags->from,
       .help = "Go on from an earlier diagnosis of the same experiment and logs: its folder",
       .more =
           "The effects that it found become known, as with --with and --set; what is missing beside them is looked "
           "for. --accept takes some of them"},
      {.flag = "--accept",
       .value = &flags->accept,
       .unset = "all effects of its final model",
       .help = "A statement of --from, by number or EFFECT@PLACE, more than once"},
      {.flag = "--freeze",
       .value = &flags->freeze,
       .help = "Hold a parameter at its value, more than once",
       .more =
           "Of the base model, or of a known effect (--with, --from): what is measured better than logs can tell is "
           "not fitted"},
      {.flag = "--budget",
       .value = &flags->budget_s,
       .unit = "s",
       .range = Above(0, 0),
       .unset = "no limit of time",
       .help = "Time; the best verdict so far when it is spent",
       .more = "Without it the work is limited by --effort alone, and the verdict is the same on any machine. Of a "
               "resumed run: from its own start on"},
      {.flag = "--effort",
       .value = ChoiceOf(flags->effort),
       .help = "How much work the search may take",
       .more = fmt::format("Work is counted in simulated steps: 0.3, 1 and 4 times {} replays of the training windows",
                           kDiagnosePolicy.search.replays)},
      WindowOption(flags->window_s),
      {.flag = "--no-next-experiment",
       .value = &flags->no_next_experiment,
       .help = "Design no next experiment: a good part of a short run"},
      {.flag = "--resume",
       .value = &flags->resume,
       .help = "Go on with the interrupted run in --out, to the same result",
       .more = "Fits and columns of a run are kept in --out/diagnosis.journal until its result is written"}};
  return {.name = "diagnose",
          .what = "Where the gap lies, which unmodelled effect causes it, how far it shrinks",
          .options = Join({LogOptions(flags->model),
                           EffectOptions(flags->model),
                           own,
                           {FolderOption(flags->common, "result.json, report.html, model.xml and next_experiment.csv")},
                           CommonOptions(flags->common)}),
          .example = "gapscope diagnose models/qube/experiment.yaml a.csv b.csv c.csv --hold-out d.csv --out diagnosis",
          .run = [flags] { return RunDiagnose(*flags); }};
}

}  // namespace gapscope::cli

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/design/linear.h"
#include "src/report/feedback_report.h"
#include "src/report/json.h"

namespace gapscope::cli {
namespace {

struct FeedbackFlags {
  CommonFlags common;
  std::string experiment;
  std::vector<std::string> at, set, params, value, poles;
  std::vector<double> q;
  double r = 1;
  bool lqr = true;
};

// "-3.5", "-3.5+8.4i", "-3.5-8.4i".
Result<std::complex<double>> ParsePole(const std::string& text) {
  const char *end = text.data() + text.size(), *at = text.data();
  double real = 0, imaginary = 0;
  auto parsed = std::from_chars(at, end, real);
  bool good = parsed.ec == std::errc();
  if (good && parsed.ptr != end) {
    at = *parsed.ptr == '+' ? parsed.ptr + 1 : parsed.ptr;
    parsed = std::from_chars(at, end, imaginary);
    good = parsed.ec == std::errc() && parsed.ptr + 1 == end && *parsed.ptr == 'i';
  }
  if (!good || !std::isfinite(real) || !std::isfinite(imaginary))
    return Error{.what = "not a pole", .where = "--poles", .actual = "'" + text + "'", .allowed = "-3.5 or -3.5+8.4i"};
  return std::complex<double>(real, imaginary);
}

Result<int> RunFeedback(const FeedbackFlags& flags) {
  GS_ASSIGN(const Experiment experiment, LoadExperiment(flags.experiment));
  GS_ASSIGN(const auto model, Model::Load(experiment));
  std::vector<double> values = model->Nominal();
  GS_RETURN_IF_ERROR(OverrideValues(*model, flags.params, flags.set, &values));
  std::map<std::string, double> at, log_values;
  for (const auto& text : flags.at) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--at"));
    at.insert(assignment);
  }
  for (const auto& spec : experiment.values) log_values[spec.name] = spec.fallback.value_or(0);
  for (const auto& text : flags.value) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--value"));
    log_values[assignment.first] = assignment.second;
  }
  if (experiment.commands.empty())
    return Error{.what = "the experiment has no command to drive", .where = flags.experiment};
  GS_ASSIGN(const LinearSystem system, Linearize(*model, values, log_values, at, 0));
  const Eigen::Index n = system.a.rows();
  Feedback feedback;
  if (flags.lqr) {
    if (static_cast<Eigen::Index>(flags.q.size()) != n) {
      std::string names;
      for (const auto& state : system.states) names += (names.empty() ? "" : ", ") + state;
      return Error{.what = "one weight for each state is needed",
                   .where = "--q",
                   .actual = std::to_string(flags.q.size()),
                   .allowed = std::to_string(n) + ": " + names};
    }
    const Eigen::VectorXd weights = Eigen::Map<const Eigen::VectorXd>(flags.q.data(), n);
    GS_ASSIGN(feedback,
              Lqr(system.a, system.b, Eigen::MatrixXd(weights.asDiagonal()), Eigen::MatrixXd::Constant(1, 1, flags.r)));
  } else {
    std::vector<std::complex<double>> poles;
    for (const auto& text : flags.poles) {
      GS_ASSIGN(const auto pole, ParsePole(text));
      poles.push_back(pole);
    }
    GS_ASSIGN(feedback, PlacePoles(system.a, system.b, poles));
  }
  const FeedbackRun run{.info = {},
                        .states = system.states,
                        .gain = {feedback.gain.data(), feedback.gain.data() + n},  // one row
                        .open_poles = SortedPoles(system.a),
                        .closed_poles = feedback.poles};
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run));
  return kDone;
}

}  // namespace

namespace {

std::vector<Option> OptionsOf(FeedbackFlags& flags) {
  return Join({{ExperimentOption(flags.experiment),
                {.flag = "--at",
                 .value = &flags.at,
                 .unset = "the model's initial pose",
                 .help = "Equilibrium: JOINT=POSITION, more than once",
                 .more = "Speeds and commands are zero there; what is no equilibrium is refused"}},
               ValueOptions(flags.set, flags.params),
               {{.flag = "--value",
                 .value = &flags.value,
                 .help = "A number that a log would bring: NAME=VALUE, more than once"}},
               PrintOptions(flags.common)});
}

Command LqrCommand() {
  auto flags = std::make_shared<FeedbackFlags>();
  const std::vector<Option> own = {
      {.flag = "--q",
       .value = &flags->q,
       .required = true,
       .commas = true,
       .help = "Weights of the states, positions first, separated by commas"},
      {.flag = "--r", .value = &flags->r, .range = Above(0), .help = "Weight of the command"}};
  return {.name = "lqr",
          .what = "State feedback by quadratic weights (Riccati)",
          .options = Join({OptionsOf(*flags), own}),
          .example =
              "gapscope design lqr models/qube/experiment.yaml --at pendulum=3.141592653589793 --q 10,10,1,10 "
              "--r 1",
          .run = [flags] { return RunFeedback(*flags); }};
}

Command PolesCommand() {
  auto flags = std::make_shared<FeedbackFlags>();
  flags->lqr = false;
  const std::vector<Option> own = {{.flag = "--poles",
                                    .value = &flags->poles,
                                    .unit = "1/s",
                                    .required = true,
                                    .commas = true,
                                    .help = "Wanted poles, separated by commas, as --poles=-2,-3+4i,-3-4i"}};
  return {.name = "poles",
          .what = "State feedback by pole placement",
          .options = Join({OptionsOf(*flags), own}),
          .example =
              "gapscope design poles models/qube/experiment.yaml --at pendulum=3.141592653589793 "
              "--poles=-2,-2.2,-15,-115",
          .run = [flags] { return RunFeedback(*flags); }};
}

}  // namespace

std::vector<Command> FeedbackCommands() { return {LqrCommand(), PolesCommand()}; }

}  // namespace gapscope::cli

#include "src/cli/uncertain.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/dense.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

// Few logs make two parameters look as if they went together exactly: so much of each covariance is taken for chance.
constexpr double kChance = 0.1;

UncertainParameter ParameterAt(const Model& model, const TuneRun& run, std::size_t i) {
  const std::string& name = run.parameters[i].name;
  return {.index = model.IndexOf(name),
          .logarithmic = run.spread.logarithmic[i],
          .together = std::ranges::any_of(run.correlated, [&](const auto& p) { return p.a == name || p.b == name; })};
}

// By the parameters' intervals: what the logs leave open together.
void TakeCovariance(const Model& model, const TuneRun& run, Uncertain* uncertain) {
  std::vector<Eigen::Index> known;
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    if (!run.parameters[i].identifiable) continue;
    known.push_back(static_cast<Eigen::Index>(i));
    uncertain->parameters.parameters.push_back(ParameterAt(model, run, i));
  }
  uncertain->parameters.covariance = run.spread.covariance(known, known);
}

// What a log's own fit says of a parameter, by its place there; -1: the log alone does not know it.
Eigen::Index PlaceIn(const TuneRun::LogFit& fit, const std::string& name, bool logarithmic) {
  const auto p = std::ranges::find(fit.parameters, name, &TuneRun::Parameter::name);
  if (p == fit.parameters.end() || !p->identifiable || (logarithmic && p->value == 0)) return -1;
  return p - fit.parameters.begin();
}

// What the fits to each log say of the same parameters, in the coordinates that they are fitted in.
struct LogValues {
  Eigen::MatrixXd values;  // parameters x logs
  Eigen::MatrixXd within;  // how far the fits themselves may be off: the mean of their covariances
};

// `parameters`: places in the run's list, of those that each log knows.
LogValues ValuesOfLogs(const TuneRun& run, const std::vector<std::size_t>& parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size()), logs = static_cast<Eigen::Index>(run.per_log.size());
  LogValues found{.values = Eigen::MatrixXd(n, logs), .within = Eigen::MatrixXd::Zero(n, n)};
  for (Eigen::Index l = 0; l < logs; ++l) {
    const TuneRun::LogFit& fit = run.per_log[static_cast<std::size_t>(l)];
    std::vector<Eigen::Index> places;
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t p = parameters[static_cast<std::size_t>(i)];
      const bool logarithmic = run.spread.logarithmic[p];
      places.push_back(PlaceIn(fit, run.parameters[p].name, logarithmic));
      const double value = fit.parameters[static_cast<std::size_t>(places.back())].value;
      found.values(i, l) = logarithmic ? std::log(std::abs(value)) : value;
    }
    // A result of an earlier version does not say how far its fits may be off.
    if (fit.spread.covariance.rows() == static_cast<Eigen::Index>(fit.parameters.size()))
      found.within += fit.spread.covariance(places, places) / static_cast<double>(logs);
  }
  return found;
}

// How the logs themselves differ: of how their fits do, less what the fits leave open (Hedges' estimator of random
// effects). A part of each covariance is taken for chance. It may have negative eigenvalues.
Eigen::MatrixXd Between(const LogValues& logs) {
  const Eigen::MatrixXd deviations = logs.values.colwise() - logs.values.rowwise().mean();
  const Eigen::MatrixXd all =
      deviations * deviations.transpose() / (static_cast<double>(logs.values.cols()) - 1) - logs.within;
  Eigen::MatrixXd between = (1 - kChance) * all;
  between.diagonal() = all.diagonal();
  return between;
}

// By the fits to each log alone: how the logs differ, or those fits as they are.
void TakeLogs(const Model& model, const TuneRun& run, Uncertain* uncertain) {
  std::vector<std::size_t> of_each;
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    if (!run.parameters[i].identifiable) continue;
    const bool each = std::ranges::all_of(run.per_log, [&](const TuneRun::LogFit& fit) {
      return PlaceIn(fit, run.parameters[i].name, run.spread.logarithmic[i]) >= 0;
    });
    if (each) {
      of_each.push_back(i);
    } else {
      uncertain->not_of_each.push_back(run.parameters[i].name);
    }
  }
  const bool themselves = uncertain->parameters.from == DrawsFrom::kFits;
  LogValues logs = ValuesOfLogs(run, of_each);
  if (themselves) logs.within.setZero();
  const Eigen::VectorXd mean = logs.values.rowwise().mean();
  const Eigen::MatrixXd between = Between(logs);
  std::vector<Eigen::Index> differing;
  for (Eigen::Index k = 0; k < mean.size(); ++k) {
    const std::size_t i = of_each[static_cast<std::size_t>(k)];
    const UncertainParameter p = ParameterAt(model, run, i);
    double& centre = uncertain->values[static_cast<std::size_t>(p.index)];
    centre = p.logarithmic ? std::copysign(std::exp(mean[k]), centre) : mean[k];
    if (between(k, k) > 0) {
      differing.push_back(k);
      uncertain->parameters.parameters.push_back(p);
    } else {
      uncertain->alike.push_back(run.parameters[i].name);
    }
  }
  uncertain->logs = run.per_log.size();
  if (differing.empty()) return;
  if (themselves) uncertain->parameters.fits = (logs.values.colwise() - mean)(differing, Eigen::all);
  const SymmetricEigen eigen(between(differing, differing));
  uncertain->parameters.covariance =
      eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
}

// What was asked for, where the result has it.
Result<DrawsFrom> SourceOf(const TuneRun& run, std::optional<DrawsFrom> from, const std::string& where) {
  if (!from) return run.per_log.size() >= kEnoughLogs ? DrawsFrom::kLogs : DrawsFrom::kCovariance;
  const std::size_t needed = *from == DrawsFrom::kLogs ? kEnoughLogs : *from == DrawsFrom::kFits ? 2 : 0;
  if (run.per_log.size() >= needed) return *from;
  return Error{.what = "--draws-from " + NameOf(*from) + " needs fits to each log alone",
               .where = where,
               .actual = run.per_log.empty() ? "none" : "of " + std::to_string(run.per_log.size()) + " logs",
               .allowed = std::to_string(needed) + " logs or more",
               .cure =
                   "run `gapscope tune --each-log` with as many logs beside those held out, or give --draws-from "
                   "covariance or interval"};
}

}  // namespace

Result<Uncertain> UncertainOf(const Model& model, const std::vector<double>& values, const nlohmann::ordered_json& json,
                              const std::string& where, std::optional<DrawsFrom> from) {
  constexpr char kCure[] = "run `gapscope tune` (--from DIR takes over what a diagnosis found), and export its result";
  if (TextIn(json, "schema") != kTuneSchema)
    return Error{.what = "only a result of tune says how its parameters vary together", .where = where, .cure = kCure};
  GS_ASSIGN(const TuneRun run, ReadTuneRun(json, where));
  if (run.spread.logarithmic.size() != run.parameters.size())
    return Error{.what = "a result of an earlier version, without its covariance", .where = where, .cure = kCure};
  for (const TuneRun::Parameter& p : run.parameters) GS_RETURN_IF_ERROR(model.Find(p.name, where));
  Uncertain uncertain;
  uncertain.values = values;
  GS_ASSIGN(uncertain.parameters.from, SourceOf(run, from, where));
  if (uncertain.parameters.from == DrawsFrom::kLogs || uncertain.parameters.from == DrawsFrom::kFits) {
    TakeLogs(model, run, &uncertain);
  } else {
    TakeCovariance(model, run, &uncertain);
  }
  if (uncertain.parameters.parameters.empty() && !uncertain.alike.empty())
    return Error{.what = "the fits to each log alone differ no more than each leaves open: there is nothing to draw",
                 .where = where,
                 .cure = "draw of what one fit leaves open: --draws-from covariance"};
  if (uncertain.parameters.parameters.empty())
    return Error{.what = "the logs know none of the parameters: there is nothing to draw",
                 .where = where,
                 .cure = "tune with more logs, or with --freeze NAME for what goes together"};
  return uncertain;
}

}  // namespace gapscope::cli

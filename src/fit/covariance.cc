#include "src/fit/covariance.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

struct Covariance {
  Eigen::MatrixXd robust, model_based;  // of y, in units of each coordinate's range
  Eigen::MatrixXd of_prior;             // the part of `robust` that what is known beforehand leaves
  double freedom = 1;                   // of the part that the logs leave
};

// The sum of blocks' outer products, and how many blocks there are beyond the unknowns.
Eigen::MatrixXd Meat(const Linearization& at, double* freedom) {
  const Eigen::Index n = at.gradient.size();
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(n);
  const double blocks = static_cast<double>(at.block_gradients.size());
  for (const auto& g : at.block_gradients) mean += g / std::max(1.0, blocks);
  // Neighbouring blocks share slow residuals: one lag with Bartlett's weight (Newey & West, Econometrica 55, 1987).
  for (std::size_t b = 0; b < at.block_gradients.size(); ++b) {
    const Eigen::VectorXd g = at.block_gradients[b] - mean;
    meat += g * g.transpose();
    if (b + 1 < at.block_gradients.size() && at.block_series[b] == at.block_series[b + 1]) {
      const Eigen::VectorXd next = at.block_gradients[b + 1] - mean;
      meat += 0.5 * (g * next.transpose() + next * g.transpose());
    }
  }
  *freedom = std::max(1.0, blocks - static_cast<double>(n));
  meat *= blocks / *freedom;
  return meat;
}

Covariance CovarianceOf(const FitProblem& problem, const Linearization& at) {
  Covariance result;
  Eigen::MatrixXd meat = Meat(at, &result.freedom);
  const Eigen::VectorXd range = problem.layout().high - problem.layout().low;
  // In units of each coordinate's range, so that flat directions mean the same for all. What only holds open directions
  // is no knowledge. What is known beforehand is, at its own variance: the fit counts it `scale` times, and so it
  // scatters the solution by that much more.
  const Prior& prior = problem.prior();
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() -= prior.weight - prior.scale * prior.known;
  const Eigen::VectorXd scatter = prior.scale * prior.scale * prior.known;
  meat.diagonal() += scatter;
  hessian = range.asDiagonal() * hessian * range.asDiagonal();
  const SymmetricEigen eigen(hessian);
  const double largest = std::max(eigen.values.maxCoeff(), 1e-300);
  // Whitened: sandwich = W meat' W', the model's own covariance = noise W W'. A direction never counts as better known
  // than the model's own covariance says, which few blocks could pretend; raising eigenvalues keeps the matrix
  // consistent.
  const Eigen::MatrixXd whitener =
      eigen.vectors *
      eigen.values.cwiseMax(kCovariancePolicy.least_eigenvalue * largest).cwiseSqrt().cwiseInverse().asDiagonal();
  const double noise = 2 * at.cost / std::max<double>(1, static_cast<double>(problem.residuals()));
  const SymmetricEigen spread(whitener.transpose() * range.asDiagonal() * meat * range.asDiagonal() * whitener);
  const Eigen::MatrixXd half_covariance =
      whitener * spread.vectors * spread.values.cwiseMax(noise).cwiseSqrt().asDiagonal();
  result.robust = half_covariance * half_covariance.transpose();
  const Eigen::MatrixXd inverse = whitener * whitener.transpose();
  result.model_based = noise * inverse;
  result.of_prior = inverse * scatter.cwiseProduct(range.cwiseAbs2()).asDiagonal() * inverse;
  return result;
}

double HalfOf(const Covariance& c, const Eigen::VectorXd& direction) {
  return HalfInterval(c.robust, c.of_prior, c.freedom, direction);
}

TunedParameter OfCoordinate(const FitProblem& problem, const FitPoint& point, const Covariance& covariance,
                            Eigen::Index i) {
  const Coordinate& c = problem.space().coordinates()[static_cast<std::size_t>(i)];
  const double range = problem.layout().high[i] - problem.layout().low[i];
  const double deviation = std::sqrt(covariance.robust(i, i));
  TunedParameter tuned{.index = c.parameter, .value = c.ToValue(point.y[i])};
  const double half = HalfOf(covariance, Eigen::VectorXd::Unit(covariance.robust.rows(), i)) * range;
  tuned.low = c.ToValue(std::max(c.low, point.y[i] - half));
  tuned.high = c.ToValue(std::min(c.high, point.y[i] + half));
  if (tuned.low > tuned.high) std::swap(tuned.low, tuned.high);  // a negative size, as a logarithm
  tuned.at_bound = std::min(point.y[i] - c.low, c.high - point.y[i]) <= kCovariancePolicy.bound_share * range;
  tuned.identifiable = deviation < kCovariancePolicy.flat_share;
  return tuned;
}

// How a parameter that coordinates give together (SearchSpace::Couple) moves with them, in units of their ranges.
Eigen::VectorXd SlopeOf(const FitProblem& problem, const FitPoint& point, const SearchSpace::Couple& couple,
                        int index) {
  const SearchSpace& space = problem.space();
  std::vector<double> values = space.Values(point.y);
  const auto k = static_cast<std::size_t>(index);
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(point.y.size());
  for (const Eigen::Index i : {couple.size, couple.other, couple.cubic_place}) {
    if (i < 0) continue;
    const double range = problem.layout().high[i] - problem.layout().low[i], h = 1e-6 * range;
    space.SetCoordinate(point.y, i, point.y[i] - h, &values);
    const double below = values[k];
    space.SetCoordinate(point.y, i, point.y[i] + h, &values);
    slope[i] = (values[k] - below) / (2 * h) * range;
    space.SetCoordinate(point.y, i, point.y[i], &values);
  }
  return slope;
}

// Its deviation to first order. `slope`: as SlopeOf.
TunedParameter OfCouple(const FitProblem& problem, const FitPoint& point, const Covariance& covariance,
                        const Eigen::VectorXd& slope, int index) {
  const auto k = static_cast<std::size_t>(index);
  const Parameter& p = problem.model().parameters()[k];
  TunedParameter tuned{.index = index, .value = problem.space().Values(point.y)[k]};
  const double deviation = std::sqrt(std::max(0.0, slope.dot(covariance.robust * slope)));
  const double half = HalfOf(covariance, slope);
  tuned.low = std::max(p.low, tuned.value - half);
  tuned.high = std::min(p.high, tuned.value + half);
  tuned.at_bound =
      std::min(tuned.value - p.low, p.high - tuned.value) <= kCovariancePolicy.bound_share * (p.high - p.low);
  tuned.identifiable = deviation < kCovariancePolicy.flat_share * (p.high - p.low);
  return tuned;
}

std::vector<FlatDirection> FlatDirections(const FitProblem& problem, const Covariance& covariance) {
  std::vector<FlatDirection> result;
  const auto& coordinates = problem.space().coordinates();
  const Eigen::Index n = problem.space().size();
  const Eigen::VectorXd range = problem.layout().high - problem.layout().low;
  const Eigen::MatrixXd own = covariance.robust.topLeftCorner(n, n);
  const SymmetricEigen directions(own);
  for (Eigen::Index k = n - 1; k >= 0; --k) {
    const double deviation = std::sqrt(std::max(0.0, directions.values[k]));
    if (deviation < kCovariancePolicy.flat_share) break;
    FlatDirection flat{.deviation = deviation};
    Eigen::VectorXd parts(n);
    for (Eigen::Index i = 0; i < n; ++i) parts[i] = directions.vectors(i, k) * range[i];
    Eigen::Index leading = 0;
    parts.cwiseAbs().maxCoeff(&leading);
    const double scale = parts[leading];
    for (Eigen::Index i = 0; i < n; ++i) {
      if (std::abs(parts[i]) > 0.2 * std::abs(scale))
        flat.parts.emplace_back(coordinates[static_cast<std::size_t>(i)].parameter, parts[i] / scale);
    }
    std::stable_sort(flat.parts.begin(), flat.parts.end(),
                     [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
    result.push_back(std::move(flat));
  }
  return result;
}

}  // namespace

std::vector<int> KnownOf(const FitProblem& problem, const Linearization& at, const std::vector<int>& asked) {
  const Prior& prior = problem.prior();
  const Eigen::VectorXd range = problem.layout().high - problem.layout().low;
  Eigen::MatrixXd hessian = at.hessian;
  hessian.diagonal() -= prior.weight - prior.scale * prior.known;
  hessian = range.asDiagonal() * hessian * range.asDiagonal();
  const Eigen::VectorXd gradient = range.asDiagonal() * at.gradient;
  const auto inverse = [](const Eigen::MatrixXd& symmetric) -> Eigen::MatrixXd {
    const SymmetricEigen eigen(symmetric);
    const double least = kCovariancePolicy.least_eigenvalue * std::max(eigen.values.maxCoeff(), 1e-300);
    return eigen.vectors * eigen.values.cwiseMax(least).cwiseInverse().asDiagonal() * eigen.vectors.transpose();
  };
  const double left = std::max(0.0, at.reduced_cost - 0.5 * gradient.dot(inverse(hessian) * gradient));
  const double noise = std::max(2 * left / std::max<double>(1, static_cast<double>(problem.residuals())),
                                kCovariancePolicy.least_misfit * kCovariancePolicy.least_misfit);
  std::vector<Eigen::Index> kept(static_cast<std::size_t>(hessian.rows()));
  std::iota(kept.begin(), kept.end(), Eigen::Index{0});
  const auto& coordinates = problem.space().coordinates();
  const auto parameter = [&](Eigen::Index i) {
    return i < problem.space().size() ? coordinates[static_cast<std::size_t>(i)].parameter : -1;
  };
  std::vector<int> known = asked;
  while (!known.empty()) {
    const Eigen::MatrixXd covariance = noise * inverse(hessian(kept, kept));
    auto worst = kept.end();
    double most = kCovariancePolicy.flat_share * kCovariancePolicy.flat_share;
    for (auto i = kept.begin(); i != kept.end(); ++i) {
      const Eigen::Index at_row = i - kept.begin();
      if (std::ranges::find(known, parameter(*i)) == known.end() || !(covariance(at_row, at_row) >= most)) continue;
      most = covariance(at_row, at_row);
      worst = i;
    }
    if (worst == kept.end()) break;
    std::erase(known, parameter(*worst));
    kept.erase(worst);
  }
  return known;
}

double HalfInterval(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& of_prior, double freedom,
                    const Eigen::VectorXd& direction) {
  const double all = direction.dot(covariance * direction);
  if (!(all > 0)) return 0;
  const double from_logs = std::max(all - direction.dot(of_prior * direction), 1e-9 * all);
  return StudentQuantile(freedom * std::pow(all / from_logs, 2)) * std::sqrt(all);
}

Uncertainty EstimateUncertainty(const FitProblem& problem, const FitPoint& point, const Linearization& at,
                                const Eigen::MatrixXd& beside) {
  Uncertainty result;
  const SearchSpace& space = problem.space();
  const auto& coordinates = space.coordinates();
  Covariance covariance = CovarianceOf(problem, at);
  if (beside.size() > 0) {
    const Eigen::VectorXd in_range = (problem.layout().high - problem.layout().low).cwiseInverse();
    covariance.robust += in_range.asDiagonal() * beside * in_range.asDiagonal();
  }
  Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(space.size(), point.y.size());
  for (Eigen::Index i = 0; i < space.size(); ++i) {
    const auto couple = std::find_if(space.couples().begin(), space.couples().end(),
                                     [&](const auto& c) { return c.size == i || c.other == i; });
    const int index = coordinates[static_cast<std::size_t>(i)].parameter;
    const bool alone = couple == space.couples().end();
    const Coordinate& c = coordinates[static_cast<std::size_t>(i)];
    const double range = problem.layout().high[i] - problem.layout().low[i];
    // Of ln |value| where that is the coordinate.
    const Eigen::VectorXd slope = alone
                                      ? (c.logarithmic ? 1 : c.scale) * range * Eigen::VectorXd::Unit(point.y.size(), i)
                                      : SlopeOf(problem, point, *couple, index);
    TunedParameter tuned =
        alone ? OfCoordinate(problem, point, covariance, i) : OfCouple(problem, point, covariance, slope, index);
    const double deviation = std::sqrt(std::max(0.0, slope.dot(covariance.robust * slope)));
    slopes.row(i) = deviation > 0 ? HalfOf(covariance, slope) / (kNormalQuantile * deviation) * slope : slope;
    result.spread.logarithmic.push_back(alone && c.logarithmic);
    if (!tuned.identifiable) {
      const Parameter& p = problem.model().parameters()[static_cast<std::size_t>(index)];
      tuned.low = p.low;
      tuned.high = p.high;
    }
    result.tuned.push_back(tuned);
  }
  result.spread.covariance = slopes * covariance.robust * slopes.transpose();
  const Eigen::VectorXd range = problem.layout().high - problem.layout().low;
  result.covariance = range.asDiagonal() * covariance.robust * range.asDiagonal();
  result.of_prior = range.asDiagonal() * covariance.of_prior * range.asDiagonal();
  result.freedom = covariance.freedom;
  result.flat = FlatDirections(problem, covariance);
  const Eigen::MatrixXd& own = covariance.model_based;
  for (Eigen::Index i = 0; i < space.size(); ++i) {
    for (Eigen::Index j = i + 1; j < space.size(); ++j) {
      const double correlation = own(i, j) / std::sqrt(own(i, i) * own(j, j));
      if (std::abs(correlation) > kCovariancePolicy.correlated)
        result.correlated.emplace_back(coordinates[static_cast<std::size_t>(i)].parameter,
                                       coordinates[static_cast<std::size_t>(j)].parameter, correlation);
    }
  }
  return result;
}

}  // namespace gapscope

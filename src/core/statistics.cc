#include "src/core/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace gapscope {
namespace {

double OfRank(std::vector<double>* values, std::size_t rank) {
  const auto at = values->begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values->begin(), at, values->end());
  return *at;
}

}  // namespace

double Quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNaN;
  return OfRank(&values, static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1))));
}

double Median(std::vector<double> values) {
  if (values.empty()) return kNaN;
  return OfRank(&values, values.size() / 2);
}

double StudentQuantile(double freedom) {
  if (freedom <= 1) return 12.706;
  if (freedom <= 2) return 4.303;
  if (freedom <= 3) return 3.182;
  // Cornish and Fisher's expansion about the normal quantile.
  const double n = freedom, z = 1.959964, z2 = z * z;
  return z + z * (z2 + 1) / (4 * n) + z * (5 * z2 * z2 + 16 * z2 + 3) / (96 * n * n) +
         z * (3 * z2 * z2 * z2 + 19 * z2 * z2 + 17 * z2 - 15) / (384 * n * n * n);
}

}  // namespace gapscope

#include "src/core/names.h"

#include <algorithm>
#include <cctype>

namespace gapscope {

std::string Join(const std::vector<std::string>& names) {
  std::string all;
  for (const auto& name : names) all += (all.empty() ? "" : ", ") + name;
  return all;
}

std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      const bool same =
          std::tolower(static_cast<unsigned char>(a[i - 1])) == std::tolower(static_cast<unsigned char>(b[j - 1]));
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (same ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

std::string Nearest(std::string_view name, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = name.size() / 2 + 2;
  for (const std::string& candidate : candidates) {
    if (const std::size_t distance = EditDistance(name, candidate); distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

std::string DidYouMean(std::string_view name, const std::vector<std::string>& candidates,
                       const std::string& otherwise) {
  const std::string nearest = Nearest(name, candidates);
  return nearest.empty() ? otherwise : "did you mean '" + nearest + "'?";
}

Error NoSuch(const std::string& what, const std::string& name, const std::vector<std::string>& names,
             const std::string& where) {
  return {.what = what,
          .where = where,
          .actual = "'" + name + "'",
          .allowed = Join(names),
          .cure = DidYouMean(name, names)};
}

}  // namespace gapscope

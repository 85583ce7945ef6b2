// A finished search as a diagnosis: judged, its final set refitted, described and measured.
#ifndef GAPSCOPE_DIAGNOSE_DESCRIBE_H_
#define GAPSCOPE_DIAGNOSE_DESCRIBE_H_

#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

struct DescribeOptions {
  const std::vector<double>& noise;  // of each measured signal, SI
  std::uint64_t seed = 0;
  bool next_experiment = true;  // design one
};

// Which logs were fitted, and the time, are left to the caller.
Result<Diagnosis> Describe(SearchResult& found, const Workbench& bench, const DescribeOptions& options, const Say& say);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DESCRIBE_H_

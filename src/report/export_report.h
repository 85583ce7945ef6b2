// What `export` wrote and what it loses, for people and programs: console lines, and JSON (gapscope.fidelity/1).
#ifndef GAPSCOPE_REPORT_EXPORT_REPORT_H_
#define GAPSCOPE_REPORT_EXPORT_REPORT_H_

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/export/fidelity.h"
#include "src/export/randomize.h"
#include "src/model/native.h"
#include "src/report/run.h"

namespace gapscope {

struct ExportRun {
  RunInfo info;
  std::string result, target, what, out;  // what: the target in words; out: the written MJCF
  double time_step_s = 0;
  std::vector<NativeEffect> effects;
  std::map<std::string, int> delay_steps;   // of ExportedModel
  std::map<std::string, SentCommand> sent;  // of ExportedModel
  std::vector<std::string> files;           // beside the MJCF
  std::vector<std::string> left_out;        // fields that each log sets anew
  std::vector<std::string> logs;            // that the errors are of; empty: none could be read
  std::string unmeasured;                   // why there are no errors; empty: there are
  FidelityErrors errors;
  std::size_t draws = 0;  // 0: no randomisation was asked for
  DrawsFrom draws_from = DrawsFrom::kCovariance;
  Randomization randomization;
  std::size_t fitted_alone = 0;          // logs with a fit alone that the draws are of; 0: what one fit leaves open
  std::vector<std::string> alike;        // parameters in which logs do not differ: they stay at their mean
  std::vector<std::string> not_of_each;  // parameters that not each log alone knows: they stay as they are
};

nlohmann::ordered_json ToJson(const ExportRun& run);
std::string ToTable(const ExportRun& run);
// gapscope.randomization/1.
nlohmann::ordered_json RandomizationJson(const ExportRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_EXPORT_REPORT_H_

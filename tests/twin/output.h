// Logs as the contract's CSV files, labels as JSON.
#ifndef GAPSCOPE_TESTS_TWIN_OUTPUT_H_
#define GAPSCOPE_TESTS_TWIN_OUTPUT_H_

#include <string>
#include <vector>

#include "tests/twin/case.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

std::string CsvText(const std::vector<std::string>& names, const std::vector<std::vector<double>>& rows);
inline std::string CsvText(const Record& record) { return CsvText(record.names, record.rows); }
// A label in plain values, whatever kind of rig the case is of.
struct Label {
  struct Effect {
    std::string name, on;
    Values parameters, extra;
    double severity = 0;
    Gap gap;
    bool clear = true;
    double beside_torques = 0;
  };
  struct Roughness {
    std::string on;
    Rough rough;
    double rms_n_m = 0, alone = 0, refit = 0;
    Hold held;
  };
  struct BaseValue {
    std::string name, unit;
    double truth, nominal;
  };
  struct LogLine {
    std::string excitation;
    double amplitude;
    bool as_reference, weak_loop;
    double rate_hz, duration_s;
  };
  std::string rig;
  Kind kind = Kind::kNone;
  std::uint64_t seed = 0, index = 0;
  bool nominal_base = false;
  Gap gap;
  std::vector<Effect> effects;
  std::vector<Roughness> roughness;
  double rough_refit = 0;
  std::vector<Case::Member> group;
  std::string outside;
  Values outside_parameters;
  double outside_severity = 0;
  std::vector<BaseValue> base;
  std::vector<std::pair<std::string, Sensor>> sensors;
  std::vector<LogLine> logs;
};
Label LabelOf(const Case& c);
std::string LabelText(const Label& label, const std::vector<std::string>& files);
inline std::string LabelText(const Case& c, const std::vector<std::string>& files) {
  return LabelText(LabelOf(c), files);
}
// Writes through a temporary name, making folders. False with a text on failure.
bool WriteText(const std::string& path, const std::string& text, std::string* problem);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_OUTPUT_H_

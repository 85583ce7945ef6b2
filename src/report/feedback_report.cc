#include "src/report/feedback_report.h"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

std::string PoleText(const std::complex<double>& p) {
  return p.imag() == 0 ? fmt::format("{:.5g}", p.real()) : fmt::format("{:.5g}{:+.5g}i", p.real(), p.imag());
}

ordered_json PolesJson(const std::vector<std::complex<double>>& poles) {
  ordered_json list = ordered_json::array();
  for (const auto& p : poles) list.push_back({p.real(), p.imag()});
  return list;
}

}  // namespace

ordered_json ToJson(const FeedbackRun& run) {
  return {{"schema", "gapscope.design.feedback/1"},
          {"states", run.states},
          {"gain", run.gain},
          {"open_loop_poles", PolesJson(run.open_poles)},
          {"closed_loop_poles", PolesJson(run.closed_poles)},
          {"versions", JsonVersions(run.info)}};
}

std::string ToTable(const FeedbackRun& run) {
  std::string text =
      fmt::format("command = -(sum of gain x state), state from the equilibrium\n\n{:<24} {:>12}\n", "state", "gain");
  for (std::size_t i = 0; i < run.states.size(); ++i)
    text += fmt::format("{:<24} {:>12.5g}\n", run.states[i], run.gain[i]);
  text += "\npoles open  ";
  for (const auto& p : run.open_poles) text += fmt::format(" {}", PoleText(p));
  text += "\npoles closed";
  for (const auto& p : run.closed_poles) text += fmt::format(" {}", PoleText(p));
  return text + "\n";
}

}  // namespace gapscope

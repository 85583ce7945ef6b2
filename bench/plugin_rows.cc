#include <fmt/core.h>

#include <algorithm>
#include <string>

#include "bench/rows.h"
#include "src/core/mujoco_handles.h"

namespace gapscope::bench {
namespace {

constexpr int kSteps = 4000;

// One joint under a position servo, with what a row compares put in.
struct Parts {
  std::string extension, body, joint, actuator, custom;
};

std::string Mjcf(const Parts& parts) {
  return "<mujoco><option timestep='0.002' integrator='implicitfast'><flag contact='disable'/></option><extension>" +
         parts.extension + "</extension><custom>" + parts.custom + "</custom><worldbody><body name='arm'>" +
         parts.body + "<joint name='joint' axis='0 0 1' damping='0.5' " + parts.joint +
         "/><inertial pos='0 0 0' mass='1' diaginertia='0.16 0.16 0.16'/></body></worldbody><actuator>" +
         parts.actuator + "</actuator></mujoco>";
}

const std::string kServo = "<position name='motor' joint='joint' kp='157' kv='7'/>";

std::string Numerics(const std::string& instance, std::initializer_list<std::pair<const char*, double>> values) {
  std::string text;
  for (const auto& [key, value] : values)
    text += fmt::format("<numeric name='{}.{}' data='{}'/>", instance, key, value);
  return text;
}

Parts Motor(const std::string& custom, int actdim) {
  return {.extension =
              "<plugin plugin='gapscope.motor'><instance name='motor'><config key='law' value='position'/><config "
              "key='kp' value='157'/><config key='kd' value='7'/></instance></plugin>",
          .actuator = fmt::format(
              "<plugin name='motor' joint='joint' plugin='gapscope.motor' instance='motor' actdim='{}'/>", actdim),
          .custom = custom};
}

Parts OnBody(const std::string& plugin, const std::string& custom, const std::string& joint,
             const std::string& config = "") {
  return {.extension = "<plugin plugin='" + plugin + "'><instance name='p'><config key='joint' value='joint'/>" +
                       config + "</instance></plugin>",
          .body = "<plugin plugin='" + plugin + "' instance='p'/>",
          .joint = joint,
          .actuator = kServo,
          .custom = custom};
}

class Loop {
 public:
  static Result<Loop> Make(const Parts& parts) {
    char message[1000] = "";
    Loop loop;
    const std::string text = Mjcf(parts);
    const SpecPtr spec(mj_parseXMLString(text.c_str(), nullptr, message, sizeof message));
    if (spec) loop.model_.reset(mj_compile(spec.get(), nullptr));
    if (!loop.model_)
      return Error{.what = std::string("a benchmark's model does not compile: ") +
                           (spec ? mjs_getError(spec.get()) : message)};
    loop.data_.reset(mj_makeData(loop.model_.get()));
    return loop;
  }
  void Run() {
    mj_resetData(model_.get(), data_.get());
    for (int i = 0; i < kSteps; ++i) {
      data_->ctrl[0] = 0.3 * ((i / 200) % 2);
      mj_step(model_.get(), data_.get());
    }
  }

 private:
  ModelPtr model_;
  DataPtr data_;
};

}  // namespace

Result<std::vector<Row>> PluginRows(const BenchOptions& options) {
  const std::string friction = "frictionloss='1e-6' solreffriction='-1 -499.95' solimpfriction='.9999 .9999 .001 .5 2'";
  const std::string coulomb = "frictionloss='0.5' solreffriction='-1 -499.95' solimpfriction='.9999 .9999 .001 .5 2'";
  const Parts servo{.actuator = kServo}, dry{.joint = coulomb, .actuator = kServo};
  const std::tuple<const char*, double, Parts, Parts> cases[] = {
      {"plugin_cost.motor.neutral", 1.25, Motor("", 0), servo},
      {"plugin_cost.motor.active", 1.6,
       Motor(Numerics("motor", {{"command_delay_s", 0.003},
                                {"torque_delay_s", 0.002},
                                {"time_constant_s", 0.004},
                                {"second_time_constant_s", 0.001},
                                {"dead_zone", 0.1},
                                {"torque_limit_n_m", 40},
                                {"power_w", 300},
                                {"sag_fraction", 0.2},
                                {"sag_time_constant_s", 0.3},
                                {"droop_at_peak", 0.1},
                                {"droop_reference_n_m", 40},
                                {"asymmetry", 0.05},
                                {"efficiency_drive", 0.9},
                                {"efficiency_backdrive", 0.8}}),
             3),
       servo},
      {"plugin_cost.friction.neutral", 1.25,
       OnBody("gapscope.friction", Numerics("p", {{"friction_n_m", 0.5}}), friction), dry},
      {"plugin_cost.friction.active", 1.6,
       OnBody("gapscope.friction",
              Numerics("p", {{"friction_n_m", 0.5},
                             {"breakaway_n_m", 0.7},
                             {"stribeck_speed_rad_per_s", 0.1},
                             {"viscous_n_m_s_per_rad", 0.1},
                             {"quadratic_n_m_s2_per_rad2", 0.05},
                             {"load_coefficient", 0.1},
                             {"friction_positive_n_m", 0.1},
                             {"friction_negative_n_m", 0.05}}),
              friction),
       dry},
      {"plugin_cost.spring.neutral", 1.25, OnBody("gapscope.spring", "", ""), servo},
      {"plugin_cost.spring.active", 1.6,
       OnBody("gapscope.spring",
              Numerics("p", {{"stiffness_n_m_per_rad", 2},
                             {"rest_rad", 0.1},
                             {"hysteresis_n_m", 0.1},
                             {"hysteresis_rad", 0.02},
                             {"cubic_n_m_per_rad3", 1},
                             {"gravity_n_m", 0.5},
                             {"bias_n_m", 0.1},
                             {"cogging_n_m", 0.1},
                             {"cogging_periods_per_rev", 12}}),
              ""),
       servo},
      {"plugin_cost.expression", 1.6,
       OnBody("gapscope.expression", Numerics("p", {{"amplitude_n_m", 0.1}, {"phase_rad", 0.2}}), "",
              "<config key='torque' value='amplitude_n_m * sin(12 * angle + phase_rad)'/>"),
       servo},
  };
  std::vector<Row> rows;
  for (const auto& [name, target, with, without] : cases) {
    GS_ASSIGN(Loop plugin, Loop::Make(with));
    GS_ASSIGN(Loop plain, Loop::Make(without));
    const Pairs pairs = TimePairs(Clock::kThread, options.repeats, [&] { plugin.Run(); }, [&] { plain.Run(); });
    std::vector<double> ratios;
    for (std::size_t i = 0; i < pairs.a_s.size(); ++i) ratios.push_back(pairs.a_s[i] / pairs.b_s[i]);
    Row row{.name = name, .target = target, .better = "lower"};
    Summarise(ratios, row);
    row.detail = fmt::format("{:.2f} us a step against {:.2f} us", 1e6 * Quantile(pairs.a_s, 0.5) / kSteps,
                             1e6 * Quantile(pairs.b_s, 0.5) / kSteps);
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace gapscope::bench

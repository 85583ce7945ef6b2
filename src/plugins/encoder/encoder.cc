#include "src/plugins/encoder/encoder.h"

#include <algorithm>
#include <cmath>

#include "src/plugins/common/refusal.h"
#include "src/plugins/common/register.h"

namespace gapscope::plugins {
namespace {

bool Flag(std::string_view text, bool* value) {
  *value = text == "true" || text == "1";
  return *value || text.empty() || text == "false" || text == "0";
}

}  // namespace

double Encoder::MaxDelay(const mjModel* m, int instance) {
  double value = 0;
  if (ParseNumber(ConfigText(m, instance, "max_delay_s"), &value)) return value;
  const std::string name = InstanceName(m, instance);
  if (!name.empty() && mj_name2id(m, mjOBJ_NUMERIC, (name + ".delay_s").c_str()) >= 0) return kDefaultMaxDelay_s;
  return ParseNumber(ConfigText(m, instance, "delay_s"), &value) && value > 0 ? kDefaultMaxDelay_s : 0;
}

int Encoder::StateSize(const mjModel* m, int instance) {
  const double max_delay = MaxDelay(m, instance);
  if (!(max_delay > 0) || max_delay > 10) return kSlots;
  double step = 0;
  if (!ParseNumber(ConfigText(m, instance, "min_timestep_s"), &step) || !(step > 0)) step = m->opt.timestep / 2;
  return kSlots + History::Size(static_cast<int>(std::min(std::ceil(max_delay / step) + 2, 1e6)), 0);
}

std::unique_ptr<Encoder> Encoder::Create(const mjModel* m, int instance) {
  auto encoder = std::make_unique<Encoder>();
  const std::string problem = encoder->Resolve(m, instance);
  encoder->inert_ = !problem.empty();
  return encoder->inert_ && Refuse(m, problem) ? nullptr : std::move(encoder);
}

std::string Encoder::Resolve(const mjModel* m, int instance) {
  state_ = m->plugin_stateadr[instance];
  const std::string who = "gapscope.encoder instance '" + InstanceName(m, instance) + "': ";

  if (const std::string fault = live_.Resolve(m, instance, kSpecs); !fault.empty()) return "gapscope.encoder " + fault;
  const std::string_view velocity_text = ConfigText(m, instance, "velocity");
  if (!Flag(velocity_text, &velocity_)) {
    return who + "attribute 'velocity' is '" + std::string(velocity_text) + "', allowed true, false";
  }
  for (const char* key : {"max_delay_s", "min_timestep_s"}) {
    const std::string_view text = ConfigText(m, instance, key);
    double value = 0;
    if (!text.empty() && (!ParseNumber(text, &value) || value < 0 || value > 10)) {
      return who + "attribute '" + key + "' is '" + std::string(text) + "', allowed 0 to 10 s; leave it out";
    }
  }
  max_delay_s_ = MaxDelay(m, instance);
  if (const double delay = live_(m, kDelay); delay > max_delay_s_) {
    return who + "attribute 'delay_s' is " + std::to_string(delay) +
           " s, allowed 0 to max_delay_s = " + std::to_string(max_delay_s_) + " s; raise max_delay_s";
  }

  int sensor = -1;
  for (int i = 0; i < m->nsensor; ++i) {
    if (m->sensor_plugin[i] != instance) continue;
    if (sensor >= 0) {
      return who + "two sensors name it, allowed one per instance; make another instance";
    }
    sensor = i;
  }
  if (sensor < 0) {
    return who + "no sensor names it, allowed one; add <sensor><plugin objtype=\"joint\" .../>";
  }
  const int joint = m->sensor_objid[sensor];
  if (m->sensor_objtype[sensor] != mjOBJ_JOINT ||
      (m->jnt_type[joint] != mjJNT_HINGE && m->jnt_type[joint] != mjJNT_SLIDE)) {
    return who + "its sensor is not on a hinge or slide joint; write objtype=\"joint\" objname=\"...\"";
  }
  output_ = m->sensor_adr[sensor];
  qpos_ = m->jnt_qposadr[joint];
  dof_ = m->jnt_dofadr[joint];
  if (!live_.IsNeutral(kDelay, 0)) {
    capacity_ = History::Capacity(m->plugin_statenum[instance] - kSlots, 0);
  }
  return {};
}

void Encoder::Compute(const mjModel* m, mjData* d, int) const {
  if (inert_) return;
  double* slots = d->plugin_state + state_;
  Motion motion{d->qpos[qpos_], d->qvel[dof_]};
  if (capacity_ > 0) {
    History history(slots + kSlots, capacity_, 0);
    history.Open(d->time, motion.q, motion.qdot, nullptr);
    motion = history.MotionAt(std::min(live_(m, kDelay), max_delay_s_), d->time, motion, m->opt.timestep);
  }
  double angle = motion.q + live_(m, kOffset);
  if (const double resolution = live_(m, kResolution); resolution > 0) {
    angle = std::round(angle / resolution) * resolution;
  }

  // The drive differentiates its own readings; before there are two, it is taken to know the speed.
  double speed = motion.qdot;
  if (slots[kHasLast] != 0 && d->time > slots[kLastTime]) {
    const double step = d->time - slots[kLastTime], constant = live_(m, kTimeConstant);
    const double share = constant > 0 ? -std::expm1(-step / constant) : 1;
    speed = slots[kLastSpeed] + share * ((angle - slots[kLastAngle]) / step - slots[kLastSpeed]);
  }
  slots[kOpen] = 1;
  slots[kTime] = d->time;
  slots[kAngle] = angle;
  slots[kSpeed] = speed;
  d->sensordata[output_] = angle;
  if (velocity_) d->sensordata[output_ + 1] = speed;
}

void Encoder::Advance(const mjModel*, mjData* d) const {
  double* slots = d->plugin_state + state_;
  if (inert_ || slots[kOpen] == 0) return;
  slots[kOpen] = 0;
  slots[kHasLast] = 1;
  slots[kLastTime] = slots[kTime];
  slots[kLastAngle] = slots[kAngle];
  slots[kLastSpeed] = slots[kSpeed];
  if (capacity_ > 0) History(slots + kSlots, capacity_, 0).Close();
}

void RegisterEncoder() {
  static const std::vector<const char*> attributes =
      AttributesOf(Encoder::kSpecs, {"velocity", "max_delay_s", "min_timestep_s"});
  mjpPlugin plugin = PluginOf<Encoder>("gapscope.encoder", mjPLUGIN_SENSOR, attributes, Encoder::StateSize);
  plugin.needstage = mjSTAGE_VEL;
  plugin.nsensordata = +[](const mjModel* m, int instance, int) {
    bool velocity = false;
    Flag(ConfigText(m, instance, "velocity"), &velocity);
    return velocity ? 2 : 1;
  };
  mjp_registerPlugin(&plugin);
}

}  // namespace gapscope::plugins

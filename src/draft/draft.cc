#include "src/draft/draft.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "src/draft/loops.h"
#include "src/draft/parameter_text.h"
#include "src/draft/samples.h"
#include "src/draft/scaling.h"
#include "src/draft/servo_gains.h"
#include "src/draft/torque_scale.h"
#include "src/draft/yaml_text.h"
#include "src/draft/zeros.h"
#include "src/model/drive_facts.h"
#include "src/model/element_names.h"
#include "src/model/rig.h"

namespace gapscope {
namespace {

// Bodies with a free joint that carry other joints: robots, not things on a table.
std::vector<std::string> FloatingBases(const mjModel& m) {
  std::vector<std::string> names;
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] != mjJNT_FREE) continue;
    const int base = m.jnt_bodyid[j];
    bool carries = false;
    for (int k = 0; k < m.njnt; ++k)
      carries = carries || (k != j && m.body_rootid[m.jnt_bodyid[k]] == m.body_rootid[base]);
    const std::string body = NameOf(m, mjOBJ_BODY, base), joint = NameOf(m, mjOBJ_JOINT, j);
    if (carries && !(body + joint).empty()) names.push_back(body.empty() ? joint : body);
  }
  return names;
}

constexpr double kOpenLoop = 0.003;  // m or rad

// Whether rows of the two can be taken together.
bool AreAlike(const DraftLog& a, const DraftLog& b) {
  constexpr double kAsFast = 0.01;  // of a step
  const double step_s = a.timeline.median_step_s;
  return std::ranges::equal(a.log.columns, b.log.columns, {}, &Column::name, &Column::name) &&
         std::abs(b.timeline.median_step_s - step_s) <= kAsFast * step_s;
}

// Experiment files call joints and actuators by their names.
Status CheckNames(const mjModel& m) {
  int joints = 0, named = 0;
  for (int j = 0; j < m.njnt; ++j) {
    const bool pairs = m.jnt_type[j] == mjJNT_HINGE || m.jnt_type[j] == mjJNT_SLIDE;
    joints += pairs;
    named += pairs && !NameOf(m, mjOBJ_JOINT, j).empty();
  }
  if (joints == 0) {
    return Error{.what = "the model has no hinge or slide joint that columns could pair with",
                 .where = "",
                 .cure =
                     "of a free body write the experiment file by hand: 'measured' takes the pose of a 'body' "
                     "(docs/reference/experiment.md)"};
  }
  if (named == 0) {
    return Error{.what = "no hinge or slide joint of the model has a name",
                 .where = "",
                 .cure = "name them in the MJCF: <joint name=\"hip\" ...>"};
  }
  for (int a = 0; a < m.nactuator; ++a) {
    if (!NameOf(m, mjOBJ_ACTUATOR, a).empty()) continue;
    const int joint = m.actuator_trntype[a] == mjTRN_JOINT ? m.actuator_trnid[2 * a] : -1;
    const std::string on = joint < 0 ? "" : NameOf(m, mjOBJ_JOINT, joint);
    return Error{.what = "an actuator of the model has no name",
                 .where = "",
                 .actual = "actuator " + std::to_string(a) + (on.empty() ? "" : ", on joint '" + on + "'"),
                 .cure = "name all actuators in the MJCF: <motor name=\"" + (on.empty() ? "motor" : on) + "\" ...>"};
  }
  return Ok();
}

class Drafter {
 public:
  Drafter(const mjModel& model, std::span<const DraftLog> logs, const DraftOptions& options)
      : m_(model),
        logs_(logs),
        timeline_(logs.front().timeline),
        samples_(logs.front().log, timeline_),
        options_(options) {
    guesses_ = GuessColumns(logs.front().log, timeline_, samples_);
    p_ = PairColumns(model, samples_, &guesses_);
    s_ = ScaleColumns(model, samples_, guesses_, p_);
    FindZeros(model, samples_, guesses_, p_, &s_);
    FindTorqueScales(model, samples_, guesses_, p_, &s_);
    proposes_ = model.nactuator == 0 && !p_.actuators.empty();
    if (proposes_) FindGains();
  }

  Result<Draft> Write(const std::vector<std::string>& held) {
    draft_.joints = p_.joints.size();
    draft_.measured = static_cast<std::size_t>(
        std::ranges::count_if(p_.positions, [&](const Pick& pick) { return pick.column >= 0 && Moves(pick); }));
    if (draft_.measured == 0) {
      return Error{.what = "no column of the log pairs with a joint of the model",
                   .where = "",
                   .allowed = "an angle of at least one joint, which moves",
                   .cure = "name a column after its joint (\"" + p_.joints[0].name +
                           "_rad\"), or write the experiment file by hand (docs/reference/experiment.md)"};
    }
    draft_.head =
        "# Drafted by `gapscope init`. Check every line marked \"unsure\", then: gapscope replay THIS_FILE LOG\n"
        "schema: gapscope.experiment/1\n";
    std::string& y = draft_.body;
    y = "log:\n  time: {column: " + Quote(timeline_.time_column) + ", unit: " + timeline_.time_unit +
        "}  # median step " + Num(timeline_.median_step_s) + " s\n";
    for (const std::string& name : held) y += (y.ends_with("s\n") ? "hold: [" : ", ") + Quote(name);
    if (!held.empty()) y += "]" + Unsure("a floating base is held where the MJCF puts it, as on a stand") + "\n";
    if (LoopGap(m_, samples_, guesses_, p_, s_) > kOpenLoop)
      y += Unsure(
               "a loop that the MJCF closes is open at the log's first row: joints in it that are not measured "
               "start as the MJCF has them, and jump")
               .substr(2) +
           "\n";
    if (proposes_) y += "actuators:\n" + ActuatorText();
    if (const std::string commands = CommandText(); !commands.empty()) y += "commands:\n" + commands;
    y += "measured:\n";
    y += SignalText({"", "", "joint", "position"}, p_.joints, p_.positions, s_.positions);
    y += SignalText({"_speed", ", kind: velocity", "joint", "speed"}, p_.joints, p_.velocities, s_.velocities);
    y += SignalText({"_torque", ", kind: torque", "actuator", "torque"}, p_.actuators, p_.torques, s_.torques);
    y += NotUsedText() + ParameterText(m_, p_, gains_) + "replay: {mode: free_run, window_s: 1}\n";
    return std::move(draft_);
  }

 private:
  void FindGains() {
    if (options_.servo) {
      const ServoGains said{.kp = options_.servo->kp,
                            .kd = options_.servo->kd,
                            .limit = options_.servo->limit.value_or(0),
                            .armature = options_.servo->armature.value_or(0),
                            .from = "as --servo says",
                            .certain = true};
      gains_.assign(p_.actuators.size(), said);
    } else {
      std::vector<Samples> further;
      for (const DraftLog& other : logs_.subspan(1)) {
        if (AreAlike(logs_.front(), other)) further.emplace_back(other.log, other.timeline);
      }
      std::vector<const Samples*> all{&samples_};
      for (const Samples& samples : further) all.push_back(&samples);
      gains_ = FitServos(m_, all, guesses_, p_, s_);
    }
    for (std::size_t a = 0; a < gains_.size(); ++a) {
      if (p_.actuators[a].wants != Quantity::kAngle) gains_[a].kp = 0;
      if (p_.actuators[a].wants == Quantity::kTorque) gains_[a].kd = 0;
    }
    AddArmature(m_, p_, &gains_);
  }

  // A comment behind a line; the same sentence is told once.
  std::string Unsure(const std::string& text) {
    if (told_.insert(text).second) draft_.unsure.push_back(text);
    return "  # unsure: " + text;
  }

  const std::string& Name(const Pick& pick) const { return guesses_[pick.column].name; }

  // Of a column: what makes it doubtful that it is `what`, and what its scaling leaves open.
  std::string Doubt(const Pick& pick, const Scaling& scaling, const std::string& what) {
    std::string doubt;
    if (pick.by_order) {
      doubt = "no name fits " + LabelOf(Name(pick), guesses_[pick.column].said) +
              ": taken in the order of the file and of the model";
    } else if (!pick.certain) {
      doubt = "'" + Name(pick) + "' is taken for " + what + ": " + pick.why;
    }
    if (pick.runner_up >= 0 && !SameNumbers(pick.column, pick.runner_up)) {
      doubt += (doubt.empty() ? "'" + Name(pick) + "' is taken for " + what : std::string()) + ", not '" +
               guesses_[pick.runner_up].name + "'";
    }
    if (guesses_[pick.column].leads) {
      doubt += (doubt.empty() ? "" : "; ") + LabelOf(Name(pick), guesses_[pick.column].said) +
               " leads the angle: it is taken for the command, though no name says so";
    }
    std::string text = doubt.empty() ? "" : Unsure(doubt);
    if (scaling.doubt.empty()) return text;
    const std::string more = Unsure(scaling.doubt);
    return text.empty() ? more : text + "; " + scaling.doubt;
  }

  bool Moves(const Pick& pick) const { return samples_.spread(guesses_[pick.column].column) > 0; }
  bool SameNumbers(int a, int b) const {
    return samples_.values(guesses_[a].column) == samples_.values(guesses_[b].column);
  }

  static std::string ScalingText(const Scaling& scaling, const char* add) {
    std::string text = ", unit: " + Quote(scaling.unit);
    if (scaling.scale != 1) text += ", scale: " + Num(scaling.scale);
    if (scaling.add != 0) text += std::string(", ") + add + ": " + Num(scaling.add);
    return text;
  }

  std::string ActuatorText() {
    std::string text;
    for (std::size_t a = 0; a < gains_.size(); ++a) {
      const ActuatorSlot& slot = p_.actuators[a];
      const ServoGains& g = gains_[a];
      const char* kind = slot.wants == Quantity::kAngle   ? "position"
                         : slot.wants == Quantity::kSpeed ? "velocity"
                                                          : "torque";
      text += "  - {name: " + Quote(slot.name) + ", joint: " + Quote(p_.joints[slot.joint].name) + ", kind: " + kind;
      if (slot.wants == Quantity::kAngle) text += ", kp: " + Num(g.kp);
      if (slot.wants != Quantity::kTorque) text += ", kd: " + Num(g.kd);
      if (g.limit > 0) text += ", force_limit_n_m: " + Num(g.limit);
      if (g.armature > 0) text += ", armature_kg_m2: " + Num(g.armature);
      text += "}" + DoubtOfGains(slot, g) + "\n";
    }
    return text;
  }

  std::string DoubtOfGains(const ActuatorSlot& slot, const ServoGains& g) {
    std::string text;
    if (slot.wants != Quantity::kTorque) text = g.certain ? "  # " + g.from : Unsure(g.doubt);
    if (g.armature_made_up)
      text += Unsure("the MJCF has no armature: it is made up where a servo needs it to be stable");
    return text;
  }

  std::string CommandText() {
    std::string text;
    for (std::size_t a = 0; a < p_.actuators.size(); ++a) {
      const std::string& name = p_.actuators[a].name;
      const Pick& pick = p_.commands[a];
      text += "  - {actuator: " + Quote(name);
      if (pick.column < 0) {
        const std::string value = DefaultOf(p_.actuators[a]);
        std::string doubt = "no column looks like the command of actuator '";
        doubt += name;
        doubt += "': it gets ";
        doubt += value;
        text += ", default: \"" + value + "\"}" + Unsure(doubt) + "\n";
        continue;
      }
      ++draft_.commanded;
      text += ", column: " + Quote(Name(pick)) + ScalingText(s_.commands[a], "offset") + "}" +
              Doubt(pick, s_.commands[a], "the command of actuator '" + name + "'") + "\n";
    }
    return text;
  }

  // Without a column a drive is on, at a supply that is made up; other commands are zero.
  std::string DefaultOf(const ActuatorSlot& slot) const {
    if (slot.wants != Quantity::kOther) return "0";
    return FactsOf(m_, slot.actuator).enables ? "1" : "12";
  }

  // Lines of the measured signals of one kind: one for each of `names` that has a column.
  struct Measured {
    const char *ending, *kind, *site, *what;
  };
  template <class Names>
  std::string SignalText(const Measured& of, const Names& names, const std::vector<Pick>& picks,
                         const std::vector<Scaling>& scalings) {
    std::string text;
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::string& name = names[i].name;
      const Pick& pick = picks[i];
      if (pick.column < 0) continue;
      const bool angle = std::string_view(of.kind).empty();
      const char* more = !angle ? ", optional: true, score: false" : Moves(pick) ? "" : ", score: false";
      text += "  - {signal: " + Quote(name + of.ending) + of.kind + ", column: " + Quote(Name(pick)) + ", " + of.site +
              ": " + Quote(name) + ScalingText(scalings[i], "add") + more + "}" +
              Doubt(pick, scalings[i], std::string("the ") + of.what + " of " + of.site + " '" + name + "'") + "\n";
    }
    return text;
  }

  // A comment that names the columns without a place, so that one sees what was overlooked.
  std::string NotUsedText() const {
    constexpr std::size_t kMost = 12;
    std::vector<std::string> labels;
    std::map<std::string, std::vector<std::string>> families;
    for (const Guess& guess : guesses_) {
      if (guess.is_time || guess.used) continue;
      const std::string label = LabelOf(guess.name, guess.said);
      if (families[label].empty()) labels.push_back(label);
      families[label].push_back(guess.name);
    }
    for (std::string& label : labels) {
      if (families[label].size() == 1) label = "'" + families[label].front() + "'";
    }
    std::string text;
    for (std::size_t i = 0; i < std::min(labels.size(), kMost); ++i) text += (i > 0 ? ", " : "") + labels[i];
    if (labels.size() > kMost) text += " and " + std::to_string(labels.size() - kMost) + " more";
    std::ranges::replace_if(text, [](unsigned char c) { return std::iscntrl(c) != 0; }, ' ');
    return text.empty() ? "" : "# Columns without a place here: " + text + "\n";
  }

  const mjModel& m_;
  std::span<const DraftLog> logs_;
  const Timeline& timeline_;
  const Samples samples_;
  const DraftOptions& options_;
  std::vector<Guess> guesses_;
  Pairing p_;
  Scalings s_;
  bool proposes_ = false;
  std::vector<ServoGains> gains_;  // of the proposed actuators
  std::set<std::string> told_;
  Draft draft_;
};

}  // namespace

std::string Draft::Yaml(const std::string& model_text) const {
  return head + "model: " + Quote(model_text) + "\n" + body;
}

Result<Draft> DraftExperiment(const std::string& model_path, std::span<const DraftLog> logs,
                              const DraftOptions& options) {
  Experiment experiment;
  experiment.model_path = model_path;
  GS_ASSIGN(std::shared_ptr<const Rig> rig, Rig::Load(experiment));
  const std::vector<std::string> held = FloatingBases(rig->compiled());
  for (const std::string& name : held) experiment.hold.push_back({.name = name});
  if (!held.empty()) {
    GS_ASSIGN(rig, Rig::Load(experiment));
  }
  if (options.servo && rig->compiled().nactuator > 0) {
    return Error{.what = "--servo says the gains of actuators that the draft adds, but the MJCF has its own",
                 .where = model_path,
                 .cure = "leave --servo out; their gains stand under 'parameters:'"};
  }
  const auto at_model = [&](Error error) {
    error.where = model_path;
    return error;
  };
  if (const Status named = CheckNames(rig->compiled()); !named.ok()) return at_model(named.error());
  Result<Draft> draft = Drafter(rig->compiled(), logs, options).Write(held);
  return draft.ok() ? draft : at_model(draft.error());
}

}  // namespace gapscope

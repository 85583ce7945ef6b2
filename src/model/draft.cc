#include "src/model/draft.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <optional>
#include <set>

#include "src/core/mujoco_handles.h"
#include "src/core/statistics.h"
#include "src/core/units.h"
#include "src/model/drive_facts.h"

namespace gapscope {
namespace {

enum class Role { kUnknown, kTime, kCommand, kPosition, kVelocity, kTorque };

// A column and what it seems to be.
struct Guess {
  const Column* column = nullptr;
  Role role = Role::kUnknown;
  std::string unit;
  bool unit_stated = false;
  bool used = false;
};

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The words of a name: "q_cmd[0]", "ArmAngle.deg" -> {q, cmd, 0}, {arm, angle, deg}.
std::vector<std::string> Words(const std::string& name) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const unsigned char c = static_cast<unsigned char>(name[i]);
    const bool hump = std::isupper(c) && i > 0 && std::islower(static_cast<unsigned char>(name[i - 1]));
    if (!std::isalnum(c) || hump) words.emplace_back();
    if (std::isalnum(c)) words.back() += static_cast<char>(std::tolower(c));
  }
  std::erase(words, "");
  return words;
}

bool HasAny(const std::vector<std::string>& words, std::initializer_list<const char*> candidates) {
  return std::any_of(words.begin(), words.end(), [&](const std::string& w) {
    return std::find(candidates.begin(), candidates.end(), w) != candidates.end();
  });
}

// How much a name speaks of an element: the share of the element's words that the name holds.
double NameMatch(const std::string& name, const std::string& element) {
  const auto words = Words(name), wanted = Words(element);
  if (wanted.empty()) return 0;
  double hits = 0;
  for (const auto& w : wanted) {
    if (std::find(words.begin(), words.end(), w) != words.end())
      hits += 1;
    else if (Lower(name).find(w) != std::string::npos && w.size() > 2)
      hits += 0.8;
  }
  return hits / static_cast<double>(wanted.size());
}

Guess Classify(const Column& column, const std::string& time_column) {
  Guess guess{.column = &column};
  const auto words = Words(column.name);
  if (column.name == time_column) {
    guess.role = Role::kTime;
    return guess;
  }
  const bool velocity =
      HasAny(words, {"vel", "velocity", "speed", "dot", "dq", "qd", "qdot", "w", "omega", "rate", "dtheta"});
  const bool torque = HasAny(words, {"torque", "tau", "effort", "trq"});
  const bool command =
      HasAny(words, {"cmd", "command", "target", "des", "desired", "ref", "reference", "goal", "setpoint", "ctrl",
                     "control", "action", "input", "u", "voltage", "sp", "feedforward"});
  const bool position = HasAny(words, {"pos", "position", "angle", "q", "theta", "alpha", "rad", "deg", "encoder",
                                       "meas", "measured", "actual", "joint"});
  if (command)
    guess.role = Role::kCommand;
  else if (torque)
    guess.role = Role::kTorque;
  else if (velocity)
    guess.role = Role::kVelocity;
  else if (position)
    guess.role = Role::kPosition;
  // Units: as stated, by the name's last words, or by what is usual.
  if (const auto stated = ParseUnit(column.unit); !column.unit.empty() && stated.ok()) {
    guess.unit = column.unit;
    guess.unit_stated = true;
  } else {
    for (const auto& [word, unit] : {std::pair{"deg", "deg"},
                                     {"rpm", "rpm"},
                                     {"rad", "rad"},
                                     {"v", "V"},
                                     {"mv", "mV"},
                                     {"a", "A"},
                                     {"ma", "mA"},
                                     {"nm", "N m"},
                                     {"volt", "V"},
                                     {"volts", "V"},
                                     {"voltage", "V"},
                                     {"current", "A"},
                                     {"amps", "A"}}) {
      if (!HasAny(words, {word})) continue;
      guess.unit = unit;
      guess.unit_stated = true;
    }
    if (guess.role == Role::kVelocity && (guess.unit == "rad" || guess.unit == "deg")) guess.unit += "/s";
    if (HasAny(words, {"n"}) && HasAny(words, {"m"})) guess.unit = "N m", guess.unit_stated = true;
  }
  return guess;
}

double Correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double ma = 0, mb = 0, n = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (std::isfinite(a[i]) && std::isfinite(b[i])) ma += a[i], mb += b[i], n += 1;
  }
  if (n < 3) return 0;
  ma /= n, mb /= n;
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (std::isfinite(a[i]) && std::isfinite(b[i]))
      aa += (a[i] - ma) * (a[i] - ma), bb += (b[i] - mb) * (b[i] - mb), ab += (a[i] - ma) * (b[i] - mb);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

std::vector<double> Derivative(const std::vector<double>& y) {
  std::vector<double> d(y.size(), 0.0);
  for (std::size_t i = 1; i + 1 < y.size(); ++i) d[i] = y[i + 1] - y[i - 1];
  return d;
}

double Spread(const std::vector<double>& y) {
  double low = kInfinity, high = -kInfinity;
  for (const double v : y) {
    if (std::isfinite(v)) low = std::min(low, v), high = std::max(high, v);
  }
  return high > low ? high - low : 0;
}

std::string Num(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

// Quoted where YAML needs it.
std::string Quote(const std::string& text) {
  const bool plain = !text.empty() &&
                     std::all_of(text.begin(), text.end(),
                                 [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '/' || c == '-'; }) &&
                     !std::isdigit(static_cast<unsigned char>(text[0])) && text[0] != '-';
  if (plain) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

class Drafter {
 public:
  Drafter(const mjModel& model, const std::string& model_text, const Log& log, const Timeline& timeline)
      : m_(model), model_text_(model_text), timeline_(timeline) {
    for (const Column& column : log.columns) {
      guesses_.push_back(Classify(column, timeline.time_column));
      if (Spread(column.values) == 0) guesses_.back().used = true;  // a constant column says nothing
    }
  }

  Result<Draft> Write() {
    yaml_ = "# Drafted by `gapscope init`. Check every line marked \"unsure\", then: gapscope replay THIS_FILE LOG\n";
    yaml_ += "schema: gapscope.experiment/1\nmodel: " + Quote(model_text_) +
             "\nlog:\n  time: {column: " + Quote(timeline_.time_column) + ", unit: " + timeline_.time_unit +
             "}  # median step " + Num(timeline_.median_step_s) + " s\n";
    std::string measured = WriteMeasured();
    if (measured.empty()) {
      return Error{.what = "no column of the log pairs with a joint of the model",
                   .where = model_text_,
                   .cure = "name a column after its joint (\"" + JointName(0) +
                           "_rad\"), or write the experiment file by hand (docs/experiment.md)"};
    }
    yaml_ += "commands:\n" + WriteCommands() + "measured:\n" + measured;
    WriteParameters();
    yaml_ += "replay: {mode: free_run, window_s: 1}\n";
    return Draft{.yaml = std::move(yaml_), .unsure = std::move(unsure_)};
  }

 private:
  std::string JointName(int joint) const {
    const char* name = mj_id2name(&m_, mjOBJ_JOINT, joint);
    return name ? name : "";
  }
  bool IsScalar(int joint) const {
    return (m_.jnt_type[joint] == mjJNT_HINGE || m_.jnt_type[joint] == mjJNT_SLIDE) && !JointName(joint).empty();
  }

  std::string Unsure(const std::string& text) {
    unsure_.push_back(text);
    return "  # unsure: " + text;
  }

  // The unused column of a role that speaks most of `element`; with one candidate left, that one.
  Guess* BestByName(Role role, const std::string& element, bool* certain) {
    Guess* best = nullptr;
    double score = 0;
    int candidates = 0;
    for (Guess& guess : guesses_) {
      if (guess.used || guess.role != role) continue;
      ++candidates;
      const double match = NameMatch(guess.column->name, element);
      if (!best || match > score) best = &guess, score = match;
    }
    *certain = score >= 0.99;
    return score >= 0.5 || candidates == 1 ? best : nullptr;
  }

  Guess* BestByCorrelation(Role role, const std::vector<double>& with) {
    Guess* best = nullptr;
    double score = 0.3;
    for (Guess& guess : guesses_) {
      if (guess.used || guess.role != role) continue;
      const double match = std::abs(Correlation(guess.column->values, with));
      if (match > score) best = &guess, score = match;
    }
    return best;
  }

  // The column's own unit where it is one of `usual`'s kind ("1": any), else `usual`, with a doubt.
  std::string UnitOf(const Guess& guess, const char* usual, std::string* doubt) {
    const auto stated = ParseUnit(guess.unit);
    const bool known = !guess.unit.empty() && guess.unit_stated && stated.ok();
    const bool any = std::string(usual) == "1";
    if (known && (any || stated.value().si == ParseUnit(usual).value().si)) return guess.unit;
    const bool degrees = std::string(usual) == "rad" && Spread(guess.column->values) > 13;
    *doubt += std::string(doubt->empty() ? "" : "; ") +
              (known ? "unit '" + guess.unit + "' of '" + guess.column->name + "' does not fit"
                     : "unit of '" + guess.column->name + "' is not stated");
    return degrees ? "deg" : usual;
  }

  // The velocity column of each joint: the best pair of a column and a joint's derivative first, whatever the joints'
  // order; a name that fits decides.
  std::vector<Guess*> PairVelocities(std::vector<bool>* by_correlation) {
    constexpr double kFollows = 0.3;
    std::vector<Guess*> speeds(m_.njnt, nullptr);
    by_correlation->assign(m_.njnt, false);
    while (true) {
      Guess* best = nullptr;
      int joint = -1;
      double score = kFollows;
      for (int j = 0; j < m_.njnt; ++j) {
        if (!positions_[j] || speeds[j]) continue;
        const std::vector<double> slope = Derivative(positions_[j]->values);
        for (Guess& guess : guesses_) {
          if (guess.used || guess.role != Role::kVelocity) continue;
          const double follows = std::abs(Correlation(guess.column->values, slope));
          const double match =
              follows + (follows > kFollows && NameMatch(guess.column->name, JointName(j)) >= 0.99 ? 1 : 0);
          if (match > score) best = &guess, joint = j, score = match;
        }
      }
      if (!best) break;
      best->used = true;
      speeds[joint] = best;
      (*by_correlation)[joint] = true;
    }
    for (int j = 0; j < m_.njnt; ++j) {
      bool certain = false;
      if (!positions_[j] || speeds[j]) continue;
      if (Guess* named = BestByName(Role::kVelocity, JointName(j), &certain)) {
        named->used = true;
        speeds[j] = named;
      }
    }
    return speeds;
  }

  std::string WriteMeasured() {
    std::string text;
    positions_.assign(m_.njnt, nullptr);
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < m_.njnt; ++j) {
        if (!IsScalar(j) || positions_[j]) continue;
        bool certain = false;
        Guess* found = BestByName(Role::kPosition, JointName(j), &certain);
        // First pass: only what the names say; second: what is left, in order.
        if (pass == 0 && !certain) continue;
        if (!found && pass == 1) {
          for (Guess& guess : guesses_) {
            if (!guess.used && (guess.role == Role::kPosition || guess.role == Role::kUnknown) && !found)
              found = &guess;
          }
        }
        if (!found) continue;
        found->used = true;
        positions_[j] = found->column;
        std::string doubt =
            certain ? "" : "'" + found->column->name + "' is taken for the position of joint '" + JointName(j) + "'";
        const bool slide = m_.jnt_type[j] == mjJNT_SLIDE;
        const std::string unit = UnitOf(*found, slide ? "m" : "rad", &doubt);
        text += "  - {signal: " + Quote(JointName(j)) + ", column: " + Quote(found->column->name) +
                ", joint: " + Quote(JointName(j)) + ", unit: " + unit + "}" + (doubt.empty() ? "" : Unsure(doubt)) +
                "\n";
      }
    }
    std::vector<bool> by_correlation;
    const std::vector<Guess*> speeds = PairVelocities(&by_correlation);
    for (int j = 0; j < m_.njnt; ++j) {
      if (!speeds[j]) continue;
      Guess* speed = speeds[j];
      std::string doubt = by_correlation[j] ? ""
                                            : "'" + speed->column->name + "' does not follow the derivative of '" +
                                                  positions_[j]->name + "'";
      const std::string unit = UnitOf(*speed, m_.jnt_type[j] == mjJNT_SLIDE ? "m/s" : "rad/s", &doubt);
      text += "  - {signal: " + Quote(JointName(j) + "_speed") +
              ", kind: velocity, column: " + Quote(speed->column->name) + ", joint: " + Quote(JointName(j)) +
              ", unit: " + unit + ", optional: true, score: false}" + (doubt.empty() ? "" : Unsure(doubt)) + "\n";
    }
    for (int a = 0; a < m_.nactuator; ++a) {
      const char* name = mj_id2name(&m_, mjOBJ_ACTUATOR, a);
      bool certain = false;
      Guess* torque = name ? BestByName(Role::kTorque, name, &certain) : nullptr;
      if (!torque) continue;
      torque->used = true;
      std::string doubt =
          certain ? "" : "'" + torque->column->name + "' is taken for the torque of actuator '" + name + "'";
      text += "  - {signal: " + Quote(std::string(name) + "_torque") +
              ", kind: torque, column: " + Quote(torque->column->name) + ", actuator: " + Quote(name) +
              ", unit: " + UnitOf(*torque, "N m", &doubt) + ", optional: true, score: false}" +
              (doubt.empty() ? "" : Unsure(doubt)) + "\n";
    }
    return text;
  }

  std::string WriteCommands() {
    std::string text;
    for (int a = 0; a < m_.nactuator; ++a) {
      const char* name = mj_id2name(&m_, mjOBJ_ACTUATOR, a);
      if (!name) continue;
      const int joint = m_.actuator_trntype[a] == mjTRN_JOINT ? m_.actuator_trnid[2 * a] : -1;
      const bool servo = FactsOf(m_, a).feeds_back_position;
      bool certain = false;
      Guess* found = BestByName(Role::kCommand, name, &certain);
      if (!certain && joint >= 0) {
        if (Guess* by_joint = BestByName(Role::kCommand, JointName(joint), &certain)) found = by_joint;
      }
      if (!certain && servo && joint >= 0 && positions_[joint]) {
        if (Guess* follows = BestByCorrelation(Role::kCommand, positions_[joint]->values))
          found = follows, certain = true;
      }
      if (!found) {
        text += "  - {actuator: " + Quote(name) + ", default: \"0\"}" +
                Unsure("no column looks like the command of actuator '" + std::string(name) + "': it gets 0") + "\n";
        continue;
      }
      found->used = true;
      std::string doubt =
          certain ? "" : "'" + found->column->name + "' is taken for the command of actuator '" + name + "'";
      const std::string unit = servo ? UnitOf(*found, "rad", &doubt) : UnitOf(*found, "1", &doubt);
      text += "  - {actuator: " + Quote(name) + ", column: " + Quote(found->column->name) + ", unit: " + Quote(unit) +
              "}" + (doubt.empty() ? "" : Unsure(doubt)) + "\n";
    }
    return text;
  }

  // A name that expressions can use, and no other parameter has.
  std::string ParameterName(std::string name) {
    for (char& c : name) {
      const bool good =
          (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
      if (!good) c = '_';
    }
    if (name.empty() || name[0] == '.' || (name[0] >= '0' && name[0] <= '9')) name.insert(0, "_");
    while (!names_.insert(name).second) name += "_";
    return name;
  }

  struct Proposal {
    std::string element, unit;
    double nominal, low, high;
    std::string field, comment;
  };

  void Propose(const Proposal& proposal) {
    const auto& [element, unit, nominal, low, high, field, comment] = proposal;
    const std::string name = ParameterName(element);
    parameters_ += "  " + Quote(name) + ": {unit: " + Quote(unit) + ", nominal: " + Num(nominal) + ", bounds: [" +
                   Num(low) + ", " + Num(high) + "]}" + (comment.empty() ? "" : "  # " + comment) + "\n";
    set_ += "  " + Quote(field) + ": " + Quote(name) + "\n";
  }

  void WriteParameters() {
    for (int j = 0; j < m_.njnt; ++j) {
      if (!IsScalar(j)) continue;
      const int dof = m_.jnt_dofadr[j];
      const std::string name = JointName(j), unit = m_.jnt_type[j] == mjJNT_HINGE ? "N m" : "N";
      const double inertia = m_.dof_M0[dof], damping = m_.dof_damping[dof];
      // Without a value to start from: a damping that stops the joint within about ten seconds.
      const double scale = damping > 0 ? damping : 0.1 * inertia;
      Propose({name + ".damping", unit + " s/rad", damping, 0, 20 * scale, "joint/" + name + "/damping",
               damping > 0 ? "" : "the MJCF has none; the upper bound follows from the inertia"});
      Propose({name + ".armature", "kg m^2", m_.dof_armature[dof], 0, std::max(5 * m_.dof_armature[dof], inertia),
               "joint/" + name + "/armature", ""});
      if (m_.jnt_stiffness[j] > 0)
        Propose({name + ".stiffness", unit + "/rad", m_.jnt_stiffness[j], 0.2 * m_.jnt_stiffness[j],
                 5 * m_.jnt_stiffness[j], "joint/" + name + "/stiffness", ""});
      if (m_.dof_frictionloss[dof] > 0)
        Propose({name + ".frictionloss", unit, m_.dof_frictionloss[dof], 0, 10 * m_.dof_frictionloss[dof],
                 "joint/" + name + "/frictionloss", ""});
    }
    for (int a = 0; a < m_.nactuator; ++a) {
      const char* name = mj_id2name(&m_, mjOBJ_ACTUATOR, a);
      if (!name || m_.actuator_plugin[a] >= 0 || m_.actuator_gaintype[a] != mjGAIN_FIXED) continue;
      const double gain = m_.actuator_gainprm[a * mjNGAIN], b1 = m_.actuator_biasprm[a * mjNBIAS + 1],
                   b2 = m_.actuator_biasprm[a * mjNBIAS + 2];
      const std::string base = name, field = "actuator/" + base;
      if (gain > 0 && b1 == -gain)
        Propose({base + ".kp", "N m/rad", gain, 0.5 * gain, 2 * gain, field + "/kp", ""});
      else if (gain > 0)
        Propose({base + ".gain", "N m per unit of command", gain, 0.5 * gain, 2 * gain, field + "/gain", ""});
      if (b2 < 0) Propose({base + ".kv", "N m s/rad", -b2, -0.3 * b2, -3 * b2, field + "/kv", ""});
    }
    if (!parameters_.empty()) yaml_ += "parameters:\n" + parameters_ + "set:\n" + set_;
  }

  const mjModel& m_;
  std::string model_text_;
  const Timeline& timeline_;
  std::vector<Guess> guesses_;
  std::vector<const Column*> positions_;  // per joint
  std::vector<std::string> unsure_;
  std::string yaml_, parameters_, set_;
  std::set<std::string> names_;  // of parameters
};

}  // namespace

Result<Draft> DraftExperiment(const std::string& model_path, const std::string& model_text, const Log& log,
                              const Timeline& timeline) {
  char message[1024] = "";
  const ModelPtr model(mj_loadXML(model_path.c_str(), nullptr, message, sizeof message));
  if (!model) {
    std::string text = message;
    std::replace(text.begin(), text.end(), '\n', ' ');
    return Error{.what = "cannot read the MJCF: " + text, .where = model_path};
  }
  return Drafter(*model, model_text, log, timeline).Write();
}

}  // namespace gapscope

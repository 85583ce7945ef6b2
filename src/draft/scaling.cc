#include "src/draft/scaling.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "src/core/statistics.h"
#include "src/core/units.h"
#include "src/model/drive_facts.h"

namespace gapscope {
namespace {

constexpr double kTwoTurns_rad = 13;   // an angle that goes further, and fast, is hardly in radians
constexpr double kAgree = 0.08;        // a regression gives a unit when it is this near to it
constexpr double kServoAgrees = 0.25;  // and between a servo's target and its angle, which droops
constexpr double kClear = 0.8;         // correlation from which a regression speaks
constexpr double kIsLinear = 0.97;     // and from which a target that is in no unit of an angle is a linear map of it
constexpr double kFast_rad_per_s = 30;
constexpr double kLeastGain = 0.3, kLargestGain = 1.5;  // of an angle over its target, where a servo is between them

std::string CountsUnit(int per_turn) { return "counts/" + std::to_string(per_turn); }

// `whole`: counts too.
std::vector<std::string> AngleUnits(bool whole = true) {
  std::vector<std::string> units = {"rad", "deg", "mrad", "rev"};
  for (int n = 512; whole && n <= 1 << 20; n *= 2) units.push_back(CountsUnit(n));
  return units;
}
const std::vector<std::string> kSpeedUnits = {"rad/s", "deg/s", "rpm", "rev/s"}, kTravelSpeedUnits = {"m/s"};

double FactorOf(const std::string& unit) {
  const auto parsed = ParseUnit(unit);
  return parsed.ok() ? parsed.value().factor : 1;
}

// The unit whose factor is within `tolerance` of the size of `factor`.
std::optional<std::string> Snap(double factor, const std::vector<std::string>& units, double tolerance) {
  for (const std::string& unit : units) {
    if (std::abs(std::abs(factor) / FactorOf(unit) - 1) < tolerance) return unit;
  }
  return std::nullopt;
}

std::string LabelOf(const Guess& guess) { return LabelOf(guess.name, guess.said); }

std::string DoesNotFit(const std::string& unit, const Guess& guess, const std::string& usual) {
  std::string text = "the unit '";
  text += unit + "' of '" + guess.name + "' does not fit: " + usual + " is taken";
  return text;
}

std::string NotStated(const Guess& guess, const std::string& taken) {
  return "the unit of " + LabelOf(guess) + " is not stated: " + taken;
}

Scaling Of(const std::string& unit, bool certain, const std::string& doubt) {
  return {.unit = unit, .scale = 1, .add = 0, .factor = FactorOf(unit), .certain = certain, .doubt = doubt};
}

double MostCommon(const std::vector<double>& values) {
  const auto count = [&](double v) { return std::ranges::count(values, v); };
  return *std::ranges::max_element(values, {}, count);
}

class Scaler {
 public:
  Scaler(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing)
      : m_(model), samples_(samples), guesses_(guesses), p_(pairing) {}

  Scalings Run() {
    for (std::size_t j = 0; j < p_.joints.size(); ++j) scalings_.positions.push_back(Stated(p_.positions[j], Usual(j)));
    AnglesByTheirNeighbours();
    AnglesByFamily();
    for (std::size_t j = 0; j < p_.joints.size(); ++j) scalings_.velocities.push_back(Velocity(j));
    for (const bool slides : {false, true}) {
      const auto families =
          FamiliesOf(p_.velocities, guesses_, [&](std::size_t j) { return p_.joints[j].slide == slides; });
      ScalesOfFamily(families, p_.velocities, &scalings_.velocities);
    }
    for (std::size_t a = 0; a < p_.actuators.size(); ++a) {
      scalings_.commands.push_back(Command(a));
      scalings_.torques.push_back(Torque(p_.torques[a]));
    }
    const auto has_target = [&](std::size_t a) {
      const int joint = p_.actuators[a].joint;
      return p_.actuators[a].wants == Quantity::kAngle && joint >= 0 && !p_.joints[joint].slide;
    };
    ScalesOfFamily(FamiliesOf(p_.commands, guesses_, has_target), p_.commands, &scalings_.commands);
    return std::move(scalings_);
  }

 private:
  const Guess* GuessOf(const Pick& pick) const { return pick.column < 0 ? nullptr : &guesses_[pick.column]; }
  std::string Usual(std::size_t joint) const { return p_.joints[joint].slide ? "m" : "rad"; }

  // What the file or the name states, if it is a unit of the `usual` kind ("1": of any). Otherwise not certain.
  Scaling Stated(const Pick& pick, const std::string& usual) const {
    const Guess* guess = GuessOf(pick);
    if (!guess) return Of(usual, true, "");
    for (const std::string& unit : {guess->file_unit, guess->said.unit}) {
      const auto parsed = ParseUnit(unit);
      if (unit.empty() || !parsed.ok()) continue;
      if (usual == "1" || parsed.value().si == ParseUnit(usual).value().si) return Of(unit, true, "");
      return Of(usual, false, DoesNotFit(unit, *guess, usual));
    }
    return Of(usual, false, "");
  }

  // An angle whose unit is not stated, beside a speed or a target whose unit is.
  void AnglesByTheirNeighbours() {
    for (std::size_t j = 0; j < p_.joints.size(); ++j) {
      const Guess* angle = GuessOf(p_.positions[j]);
      Scaling& scaling = scalings_.positions[j];
      if (!angle || scaling.certain || p_.joints[j].slide) continue;
      if (const auto unit = BySpeed(*angle, j)) scaling = Of(*unit, true, "");
      if (const auto unit = scaling.certain ? std::nullopt : ByTarget(*angle, j)) scaling = Of(*unit, true, "");
    }
  }

  std::optional<std::string> BySpeed(const Guess& angle, std::size_t joint) const {
    const Guess* speed = GuessOf(p_.velocities[joint]);
    const Scaling stated = Stated(p_.velocities[joint], "rad/s");
    if (!speed || !stated.certain) return std::nullopt;
    const FittedLine line = LineThrough(samples_.slopes(angle.column), samples_.values(speed->column));
    if (std::abs(line.correlation) < kClear) return std::nullopt;
    return Snap(line.slope * stated.factor, AngleUnits(), kAgree);
  }

  std::optional<std::string> ByTarget(const Guess& angle, std::size_t joint) const {
    for (std::size_t a = 0; a < p_.actuators.size(); ++a) {
      const Guess* target = GuessOf(p_.commands[a]);
      const bool servo = p_.actuators[a].joint == static_cast<int>(joint) && p_.actuators[a].wants == Quantity::kAngle;
      const Scaling stated = Stated(p_.commands[a], "rad");
      if (!target || !servo || !stated.certain) continue;
      const FittedLine line = LineThrough(samples_.values(target->column), samples_.values(angle.column));
      if (std::abs(line.correlation) < kClear) continue;
      return Snap(stated.factor / line.slope, AngleUnits(samples_.whole_numbers(angle.column)), kServoAgrees);
    }
    return std::nullopt;
  }

  // What is left: a family has the unit of one member that is certain, else one that suits all of them.
  void AnglesByFamily() {
    for (const auto& [family, joints] :
         FamiliesOf(p_.positions, guesses_, [&](std::size_t j) { return !p_.joints[j].slide; })) {
      const auto sure = std::ranges::find_if(joints, [&](std::size_t j) { return scalings_.positions[j].certain; });
      std::string unit = sure != joints.end() ? scalings_.positions[*sure].unit : UnitByRange(joints);
      for (const std::size_t j : joints) {
        Scaling& scaling = scalings_.positions[j];
        if (scaling.certain) continue;
        const Guess& guess = *GuessOf(p_.positions[j]);
        const std::string doubt = scaling.doubt.empty() ? NotStated(guess, unit + " is taken") : scaling.doubt;
        scaling = Of(unit, sure != joints.end(), sure != joints.end() ? "" : doubt);
      }
    }
    for (std::size_t j = 0; j < p_.joints.size(); ++j) {
      const Guess* guess = GuessOf(p_.positions[j]);
      Scaling& scaling = scalings_.positions[j];
      if (guess && p_.joints[j].slide && !scaling.certain && scaling.doubt.empty())
        scaling.doubt = NotStated(*guess, "m is taken");
    }
  }

  // Radians, unless a joint would then leave its range, or turn more than twice and fast.
  std::string UnitByRange(const std::vector<std::size_t>& joints) const {
    const auto fits = [&](const std::string& unit) {
      return std::ranges::all_of(joints, [&](std::size_t j) {
        const int joint = p_.joints[j].joint;
        const double moved = FactorOf(unit) * samples_.spread(GuessOf(p_.positions[j])->column);
        const double width = m_.jnt_range[2 * joint + 1] - m_.jnt_range[2 * joint];
        const double speed = FactorOf(unit) * FastOf(GuessOf(p_.positions[j])->column);
        if (m_.jnt_limited[joint]) return moved < 1.1 * width + 0.1;
        return moved < kTwoTurns_rad || (speed < kFast_rad_per_s && moved < 10 * kTwoTurns_rad);
      });
    };
    const bool whole = std::ranges::all_of(
        joints, [&](std::size_t j) { return samples_.whole_numbers(GuessOf(p_.positions[j])->column); });
    std::vector<std::string> units = {"rad", "deg", "mrad"};
    if (whole) units = {"rad", CountsUnit(4096), CountsUnit(16384), CountsUnit(65536), CountsUnit(1 << 20)};
    const auto found = std::ranges::find_if(units, fits);
    return found == units.end() ? "rad" : *found;
  }

  double FastOf(int column) const {
    std::vector<double> speeds;
    for (const double v : samples_.slopes(column)) {
      if (std::isfinite(v)) speeds.push_back(std::abs(v));
    }
    return speeds.empty() ? 0 : Quantile(std::move(speeds), 0.99);
  }

  Scaling Velocity(std::size_t j) const {
    const Guess *speed = GuessOf(p_.velocities[j]), *angle = GuessOf(p_.positions[j]);
    const std::string usual = p_.joints[j].slide ? "m/s" : "rad/s";
    Scaling scaling = Stated(p_.velocities[j], usual);
    if (!speed || !angle) return scaling;
    const FittedLine line = LineThrough(samples_.slopes(angle->column), samples_.values(speed->column));
    if (std::abs(line.correlation) < kClear) {
      if (!scaling.certain && scaling.doubt.empty()) scaling.doubt = NotStated(*speed, usual + " is taken");
      return scaling;
    }
    const double factor = scalings_.positions[j].factor / line.slope;
    if (!scaling.certain) scaling = SpeedByAngle(*speed, j, factor, usual);
    if (factor < 0) {
      scaling.scale = -std::abs(scaling.scale);
      scaling.factor = -std::abs(scaling.factor);
      scaling.doubt += std::string(scaling.doubt.empty() ? "" : "; ") + "'" + speed->name +
                       "' has the other sign than the derivative of '" + angle->name + "'";
    }
    return scaling;
  }

  Scaling SpeedByAngle(const Guess& speed, std::size_t j, double factor, const std::string& usual) const {
    if (const auto unit = Snap(factor, p_.joints[j].slide ? kTravelSpeedUnits : kSpeedUnits, 2 * kAgree)) {
      Scaling scaling = Of(*unit, scalings_.positions[j].certain, "");  // a doubt of the angle's is told there
      scaling.by_data = scaling.is_unit = true;
      return scaling;
    }
    Scaling scaling = Of(usual, false, "the scale of " + LabelOf(speed) + " is that of the angle's derivative");
    scaling.scale = scaling.factor = std::abs(factor);
    scaling.by_data = true;
    return scaling;
  }

  Scaling Command(std::size_t a) const {
    const Guess* command = GuessOf(p_.commands[a]);
    const int joint = p_.actuators[a].joint;
    const bool servo = p_.actuators[a].wants == Quantity::kAngle;
    const bool slide = joint >= 0 && p_.joints[joint].slide;
    const std::string usual = UsualCommand(a, slide);
    Scaling scaling = Stated(p_.commands[a], usual);
    if (!command) return scaling;
    if (servo && joint >= 0 && !slide) return Target(*command, joint, scaling);
    if (p_.actuators[a].wants == Quantity::kOther && FactsOf(m_, p_.actuators[a].actuator).enables) return scaling;
    if (!scaling.certain && scaling.doubt.empty()) {
      scaling.doubt = NotStated(*command, usual == "1" ? "it is taken as it stands" : usual + " is taken");
    }
    return scaling;
  }

  std::string UsualCommand(std::size_t a, bool slide) const {
    const Guess* command = GuessOf(p_.commands[a]);
    const bool on_joint = p_.actuators[a].joint >= 0;  // not on a tendon or a site
    switch (p_.actuators[a].wants) {
      case Quantity::kAngle:
        return !on_joint ? "1" : slide ? "m" : "rad";
      case Quantity::kSpeed:
        return !on_joint ? "1" : slide ? "m/s" : "rad/s";
      case Quantity::kTorque:
        return command && command->said.quantity == Quantity::kTorque ? slide ? "N" : "N m" : "1";
      default:
        return "1";
    }
  }

  // A servo's command against the angle that follows it.
  Scaling Target(const Guess& command, int joint, Scaling scaling) const {
    const Guess* angle = GuessOf(p_.positions[joint]);
    const FittedLine line =
        angle ? LineThrough(samples_.values(command.column), samples_.values(angle->column)) : FittedLine{};
    const bool clear = std::abs(line.correlation) > kClear;
    const Scaling& of_angle = scalings_.positions[joint];
    const double factor = of_angle.factor * line.slope;
    if (!scaling.certain) {
      const auto unit = clear ? TargetUnit(command, of_angle, factor) : std::nullopt;
      if (unit) {
        scaling = Of(*unit, of_angle.certain, "");  // a doubt of the angle's is told there
        scaling.by_data = scaling.is_unit = true;
      } else if (angle && IsMapped(command, line)) {
        return Action(command, factor, of_angle.factor * line.intercept);
      } else if (scaling.doubt.empty()) {
        scaling = Of(of_angle.unit, false, NotStated(command, of_angle.unit + " is taken"));
      }
    }
    if (clear && line.slope < 0) {
      scaling.scale = -1;
      scaling.factor = -scaling.factor;
      scaling.doubt += std::string(scaling.doubt.empty() ? "" : "; ") + "'" + angle->name + "' moves against '" +
                       command.name + "': the sign of one of them";
    }
    return scaling;
  }

  // Its angle's, where a weak servo explains what is left; else the one that fits.
  std::optional<std::string> TargetUnit(const Guess& command, const Scaling& angle, double factor) const {
    if (const auto same = Snap(factor, {angle.unit}, kServoAgrees)) return same;
    auto other = Snap(factor, AngleUnits(samples_.whole_numbers(command.column)), kServoAgrees);
    if (other || SaysAction(command) || !IsOfAServo(factor / FactorOf(angle.unit))) return other;
    return angle.unit;
  }

  static bool SaysAction(const Guess& command) {
    return std::ranges::any_of(command.said.words, [](const std::string& word) {
      return word == "action" || word == "actions" || word == "policy";
    });
  }

  // How far an angle goes of what its target asks for.
  static bool IsOfAServo(double gain) { return std::abs(gain) >= kLeastGain && std::abs(gain) <= kLargestGain; }

  // It says that it is a policy's action, or it is a linear map of the angle that no weak servo explains.
  static bool IsMapped(const Guess& command, const FittedLine& line) {
    if (SaysAction(command)) return std::abs(line.correlation) > kClear;
    return std::abs(line.correlation) > kIsLinear && !IsOfAServo(line.slope);
  }

  static Scaling Action(const Guess& command, double factor, double offset) {
    Scaling scaling =
        Of("rad", false, LabelOf(command) + " is no angle but leads one: scale and offset are by regression");
    scaling.scale = scaling.factor = factor;
    scaling.add = offset;
    scaling.by_data = true;
    return scaling;
  }

  // A family has one unit, or one scale: what most of its members tell by regression. The scale is the middle one.
  void ScalesOfFamily(const std::map<std::string, std::vector<std::size_t>>& families, const std::vector<Pick>& picks,
                      std::vector<Scaling>* all) const {
    for (const auto& [family, members] : families) {
      std::vector<double> units, scales;
      for (const std::size_t i : members) {
        const Scaling& s = (*all)[i];
        if (s.by_data) (s.is_unit ? units : scales).push_back(std::abs(s.factor));
      }
      if (units.empty() && scales.empty()) continue;
      const bool is_unit = units.size() >= scales.size();
      const double middle = is_unit ? MostCommon(units) : Median(scales);
      const auto is_like = [&](std::size_t i, double factor) {
        const Scaling& s = (*all)[i];
        return s.by_data && s.is_unit == is_unit && s.factor == factor;
      };
      auto like = std::ranges::find_if(members, [&](std::size_t i) { return is_like(i, middle); });
      if (like == members.end())
        like = std::ranges::find_if(members, [&](std::size_t i) { return is_like(i, -middle); });
      const Scaling model = (*all)[*like];
      for (const std::size_t i : members) {
        Scaling& s = (*all)[i];
        const bool stated = s.certain && !s.by_data;
        if (stated || (is_unit && (is_like(i, middle) || is_like(i, -middle)))) continue;
        const bool against = is_unit || s.by_data ? s.factor < 0 : model.factor < 0;
        s = model;
        s.factor = against ? -middle : middle;
        s.scale = against ? -std::abs(model.scale) : std::abs(model.scale);
        if (s.add != 0) s.add = MeanOfAngle(i) - s.factor * MeanOf(picks[i]);
      }
    }
  }

  double MeanOf(const Pick& pick) const { return MomentsOf(samples_.values(GuessOf(pick)->column)).mean; }
  double MeanOfAngle(std::size_t a) const {
    const int joint = p_.actuators[a].joint;
    return p_.positions[joint].column < 0 ? 0 : scalings_.positions[joint].factor * MeanOf(p_.positions[joint]);
  }

  Scaling Torque(const Pick& pick) const {
    Scaling scaling = Stated(pick, "N m");
    const Guess* guess = GuessOf(pick);
    if (guess && !scaling.certain && scaling.doubt.empty()) scaling.doubt = NotStated(*guess, "N m is taken");
    return scaling;
  }

  const mjModel& m_;
  const Samples& samples_;
  const std::vector<Guess>& guesses_;
  const Pairing& p_;
  Scalings scalings_;
};

}  // namespace

Scalings ScaleColumns(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses,
                      const Pairing& pairing) {
  return Scaler(model, samples, guesses, pairing).Run();
}

}  // namespace gapscope

#include "src/draft/zeros.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

// A limit is soft, and a sensor's zero is a little off.
constexpr double kBeyond_rad = 0.1, kBeyondShare = 0.05;

void AddDoubt(const std::string& text, Scaling* scaling) {
  scaling->doubt += (scaling->doubt.empty() ? "" : "; ") + text;
}

class Zeros {
 public:
  Zeros(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
        Scalings* scalings)
      : m_(model), samples_(samples), guesses_(guesses), p_(pairing), s_(*scalings) {}

  void Run() {
    const auto turns = [&](std::size_t j) { return !p_.joints[j].slide; };
    for (const auto& [family, joints] : FamiliesOf(p_.positions, guesses_, turns)) OfFamily(joints);
    for (std::size_t a = 0; a < p_.actuators.size(); ++a) OfTarget(a);
  }

 private:
  const Guess& AngleOf(std::size_t joint) const { return guesses_[p_.positions[joint].column]; }

  // How far the angle goes beyond its joint's range when `add` is added to it.
  double Beyond(std::size_t j, double add) const {
    const int joint = p_.joints[j].joint;
    if (!m_.jnt_limited[joint]) return 0;
    const double low = m_.jnt_range[2 * joint], high = m_.jnt_range[2 * joint + 1];
    const double factor = s_.positions[j].factor, soft = kBeyond_rad + kBeyondShare * (high - low);
    const double a = factor * samples_.lowest(AngleOf(j).column) + add;
    const double b = factor * samples_.highest(AngleOf(j).column) + add;
    return std::max({0.0, low - soft - std::min(a, b), std::max(a, b) - high - soft});
  }

  void OfFamily(const std::vector<std::size_t>& joints) {
    const auto fits = [&](double add) {
      return std::ranges::all_of(joints, [&](std::size_t j) { return Beyond(j, add) <= 0; });
    };
    if (fits(0)) return;
    for (const double half_turn : {-std::numbers::pi, std::numbers::pi}) {
      if (!fits(half_turn)) continue;
      for (const std::size_t j : joints) {
        s_.positions[j].add = half_turn;
        AddDoubt("the zero of " + LabelOf(AngleOf(j).name, AngleOf(j).said) +
                     " is moved by half a turn, into the joints' ranges",
                 &s_.positions[j]);
      }
      return;
    }
    for (const std::size_t j : joints) {
      if (Beyond(j, 0) > 0)
        AddDoubt("'" + AngleOf(j).name + "' leaves its joint's range: its unit, its sign or its zero is another",
                 &s_.positions[j]);
    }
  }

  // A target is counted from where its angle is, if that brings their means together.
  void OfTarget(std::size_t a) {
    const int joint = p_.actuators[a].joint;
    if (joint < 0 || p_.actuators[a].wants != Quantity::kAngle || p_.commands[a].column < 0) return;
    const double moved = s_.positions[static_cast<std::size_t>(joint)].add;
    Scaling& target = s_.commands[a];
    if (moved == 0) return;
    const double apart =
        MeanOf(p_.commands[a], target) - MeanOf(p_.positions[joint], s_.positions[static_cast<std::size_t>(joint)]);
    if (std::abs(apart + moved) < std::abs(apart)) target.add += moved;
  }

  double MeanOf(const Pick& pick, const Scaling& scaling) const {
    return scaling.factor * MomentsOf(samples_.values(guesses_[pick.column].column)).mean + scaling.add;
  }

  const mjModel& m_;
  const Samples& samples_;
  const std::vector<Guess>& guesses_;
  const Pairing& p_;
  Scalings& s_;
};

}  // namespace

void FindZeros(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
               Scalings* scalings) {
  Zeros(model, samples, guesses, pairing, scalings).Run();
}

}  // namespace gapscope

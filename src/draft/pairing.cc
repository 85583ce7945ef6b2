#include "src/draft/pairing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "src/draft/guess_columns.h"
#include "src/draft/match.h"
#include "src/model/drive_facts.h"
#include "src/model/element_names.h"

namespace gapscope {
namespace {

constexpr double kFollows = 0.5;      // a correlation that pairs what no name pairs
constexpr double kContradicts = 0.3;  // and one that speaks against a name

std::optional<int> OwnNumber(const std::string& name) {
  std::optional<int> number;
  for (const std::string& word : WordsOf(name)) {
    if (word[0] >= '0' && word[0] <= '9' && word.size() < 5) number = std::stoi(word);
  }
  return number;
}

// What an actuator of the MJCF is told.
Quantity WantsOf(const mjModel& m, int actuator) {
  static const std::map<std::string, Quantity> inputs = {
      {"target", Quantity::kAngle},       {"velocity", Quantity::kSpeed},   {"torque", Quantity::kTorque},
      {"feedforward", Quantity::kTorque}, {"current", Quantity::kElectric}, {"voltage", Quantity::kElectric},
      {"supply", Quantity::kOther},       {"enable", Quantity::kOther}};
  const DriveFacts facts = FactsOf(m, actuator);
  if (const auto found = inputs.find(facts.input); found != inputs.end()) return found->second;
  if (facts.feeds_back_position) return Quantity::kAngle;
  if (m.actuator_plugin[actuator] >= 0) return Quantity::kUnknown;
  const double gain = m.actuator_gainprm[actuator * mjNGAIN], speed = m.actuator_biasprm[actuator * mjNBIAS + 2];
  const bool affine = m.actuator_biastype[actuator] == mjBIAS_AFFINE;
  return affine && speed != 0 && speed == -gain ? Quantity::kSpeed : Quantity::kTorque;
}

class Pairer {
 public:
  Pairer(const mjModel& model, const Samples& samples, std::vector<Guess>* guesses)
      : m_(model), samples_(samples), guesses_(*guesses) {}

  Pairing Run() {
    FindJoints();
    FindActuators();
    PairPositions();
    PairVelocities();
    if (p_.actuators.empty()) {
      ProposeActuators();
    } else {
      PairCommands();
    }
    PairTorques();
    return std::move(p_);
  }

 private:
  void FindJoints() {
    for (int j = 0; j < m_.njnt; ++j) {
      const std::string name = NameOf(m_, mjOBJ_JOINT, j);
      const bool slide = m_.jnt_type[j] == mjJNT_SLIDE;
      if (name.empty() || (!slide && m_.jnt_type[j] != mjJNT_HINGE)) continue;
      p_.joints.push_back({.joint = j, .name = name, .slide = slide, .actuators = {}});
    }
  }

  void FindActuators() {
    for (int a = 0; a < m_.nactuator; ++a) {
      const std::string name = NameOf(m_, mjOBJ_ACTUATOR, a);
      if (name.empty()) continue;
      ActuatorSlot slot{.actuator = a, .name = name, .joint = -1, .wants = WantsOf(m_, a)};
      if (m_.actuator_trntype[a] == mjTRN_JOINT) {
        const auto found = std::ranges::find(p_.joints, m_.actuator_trnid[2 * a], &JointSlot::joint);
        if (found != p_.joints.end()) {
          slot.joint = static_cast<int>(found - p_.joints.begin());
          found->actuators.push_back(a);
        }
      }
      p_.actuators.push_back(slot);
    }
  }

  // Ways in which numbers may count the joints.
  std::vector<std::vector<int>> JointOrders() const {
    std::vector<int> all, numbered, actuated, free_to_move;
    for (int j = 0; j < static_cast<int>(p_.joints.size()); ++j) {
      all.push_back(j);
      if (OwnNumber(p_.joints[j].name)) numbered.push_back(j);
      if (!IsCoupled(p_.joints[j].joint)) free_to_move.push_back(j);
    }
    std::set<int> numbers;
    for (const int j : numbered) numbers.insert(OwnNumber(p_.joints[j].name).value_or(0));
    // "left_1" and "right_1" are counted as the model has them.
    if (numbers.size() == numbered.size())
      std::ranges::stable_sort(numbered, {}, [&](int j) { return *OwnNumber(p_.joints[j].name); });
    for (const ActuatorSlot& a : p_.actuators) {
      if (a.joint >= 0 && std::ranges::find(actuated, a.joint) == actuated.end()) actuated.push_back(a.joint);
    }
    return {numbered.size() == all.size() ? numbered : all, actuated, numbered, free_to_move};
  }

  // Its motion follows another joint's that comes before it.
  bool IsCoupled(int joint) const {
    for (int e = 0; e < m_.neq; ++e) {
      if (m_.eq_type[e] == mjEQ_JOINT && std::max(m_.eq_obj1id[e], m_.eq_obj2id[e]) == joint) return true;
    }
    return false;
  }

  const Guess* PositionGuess(int joint) const {
    return joint >= 0 && p_.positions[joint].column >= 0 ? &guesses_[p_.positions[joint].column] : nullptr;
  }

  std::vector<Slot> JointSlots(bool like_positions) const {
    std::vector<Slot> slots;
    slots.reserve(p_.joints.size());
    for (int j = 0; j < static_cast<int>(p_.joints.size()); ++j)
      slots.push_back({.names = {p_.joints[j].name}, .like = like_positions ? PositionGuess(j) : nullptr});
    AddShortNames(&slots);
    return slots;
  }

  // What all names of a kind share ("rh_FFJ4", "rh_THJ1") a log may leave out.
  static void AddShortNames(std::vector<Slot>* slots) {
    if (slots->size() < 2) return;
    const std::size_t kinds = slots->front().names.size();
    for (std::size_t kind = 0; kind < kinds; ++kind) {
      const auto has = [&](const Slot& slot, const std::string& word) {
        if (kind >= slot.names.size()) return true;
        const std::vector<std::string> words = WordsOf(slot.names[kind]);
        return std::ranges::find(words, word) != words.end();
      };
      std::vector<std::string> shared;
      for (const std::string& word : WordsOf(slots->front().names[kind])) {
        if (std::ranges::all_of(*slots, [&](const Slot& slot) { return has(slot, word); })) shared.push_back(word);
      }
      if (shared.empty()) continue;
      for (Slot& slot : *slots) {
        if (kind < slot.names.size()) AddShortName(shared, slot.names[kind], &slot);
      }
    }
  }

  // Not where a number alone would be left.
  static void AddShortName(const std::vector<std::string>& shared, const std::string& name, Slot* slot) {
    std::string text;
    bool is_word = false;
    for (const std::string& word : WordsOf(name)) {
      if (std::ranges::find(shared, word) != shared.end()) continue;
      text += (text.empty() ? "" : " ") + word;
      is_word = is_word || std::isalpha(static_cast<unsigned char>(word[0])) != 0;
    }
    if (is_word) slot->names.push_back(text);
  }

  void PairPositions() {
    const std::vector<int> candidates =
        Select(guesses_, [](const Guess& g) { return g.said.side != Side::kCommand && MayBe(g, Quantity::kAngle); });
    const std::vector<Slot> slots = JointSlots(false);
    const Numbers numbers(guesses_, candidates, slots, JointOrders());
    p_.positions = Match(
        slots, candidates, numbers,
        [&](int, int c) {
          const ColumnName& said = guesses_[c].said;
          return (said.side == Side::kMeasured ? 0.02 : 0) - (said.quantity == Quantity::kAngle ? 0 : 0.1);
        },
        &guesses_);
    const auto is_left = [&](int c) {
      return !guesses_[c].used && samples_.spread(guesses_[c].column) > 0 && !guesses_[c].said.filtered &&
             !IsCopy(guesses_[c].column);
    };
    const auto goes_by_order = [&](int c) { return is_left(c) && !IsOutsider(c, candidates); };
    const bool only_one = p_.joints.size() == 1 && std::ranges::count_if(candidates, is_left) == 1;
    for (Pick& pick : p_.positions) {
      const auto left = std::ranges::find_if(candidates, goes_by_order);
      if (pick.column >= 0 || left == candidates.end()) continue;
      guesses_[*left].used = true;
      pick = {.column = *left, .runner_up = -1, .certain = only_one, .why = "", .by_order = !only_one};
    }
  }

  // Names pair most columns of its family, but not this one: it is of something else than a joint or an actuator.
  bool IsOutsider(int candidate, const std::vector<int>& candidates) const {
    const std::string family = FamilyOf(guesses_[candidate].said);
    const auto kin = [&](int c) { return FamilyOf(guesses_[c].said) == family; };
    const auto paired = std::ranges::count_if(candidates, [&](int c) { return kin(c) && IsPairedByName(c); });
    return !family.empty() && 2 * paired > std::ranges::count_if(candidates, kin);
  }

  bool IsPairedByName(int candidate) const {
    const auto is_it = [&](const Pick& pick) { return pick.column == candidate && !pick.by_order; };
    return std::ranges::any_of(p_.positions, is_it) || std::ranges::any_of(p_.commands, is_it);
  }

  // The same numbers as a column that is used already.
  bool IsCopy(int column) const {
    return std::ranges::any_of(guesses_, [&](const Guess& g) {
      return g.used && g.column != column && samples_.values(g.column) == samples_.values(column);
    });
  }

  double FollowsSpeed(int joint, int candidate) const {
    const Guess* angle = PositionGuess(joint);
    if (!angle) return 0;
    return std::abs(
        LineThrough(samples_.slopes(angle->column), samples_.values(guesses_[candidate].column)).correlation);
  }

  void PairVelocities() {
    const std::vector<int> candidates = Select(
        guesses_, [](const Guess& g) { return g.said.side != Side::kCommand && g.said.quantity == Quantity::kSpeed; });
    const std::vector<Slot> slots = JointSlots(true);
    const Numbers numbers(guesses_, candidates, slots, JointOrders());
    p_.velocities = Match(
        slots, candidates, numbers, [&](int s, int c) { return FollowsSpeed(s, c) > kContradicts ? 0.05 : -0.3; },
        &guesses_);
    for (int j = 0; j < static_cast<int>(p_.joints.size()); ++j) {
      Pick& pick = p_.velocities[j];
      if (pick.column >= 0 && PositionGuess(j) && FollowsSpeed(j, pick.column) <= kContradicts) {
        pick.certain = false;
        pick.why = "it does not follow the derivative of the angle";
      }
    }
    PairByData(candidates, [&](int j, int c) { return FollowsSpeed(j, c); }, &p_.velocities);
  }

  // What no name pairs: the best follower first.
  template <class Likeness>
  void PairByData(const std::vector<int>& candidates, const Likeness& likeness, std::vector<Pick>* picks) {
    while (true) {
      int slot = -1, best = -1;
      double score = kFollows;
      for (int s = 0; s < static_cast<int>(picks->size()); ++s) {
        for (const int c : candidates) {
          if ((*picks)[s].column >= 0 || guesses_[c].used) continue;
          if (const double like = likeness(s, c); like > score) score = like, slot = s, best = c;
        }
      }
      if (slot < 0) return;
      guesses_[best].used = true;
      (*picks)[slot] = {.column = best, .runner_up = -1, .certain = true, .why = ""};
    }
  }

  std::vector<Slot> ActuatorSlots() const {
    std::vector<Slot> slots;
    for (const ActuatorSlot& a : p_.actuators) {
      Slot slot{.names = {a.name}, .like = PositionGuess(a.joint)};
      if (a.joint >= 0) slot.names.push_back(p_.joints[a.joint].name);
      slots.push_back(std::move(slot));
    }
    AddShortNames(&slots);
    return slots;
  }

  std::vector<std::vector<int>> ActuatorOrders() const {
    std::vector<int> all, by_joint;
    for (int a = 0; a < static_cast<int>(p_.actuators.size()); ++a) {
      all.push_back(a);
      if (p_.actuators[a].joint >= 0) by_joint.push_back(a);
    }
    std::ranges::stable_sort(by_joint, {}, [&](int a) { return p_.actuators[a].joint; });
    return {all, by_joint};
  }

  // Columns that may be commands: those that say so, else torques and voltages of which nobody says that they are
  // measured.
  std::vector<int> CommandCandidates() const {
    std::vector<int> said = Select(
        guesses_, [](const Guess& g) { return g.said.side == Side::kCommand && g.said.quantity != Quantity::kOther; });
    if (!said.empty()) return said;
    return Select(guesses_, [](const Guess& g) {
      const Quantity q = g.said.quantity;
      return g.said.side == Side::kUnknown && (q == Quantity::kTorque || q == Quantity::kElectric);
    });
  }

  double Likeness(int joint, int candidate) const {
    const Guess* angle = PositionGuess(joint);
    if (!angle) return 0;
    return std::abs(
        LineThrough(samples_.values(guesses_[candidate].column), samples_.values(angle->column)).correlation);
  }

  static double Fit(Quantity wants, Quantity said) {
    if (wants == Quantity::kOther || said == Quantity::kOther) return wants == said ? 0.05 : -10;
    if (wants == Quantity::kUnknown || said == Quantity::kUnknown) return 0;
    return wants == said || (wants == Quantity::kTorque && said == Quantity::kElectric) ? 0.05 : -0.3;
  }

  void PairCommands() {
    std::vector<int> candidates = CommandCandidates();
    // Supplies and switches, for the inputs that are called so.
    const std::vector<int> others =
        Select(guesses_, [](const Guess& g) { return g.said.quantity == Quantity::kOther; });
    candidates.insert(candidates.end(), others.begin(), others.end());
    const std::vector<Slot> slots = ActuatorSlots();
    const Numbers numbers(guesses_, candidates, slots, ActuatorOrders());
    p_.commands = Match(
        slots, candidates, numbers, [&](int s, int c) { return Fit(p_.actuators[s].wants, guesses_[c].said.quantity); },
        &guesses_);
    const auto servo_follows = [&](int s, int c) {
      const bool servo = p_.actuators[s].wants == Quantity::kAngle;
      return servo && MayBe(guesses_[c], Quantity::kAngle) ? Likeness(p_.actuators[s].joint, c) : 0;
    };
    DropContradicted(candidates, servo_follows);
    PairByData(candidates, servo_follows, &p_.commands);
    PairByOrder(candidates);
  }

  // A servo's command that a part of a name suggests, where another column leads the joint clearly better.
  template <class Likeness>
  void DropContradicted(const std::vector<int>& candidates, const Likeness& likeness) {
    for (int s = 0; s < static_cast<int>(p_.commands.size()); ++s) {
      Pick& pick = p_.commands[s];
      if (pick.column < 0 || pick.certain) continue;
      const double own = likeness(s, pick.column);
      const bool better = std::ranges::any_of(
          candidates, [&](int c) { return !guesses_[c].used && likeness(s, c) > std::max(kFollows, own + 0.1); });
      if (!better) continue;
      guesses_[pick.column].used = false;
      pick = {};
    }
  }

  void PairByOrder(const std::vector<int>& candidates) {
    const bool last = std::ranges::count(p_.commands, -1, &Pick::column) == 1;
    for (std::size_t s = 0; s < p_.commands.size(); ++s) {
      const auto is_left = [&](int c) {
        return !guesses_[c].used && Fit(p_.actuators[s].wants, guesses_[c].said.quantity) >= 0 &&
               samples_.spread(guesses_[c].column) > 0 && !guesses_[c].said.number &&
               (last || !IsOutsider(c, candidates));
      };
      const auto left = std::ranges::find_if(candidates, is_left);
      if (p_.commands[s].column >= 0 || left == candidates.end() || p_.actuators[s].wants == Quantity::kOther) continue;
      const bool only_one = p_.commands.size() == 1 && std::ranges::count_if(candidates, is_left) == 1;
      guesses_[*left].used = true;
      p_.commands[s] = {.column = *left, .runner_up = -1, .certain = only_one, .why = "", .by_order = !only_one};
    }
  }

  // For each joint with a command column: of angles where there are some, else torques, else speeds.
  void ProposeActuators() {
    const std::vector<int> all = CommandCandidates();
    std::vector<Pick> picks(p_.joints.size());
    std::vector<Quantity> wants(p_.joints.size(), Quantity::kUnknown);
    for (const Quantity quantity : {Quantity::kAngle, Quantity::kTorque, Quantity::kSpeed}) {
      std::vector<int> candidates;
      std::ranges::copy_if(all, std::back_inserter(candidates), [&](int c) {
        return guesses_[c].said.quantity == quantity ||
               (quantity == Quantity::kAngle && guesses_[c].said.quantity == Quantity::kUnknown);
      });
      const std::vector<Slot> slots = JointSlots(true);
      const Numbers numbers(guesses_, candidates, slots, JointOrders());
      std::vector<Pick> found = Match(slots, candidates, numbers, [](int, int) { return 0.0; }, &guesses_);
      if (quantity == Quantity::kAngle) PairByData(candidates, [&](int j, int c) { return Likeness(j, c); }, &found);
      for (std::size_t j = 0; j < picks.size(); ++j) {
        if (picks[j].column >= 0 || found[j].column < 0) continue;
        picks[j] = found[j];
        wants[j] = quantity;
      }
    }
    KindsByFamily(picks, &wants);
    for (int j = 0; j < static_cast<int>(picks.size()); ++j) {
      if (picks[j].column < 0) continue;
      p_.actuators.push_back({.actuator = -1, .name = p_.joints[j].name, .joint = j, .wants = wants[j]});
      p_.commands.push_back(picks[j]);
    }
  }

  // Commands that do not say what they ask for: angles if most joints of their family follow them, else torques.
  void KindsByFamily(const std::vector<Pick>& picks, std::vector<Quantity>* wants) const {
    std::map<std::string, int> votes;
    const auto family = [&](std::size_t j) { return FamilyOf(guesses_[picks[j].column].said); };
    const auto is_open = [&](std::size_t j) {
      return picks[j].column >= 0 && guesses_[picks[j].column].said.quantity == Quantity::kUnknown;
    };
    for (std::size_t j = 0; j < picks.size(); ++j) {
      const Guess* angle = PositionGuess(static_cast<int>(j));
      if (!is_open(j) || !angle) continue;
      const Following f = samples_.Follow(guesses_[picks[j].column].column, angle->column);
      votes[family(j)] += std::abs(f.correlation) > kFollows && f.lag_s >= 0 ? 1 : -1;
    }
    for (std::size_t j = 0; j < picks.size(); ++j) {
      if (is_open(j)) (*wants)[j] = votes[family(j)] > 0 ? Quantity::kAngle : Quantity::kTorque;
    }
  }

  void PairTorques() {
    const std::vector<int> candidates = Select(
        guesses_, [](const Guess& g) { return g.said.side != Side::kCommand && g.said.quantity == Quantity::kTorque; });
    const std::vector<Slot> slots = ActuatorSlots();
    const Numbers numbers(guesses_, candidates, slots, ActuatorOrders());
    p_.torques = Match(slots, candidates, numbers, [](int, int) { return 0.0; }, &guesses_);
    // One torque of one drive needs no name.
    if (p_.actuators.size() != 1 || candidates.size() != 1 || p_.torques[0].column >= 0) return;
    guesses_[candidates[0]].used = true;
    p_.torques[0] = {.column = candidates[0], .runner_up = -1, .certain = true, .why = ""};
  }

  const mjModel& m_;
  const Samples& samples_;
  std::vector<Guess>& guesses_;
  Pairing p_;
};

}  // namespace

Pairing PairColumns(const mjModel& model, const Samples& samples, std::vector<Guess>* guesses) {
  return Pairer(model, samples, guesses).Run();
}

}  // namespace gapscope

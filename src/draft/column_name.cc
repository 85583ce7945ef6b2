#include "src/draft/column_name.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <span>
#include <string_view>

#include "src/log/text.h"

namespace gapscope {
namespace {

using Words = std::span<const std::string_view>;

constexpr std::string_view kCommandWords[] = {
    "cmd",   "command",  "commanded", "target",      "des",     "desired", "ref",     "reference", "goal",
    "goals", "setpoint", "ctrl",      "con",         "control", "action",  "actions", "input",     "u",
    "sp",    "demand",   "request",   "feedforward", "ff",      "targets", "commands"};
constexpr std::string_view kMeasuredWords[] = {"meas",  "measured", "actual",   "fb",          "feedback",
                                               "state", "obs",      "observed", "observation", "states",
                                               "enc",   "encoder",  "sensor",   "resp",        "response"};
constexpr std::string_view kAngleWords[] = {"pos",  "position", "positions", "angle", "angles", "q",
                                            "qpos", "theta",    "alpha",     "phi",   "rad",    "deg",
                                            "dof",  "encoder",  "enc",       "mrad",  "counts", "ticks"};
constexpr std::string_view kSpeedWords[] = {"vel",  "velocity", "velocities", "speed", "speeds", "dot", "dq",    "qd",
                                            "qdot", "qvel",     "w",          "omega", "rate",   "rpm", "dtheta"};
constexpr std::string_view kTorqueWords[] = {"torque", "torques", "tau", "effort", "efforts", "trq", "nm", "moment"};
constexpr std::string_view kElectricWords[] = {"voltage", "volt", "volts", "mv",   "current", "ma",
                                               "amps",    "amp",  "pwm",   "duty", "cur",     "curr"};
constexpr std::string_view kOtherWords[] = {"temp", "temperature", "acc",      "accel",  "acceleration", "gyro",
                                            "imu",  "quat",        "flag",     "error",  "err",          "status",
                                            "mode", "fric",        "friction", "enable", "battery",      "supply",
                                            "id",   "index",       "kp",       "kd",     "load"};
constexpr std::string_view kFilteredWords[] = {"filt", "filtered", "smooth", "smoothed", "lp", "est", "estimated"};
constexpr std::string_view kSharedWords[] = {"joint", "joints", "motor", "motors", "servo", "actuator", "act", "link",
                                             "drive", "axis",   "m",     "j",      "the",   "s",        "n"};

bool Holds(Words list, const std::string& word) { return std::ranges::find(list, word) != list.end(); }
bool HoldsAny(Words list, const std::vector<std::string>& words) {
  return std::ranges::any_of(words, [&](const std::string& word) { return Holds(list, word); });
}

bool IsNumber(const std::string& word) { return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])); }

Quantity QuantityOf(const std::vector<std::string>& words) {
  const bool speed = HoldsAny(kSpeedWords, words);
  if (HoldsAny(kOtherWords, words)) return Quantity::kOther;
  if (HoldsAny(kTorqueWords, words)) return Quantity::kTorque;
  if (speed) return Quantity::kSpeed;
  if (HoldsAny(kAngleWords, words)) return Quantity::kAngle;
  if (HoldsAny(kElectricWords, words)) return Quantity::kElectric;
  return Quantity::kUnknown;
}

std::string UnitOf(const std::vector<std::string>& words, Quantity quantity) {
  static const std::map<std::string, std::string> units = {
      {"deg", "deg"}, {"rpm", "rpm"}, {"rad", "rad"},   {"mrad", "mrad"}, {"v", "V"},        {"mv", "mV"},
      {"a", "A"},     {"ma", "mA"},   {"nm", "N m"},    {"volt", "V"},    {"volts", "V"},    {"voltage", "V"},
      {"amps", "A"},  {"amp", "A"},   {"current", "A"}, {"mm", "mm"},     {"degrees", "deg"}};
  std::string unit;
  for (const std::string& word : words) {
    // A letter alone may be a name: "cmd_a".
    const bool says = word.size() > 1 || quantity == Quantity::kElectric;
    if (const auto found = units.find(word); says && found != units.end()) unit = found->second;
  }
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if (words[i] == "n" && words[i + 1] == "m") unit = "N m";
  }
  if (quantity == Quantity::kSpeed && (unit == "rad" || unit == "deg")) unit += "/s";
  if (quantity == Quantity::kTorque && unit != "N m" && unit != "A" && unit != "mA") unit.clear();
  return unit;
}

bool SaysOfTheJoint(const std::string& word) {
  for (const Words list : {Words(kCommandWords), Words(kMeasuredWords), Words(kAngleWords), Words(kSpeedWords),
                           Words(kTorqueWords), Words(kElectricWords), Words(kFilteredWords), Words(kSharedWords)}) {
    if (Holds(list, word)) return false;
  }
  return !IsNumber(word);
}

// The digits of a name, and the name with '#' in the place of one of them.
struct Digits {
  int value;
  std::string stem;
};
std::vector<Digits> DigitsOf(const std::string& name) {
  std::vector<Digits> found;
  for (std::size_t i = 0; i < name.size();) {
    std::size_t end = i;
    while (end < name.size() && std::isdigit(static_cast<unsigned char>(name[end]))) ++end;
    if (end > i && end - i <= 4)
      found.push_back({std::stoi(name.substr(i, end - i)), name.substr(0, i) + "#" + name.substr(end)});
    i = std::max(end, i + 1);
  }
  return found;
}

std::string Squashed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word;
  return text;
}

}  // namespace

std::vector<std::string> WordsOf(const std::string& name) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const unsigned char c = static_cast<unsigned char>(name[i]);
    const unsigned char before = i > 0 ? static_cast<unsigned char>(name[i - 1]) : ' ';
    const bool hump = std::isupper(c) && std::islower(before);
    const bool number =
        i > 0 && std::isalnum(c) && std::isalnum(before) && (std::isdigit(c) != 0) != (std::isdigit(before) != 0);
    if (!std::isalnum(c) || hump || number) words.emplace_back();
    if (std::isalnum(c)) words.back() += static_cast<char>(std::tolower(c));
  }
  std::erase(words, "");
  return words;
}

bool AreSameWord(const std::string& a, const std::string& b) {
  const auto is_letter_of = [](const std::string& letter, const std::string& word) {
    return (letter == "l" && word == "left") || (letter == "r" && word == "right");
  };
  return a == b || is_letter_of(a, b) || is_letter_of(b, a);
}

std::vector<ColumnName> ReadNames(const std::vector<std::string>& names) {
  std::map<std::string, std::set<int>> families;
  for (const std::string& name : names) {
    for (const Digits& digits : DigitsOf(name)) families[digits.stem].insert(digits.value);
  }
  std::vector<ColumnName> read;
  for (const std::string& name : names) {
    ColumnName one{.words = WordsOf(name)};
    // "q_d" and "q_t" are a desired q, "dq" is none.
    one.side = HoldsAny(kCommandWords, one.words)    ? Side::kCommand
               : HoldsAny(kMeasuredWords, one.words) ? Side::kMeasured
                                                     : Side::kUnknown;
    one.quantity = QuantityOf(one.words);
    one.unit = UnitOf(one.words, one.quantity);
    one.filtered = HoldsAny(kFilteredWords, one.words);
    std::ranges::copy_if(one.words, std::back_inserter(one.own), SaysOfTheJoint);
    std::size_t members = 0;
    one.stem = name;
    for (const Digits& digits : DigitsOf(name)) {
      if (families[digits.stem].size() < members) continue;
      members = families[digits.stem].size();
      one.number = digits.value;
      one.stem = digits.stem;
    }
    read.push_back(std::move(one));
  }
  return read;
}

std::string FamilyOf(const ColumnName& name) {
  std::string family;
  for (const std::string& word : name.words) {
    const bool own = std::ranges::find(name.own, word) != name.own.end();
    if (!own && !IsNumber(word)) family += word + " ";
  }
  return family;
}

std::string LabelOf(const std::string& name, const ColumnName& said) {
  std::string label = said.number ? said.stem : name;
  if (const std::size_t at = label.find('#'); at != std::string::npos) {
    label[at] = '*';
  } else if (!said.own.empty()) {
    const std::string lower = ToLower(label);
    const std::size_t first = lower.find(said.own.front()), last = lower.rfind(said.own.back());
    const std::size_t end = last == std::string::npos ? last : last + said.own.back().size();
    if (first != std::string::npos && end != std::string::npos && first < end && end - first < label.size())
      label.replace(first, end - first, "*");
  }
  return "'" + label + "'";
}

double NameMatch(const std::string& name, const std::string& element) {
  const std::vector<std::string> words = WordsOf(name), wanted = WordsOf(element);
  const bool only_shared =
      std::ranges::all_of(wanted, [](const std::string& word) { return Holds(kSharedWords, word) || IsNumber(word); });
  double hits = 0, count = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!only_shared && Holds(kSharedWords, wanted[i])) continue;
    count += 1;
    for (std::size_t k = 0; k < words.size(); ++k) {
      const bool behind = !IsNumber(wanted[i]) || i == 0 || (k > 0 && words[k - 1] == wanted[i - 1]);
      if (!AreSameWord(words[k], wanted[i]) || !behind) continue;
      hits += 1;
      break;
    }
  }
  if (count == 0) return 0;
  if (hits == count) return 1;
  const std::string squashed = Squashed(wanted);
  if (squashed.size() > 3 && !IsNumber(squashed.substr(squashed.size() - 1)) &&
      Squashed(words).find(squashed) != std::string::npos)
    return 0.95;
  return 0.8 * hits / count;
}

}  // namespace gapscope

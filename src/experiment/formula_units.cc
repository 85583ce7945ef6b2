#include "src/experiment/formula_units.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include "src/core/units.h"
#include "src/plugins/common/parser.h"

namespace gapscope {
namespace {

using UnitOrAny = std::optional<Dimension>;

constexpr Dimension kPure{};

UnitOrAny Combined(const UnitOrAny& a, const UnitOrAny& b, double power_of_b) {
  if (!a || !b) return std::nullopt;
  Dimension product = *a;
  for (std::size_t i = 0; i < product.size(); ++i) product[i] += power_of_b * (*b)[i];
  return product;
}

bool IsIn(const std::string& word, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* one) { return word == one; });
}

// Reads by recursion, an operator's rank a level. What is not read is not checked.
class Reader {
 public:
  Reader(std::string_view text, const std::map<std::string, UnitOrAny>& units) : text_(text), units_(units) {}

  // Of the whole formula.
  UnitOrAny Read() {
    const UnitOrAny unit = Choice();
    if (Peek() != '\0') unread_ = true;
    return unread_ ? std::nullopt : unit;
  }
  // "angle + speed: rad beside rad/s"; empty: all agree.
  const std::string& clash() const { return clash_; }
  bool unread() const { return unread_; }

 private:
  char Peek() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Take(std::string_view sign) {
    Peek();
    if (!text_.substr(at_).starts_with(sign)) return false;
    at_ += sign.size();
    return true;
  }
  std::string_view From(std::size_t begin) const {
    std::string_view part = text_.substr(begin, at_ - begin);
    while (!part.empty() && std::isspace(static_cast<unsigned char>(part.back()))) part.remove_suffix(1);
    return part;
  }
  void Clash(std::size_t begin, const std::string& what) {
    if (clash_.empty()) clash_ = "'" + std::string(From(begin)) + "': " + what;
  }
  // Both are of one unit: the one that says which.
  UnitOrAny Same(const UnitOrAny& a, const UnitOrAny& b, std::size_t begin) {
    if (a && b && *a != *b) Clash(begin, TextOf(*a) + " beside " + TextOf(*b));
    return a ? a : b;
  }

  UnitOrAny Choice() {
    const std::size_t begin = Begin();
    const UnitOrAny condition = Logic();
    if (!Take("?")) return condition;
    const UnitOrAny yes = Choice();
    if (!Take(":")) unread_ = true;
    return Same(yes, Choice(), begin);
  }
  UnitOrAny Logic() {
    UnitOrAny unit = Comparison();
    while (Take("&&") || Take("||")) Comparison(), unit = kPure;
    return unit;
  }
  UnitOrAny Comparison() {
    const std::size_t begin = Begin();
    UnitOrAny unit = Sum();
    while (Take("<=") || Take(">=") || Take("==") || Take("!=") || Take("<") || Take(">")) {
      Same(unit, Sum(), begin);
      unit = kPure;
    }
    return unit;
  }
  UnitOrAny Sum() {
    const std::size_t begin = Begin();
    UnitOrAny unit = Product();
    while (Take("+") || Take("-")) unit = Same(unit, Product(), begin);
    return unit;
  }
  UnitOrAny Product() {
    UnitOrAny unit = Power();
    for (;;) {
      if (Take("*")) {
        unit = Combined(unit, Power(), 1);
      } else if (Take("/")) {
        unit = Combined(unit, Power(), -1);
      } else {
        return unit;
      }
    }
  }
  // Of a unit only a power that is written as a number is known.
  UnitOrAny Power() {
    const std::size_t begin = Begin();
    const UnitOrAny base = Signed();
    if (!Take("^")) return base;
    const std::size_t exponent = Begin();
    const UnitOrAny unit = Power();
    if (unit && *unit != kPure) Clash(begin, "a power of " + TextOf(*unit));
    if (!base || *base == kPure) return base;
    const std::string written(From(exponent));
    char* end = nullptr;
    const double power = std::strtod(written.c_str(), &end);
    return *end == '\0' ? Combined(kPure, base, power) : std::nullopt;
  }
  UnitOrAny Signed() {
    while (Take("-") || Take("+") || Take("!")) {
    }
    return Atom();
  }
  UnitOrAny Atom() {
    const std::size_t begin = Begin();
    if (Take("(")) {
      const UnitOrAny unit = Choice();
      if (!Take(")")) unread_ = true;
      return unit;
    }
    const char first = Peek();
    if (std::isdigit(static_cast<unsigned char>(first)) || first == '.') return Number();
    while (at_ < text_.size() && std::strchr(plugins::kNameChars, text_[at_])) ++at_;
    const std::string name(From(begin));
    if (name.empty()) {
      unread_ = true;
      return std::nullopt;
    }
    if (Take("(")) return Call(name, begin);
    if (name == "pi") return kPure;
    const auto known = units_.find(name);
    return known == units_.end() ? std::nullopt : known->second;
  }
  UnitOrAny Number() {
    const std::string rest(text_.substr(at_));
    char* end = nullptr;
    std::strtod(rest.c_str(), &end);
    at_ += static_cast<std::size_t>(end - rest.c_str());
    return std::nullopt;
  }
  UnitOrAny Call(const std::string& name, std::size_t begin) {
    std::vector<UnitOrAny> inputs;
    do inputs.push_back(Choice());
    while (Take(","));
    if (!Take(")")) unread_ = true;
    if (name == "sqrt") return Combined(kPure, inputs[0], 0.5);
    if (name == "sign") return kPure;
    if (IsIn(name, {"abs", "rint", "min", "max", "sum", "avg", "atan2"})) {
      UnitOrAny unit = inputs[0];
      for (const UnitOrAny& input : inputs) unit = Same(unit, input, begin);
      return name == "atan2" ? kPure : unit;
    }
    for (const UnitOrAny& input : inputs) {
      if (input && *input != kPure) Clash(begin, name + " of " + TextOf(*input));
    }
    return kPure;
  }
  std::size_t Begin() { return Peek(), at_; }

  const std::string_view text_;
  const std::map<std::string, UnitOrAny>& units_;
  std::size_t at_ = 0;
  std::string clash_;
  bool unread_ = false;
};

}  // namespace

Status CheckFormulaUnits(const std::string& formula, const std::map<std::string, std::string>& units,
                         const std::string& result, const std::string& where) {
  std::map<std::string, UnitOrAny> known;
  for (const auto& [name, text] : units) {
    if (const auto unit = ParseSiUnit(text); unit.ok()) known[name] = unit.value();
  }
  GS_ASSIGN(const Dimension allowed, ParseSiUnit(result));
  Reader reader(formula, known);
  const UnitOrAny unit = reader.Read();
  if (reader.unread()) return Ok();
  if (!reader.clash().empty()) {
    return Error{.what = "the units of the formula do not agree",
                 .where = where,
                 .actual = reader.clash() + " (rad is 1)",
                 .cure = "give a parameter another unit, or a factor to the term"};
  }
  if (!unit || *unit == allowed) return Ok();
  return Error{.what = "the formula is not in " + result + " by the units of what it names",
               .where = where,
               .actual = TextOf(*unit) + " (rad is 1)",
               .allowed = TextOf(allowed),
               .cure = "give a parameter another unit"};
}

}  // namespace gapscope

#include "src/core/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>

#include "src/core/names.h"

namespace gapscope {
namespace {

std::string NumberText(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value);
  return text;
}

// The whole text as a number, "+" allowed before a digit; nothing else.
template <class T>
std::optional<T> NumberOf(const std::string& text) {
  T value = 0;
  const char *begin = text.data(), *end = begin + text.size();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  const auto [stop, code] = std::from_chars(begin, end, value);
  return code == std::errc() && stop == end ? std::optional<T>(value) : std::nullopt;
}

std::string ListText(const std::vector<std::string>& items, const char* between) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : between) + item;
  return text;
}

Error Refused(const Option& option, const std::string& text, const char* kind) {
  const std::string range = option.range.Text();
  return {.what = "not a value it can have",
          .where = option.flag,
          .actual = "'" + text + "'",
          .allowed = std::string(kind) + (range.empty() ? "" : " " + range) +
                     (option.unit.empty() ? "" : " (" + option.unit + ")")};
}

template <class T>
Result<T> ReadNumber(const Option& option, const std::string& text) {
  const std::optional<T> value = NumberOf<T>(text);
  if (!value || !option.range.Contains(static_cast<double>(*value)))
    return Refused(option, text, std::is_integral_v<T> ? "a whole number" : "a finite number");
  return *value;
}

Status OneOf(const std::string& flag, const std::vector<std::string>& allowed, const std::string& word) {
  if (allowed.empty() || std::find(allowed.begin(), allowed.end(), word) != allowed.end()) return Ok();
  const std::string nearest = Nearest(word, allowed);
  return Error{.what = "not one of its words",
               .where = flag,
               .actual = "'" + word + "'",
               .allowed = ListText(allowed, ", "),
               .cure = nearest.empty() ? "" : "did you mean '" + nearest + "'?"};
}

// Writes what was given into the value, by its type.
struct Reader {
  const Option& option;
  const std::vector<std::string>& given;

  Status operator()(bool* value) const {
    *value = true;
    return Ok();
  }
  template <class T>
    requires std::is_arithmetic_v<T>
  Status operator()(T* value) const {
    GS_ASSIGN(*value, ReadNumber<T>(option, given.back()));
    return Ok();
  }
  Status operator()(std::string* value) const {
    GS_RETURN_IF_ERROR(OneOf(option.flag, option.words, given.back()));
    *value = given.back();
    return Ok();
  }
  Status operator()(std::vector<double>* value) const {
    std::vector<double> numbers;
    for (const auto& word : given) {
      GS_ASSIGN(const double number, ReadNumber<double>(option, word));
      numbers.push_back(number);
    }
    *value = std::move(numbers);
    return Ok();
  }
  Status operator()(std::vector<std::string>* value) const {
    for (const auto& word : given) GS_RETURN_IF_ERROR(OneOf(option.flag, option.words, word));
    if (!option.stands_for) {
      *value = given;
      return Ok();
    }
    std::vector<std::string> meant;
    for (const auto& word : given) {
      GS_ASSIGN(const auto words, option.stands_for(word));
      meant.insert(meant.end(), words.begin(), words.end());
    }
    *value = std::move(meant);
    return Ok();
  }
  Status operator()(const Choice& choice) const {
    GS_RETURN_IF_ERROR(OneOf(option.flag, choice.names, given.back()));
    choice.set(given.back());
    return Ok();
  }
};

struct Checker {
  const Option& option;

  template <class T>
    requires std::is_arithmetic_v<T>
  Status operator()(const T* value) const {
    const double number = static_cast<double>(*value);
    if (number == option.range.unset || option.range.Contains(number)) return Ok();
    return Refused(option, NumberText(number), std::is_integral_v<T> ? "a whole number" : "a finite number");
  }
  Status operator()(const bool*) const { return Ok(); }
  Status operator()(const std::string* value) const { return OneOf(option.flag, option.words, *value); }
  Status operator()(const std::vector<double>* value) const {
    for (const double number : *value) GS_RETURN_IF_ERROR((*this)(&number));
    return Ok();
  }
  Status operator()(const std::vector<std::string>* value) const {
    for (const auto& word : *value) GS_RETURN_IF_ERROR(OneOf(option.flag, option.words, word));
    return Ok();
  }
  Status operator()(const Choice&) const { return Ok(); }
};

struct KindText {
  const Option& option;
  std::string operator()(const bool*) const { return ""; }
  std::string operator()(const int*) const { return "COUNT"; }
  std::string operator()(const std::uint64_t*) const { return "COUNT"; }
  std::string operator()(const double*) const { return "NUMBER"; }
  std::string operator()(const std::vector<double>*) const { return "NUMBER"; }
  std::string operator()(const std::string*) const { return Words(option.words); }
  std::string operator()(const std::vector<std::string>*) const { return Words(option.words); }
  std::string operator()(const Choice& choice) const { return Words(choice.names); }
  static std::string Words(const std::vector<std::string>& words) {
    return words.empty() ? "TEXT" : "{" + ListText(words, ",") + "}";
  }
};

struct ValueText {
  std::string operator()(const bool*) const { return ""; }
  template <class T>
    requires std::is_arithmetic_v<T>
  std::string operator()(const T* value) const {
    return NumberText(static_cast<double>(*value));
  }
  std::string operator()(const std::string* value) const { return *value; }
  std::string operator()(const std::vector<double>* value) const {
    std::vector<std::string> items;
    for (const double number : *value) items.push_back(NumberText(number));
    return ListText(items, ",");
  }
  std::string operator()(const std::vector<std::string>* value) const { return ListText(*value, ","); }
  std::string operator()(const Choice& choice) const { return choice.get(); }
};

}  // namespace

bool NumberRange::Contains(double value) const {
  return std::isfinite(value) && (low_is_in ? value >= low : value > low) && value <= high;
}

std::string NumberRange::Text() const {
  const bool from = std::isfinite(low), to = std::isfinite(high);
  if (from && to && !low_is_in) return "above " + NumberText(low) + ", at most " + NumberText(high);
  if (from && to) return NumberText(low) + " .. " + NumberText(high);
  if (from) return (low_is_in ? "at least " : "above ") + NumberText(low);
  return to ? "at most " + NumberText(high) : "";
}

NumberRange Above(double low, double unset) { return {.low = low, .low_is_in = false, .unset = unset}; }
NumberRange AtLeast(double low, double unset) { return {.low = low, .unset = unset}; }
NumberRange Between(double low, double high) { return {.low = low, .high = high}; }

Status Option::Read(const std::vector<std::string>& given) const { return std::visit(Reader{*this, given}, value); }
Status Option::Check() const { return std::visit(Checker{*this}, value); }
std::string Option::Kind() const { return std::visit(KindText{*this}, value); }

bool Option::IsList() const {
  return std::holds_alternative<std::vector<double>*>(value) ||
         std::holds_alternative<std::vector<std::string>*>(value);
}

std::string Option::Allowed() const {
  const std::string text = range.Text();
  return unit + (unit.empty() || text.empty() ? "" : ", ") + text;
}

std::string Option::Default() const { return unset.empty() ? std::visit(ValueText{}, value) : unset; }

Status CheckAll(const std::vector<Option>& options) {
  for (const Option& option : options) GS_RETURN_IF_ERROR(option.Check());
  return Ok();
}

std::vector<Option> Join(std::vector<std::vector<Option>> lists) {
  std::vector<Option> all;
  for (auto& list : lists) std::move(list.begin(), list.end(), std::back_inserter(all));
  return all;
}

}  // namespace gapscope

// Options, each described once: name, value, range, unit, what it is for. From one table are made the flags of the
// command line, `--help`, docs/reference/options.md and the check of a value that a program sets without a command
// line.
//
// A struct of options has a function `std::vector<Option> OptionsOf(T&)` that lists its members; its default is the
// value that the member has in a struct nobody has touched.
#ifndef GAPSCOPE_CORE_OPTIONS_H_
#define GAPSCOPE_CORE_OPTIONS_H_

#include <cstdint>
#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "src/core/enum_names.h"
#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {

// Finite numbers from `low` to `high`. `low_is_in`: false where the lowest number is the first one refused.
struct NumberRange {
  double low = -kInfinity, high = kInfinity;
  bool low_is_in = true;
  double unset = kNaN;  // stands for "not given": no word gives it, Check lets it be

  bool Contains(double value) const;
  std::string Text() const;  // "above 0", "0 .. 1024", "" for every finite number
};
NumberRange Above(double low, double unset = kNaN);
NumberRange AtLeast(double low, double unset = kNaN);
NumberRange Between(double low, double high);

// A value that is one of a few words.
struct Choice {
  std::vector<std::string> names;
  std::function<void(const std::string&)> set;  // one of `names`
  std::function<std::string()> get;             // "" while nothing is chosen
};
template <class E>
Choice ChoiceOf(E& value) {
  return {.names = NamesOf<E>(),
          .set = [&value](const std::string& name) { value = *ValueOf<E>(name); },
          .get = [&value] { return NameOf(value); }};
}
template <class E>
Choice ChoiceOf(std::optional<E>& value) {
  return {.names = NamesOf<E>(),
          .set = [&value](const std::string& name) { value = ValueOf<E>(name); },
          .get = [&value] { return value ? NameOf(*value) : std::string(); }};
}

// As above, but only some of the enum's values may be given.
template <class T, class E>
Choice ChoiceAmong(T& value, const std::vector<E>& allowed) {
  Choice choice = ChoiceOf(value);
  choice.names.clear();
  for (const E one : allowed) choice.names.push_back(NameOf(one));
  return choice;
}

// Where an option's value is kept. A bool is a flag without a word; a vector takes a word each time the option is
// given, or several parted by commas.
using OptionValue = std::variant<bool*, int*, std::uint64_t*, double*, std::string*, std::vector<double>*,
                                 std::vector<std::string>*, Choice>;

struct Option {
  std::string flag;  // "--window"; without dashes it is given by its place
  OptionValue value;
  std::string unit;  // "" for words and pure numbers
  NumberRange range;
  std::vector<std::string> words;  // of a list of words: the ones allowed; empty: any
  // Of a list of words: what a given one stands for. Null: itself.
  Result<std::vector<std::string>> (*stands_for)(const std::string& word) = nullptr;
  std::string unset;  // what holds when it is not given and the value cannot say: "the experiment's"
  bool required = false;
  bool commas = false;  // a list's items are parted by commas, rather than the flag given again
  std::string help;     // a line for `--help`
  std::string more;     // the rest of its paragraph in docs/reference/options.md

  // Reads the words that were given. Errors: not a number, out of range, not one of the words, those of
  // `stands_for`; nothing is written then.
  Status Read(const std::vector<std::string>& given) const;
  // The present value against the range.
  Status Check() const;
  bool IsFlag() const { return std::holds_alternative<bool*>(value); }
  bool IsList() const;
  std::string Kind() const;     // "NUMBER", "COUNT", "TEXT", "{windows,free_run}", "" for a flag
  std::string Allowed() const;  // of numbers, with the unit: "s, above 0"
  std::string Default() const;  // text of the present value, or `unset`
};

// The first error of the options' present values.
Status CheckAll(const std::vector<Option>& options);
// For a struct with OptionsOf: are all its numbers in their ranges? Errors as Option::Check.
template <class T>
Status Validate(T options) {
  return CheckAll(OptionsOf(options));
}

// Lists put after each other.
std::vector<Option> Join(std::vector<std::vector<Option>> lists);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_OPTIONS_H_

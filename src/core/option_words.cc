#include "src/core/option_words.h"

#include <charconv>

namespace gapscope {
namespace {

template <class T>
std::string ExactText(T value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// The words of one option's value.
struct ValueWords {
  const Option& option;
  using Words = std::vector<std::string>;

  Words operator()(const bool*) const { return {}; }
  template <class T>
    requires std::is_arithmetic_v<T>
  Words operator()(const T* value) const {
    if (static_cast<double>(*value) == option.range.unset) return {};
    return {ExactText(*value)};
  }
  Words operator()(const std::string* value) const { return value->empty() ? Words() : Words{*value}; }
  Words operator()(const std::vector<double>* value) const {
    Words words;
    for (const double number : *value) words.push_back(ExactText(number));
    return words;
  }
  Words operator()(const std::vector<std::string>* value) const { return *value; }
  Words operator()(const Choice& choice) const {
    const std::string name = choice.get();
    return name.empty() ? Words() : Words{name};
  }
};

}  // namespace

std::vector<std::string> WordsOf(const std::vector<Option>& options) {
  std::vector<std::string> places, flags;
  for (const Option& option : options) {
    if (option.IsFlag()) {
      if (*std::get<bool*>(option.value)) flags.push_back(option.flag);
      continue;
    }
    const bool flagged = option.flag.starts_with("-");
    for (const std::string& word : std::visit(ValueWords{option}, option.value))
      flagged ? flags.push_back(option.flag + "=" + word) : places.push_back(word);
  }
  places.insert(places.end(), flags.begin(), flags.end());
  return places;
}

}  // namespace gapscope

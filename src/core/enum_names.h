// Names of an enum's values: one table to check a word, to read it and to print it. An enum with names declares
//
//   template <>
//   std::span<const EnumName<Colour>> EnumNames<Colour>();
//
// beside itself and defines it where its functions are.
#ifndef GAPSCOPE_CORE_ENUM_NAMES_H_
#define GAPSCOPE_CORE_ENUM_NAMES_H_

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

template <class E>
struct EnumName {
  E value;
  const char* name;
};

template <class E>
std::span<const EnumName<E>> EnumNames();

// The name of a value. Throws where the table lacks it: a bug.
template <class E>
std::string NameOf(E value) {
  for (const auto& entry : EnumNames<E>()) {
    if (entry.value == value) return entry.name;
  }
  throw std::logic_error("an enum's value without a name");
}

template <class E>
std::optional<E> ValueOf(std::string_view name) {
  for (const auto& entry : EnumNames<E>()) {
    if (entry.name == name) return entry.value;
  }
  return std::nullopt;
}

// All names in the order of the table.
template <class E>
std::vector<std::string> NamesOf() {
  std::vector<std::string> names;
  for (const auto& entry : EnumNames<E>()) names.emplace_back(entry.name);
  return names;
}

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_ENUM_NAMES_H_

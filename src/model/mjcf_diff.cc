#include "src/model/mjcf_diff.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <optional>
#include <sstream>

namespace gapscope {
namespace {

constexpr double kRelative = 1e-6;
constexpr int kFewest = 6;          // digits; zeros at the end are not written
constexpr double kNothing = 1e-15;  // what arithmetic leaves of zero

// "option": of its attributes gravity alone. The rest is how the program simulates, or how the writer counts.
constexpr std::array kSections = {"option", "extension", "worldbody", "tendon", "actuator", "custom", "keyframe"};

std::vector<std::string> WordsOf(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::optional<double> NumberOf(const std::string& word) {
  double number = 0;
  const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), number);
  return failure == std::errc() && end == word.data() + word.size() ? std::optional(number) : std::nullopt;
}

bool Close(double a, double b) {
  return a == b || std::abs(a - b) <= std::max(kNothing, kRelative * std::max(std::abs(a), std::abs(b)));
}

class Differ {
 public:
  Differ(const XmlText& before, const XmlText& after) : before_(before), after_(after) {}

  MjcfDiff Run() {
    for (const int section : after_.at(0).children) {
      if (std::find(kSections.begin(), kSections.end(), after_.at(section).tag) == kSections.end()) continue;
      Child(0, section);
    }
    return std::move(diff_);
  }

 private:
  // A child of an element after, beside what it was in the same element before.
  void Child(int parent_before, int child) {
    if (const int was = Match(parent_before, child); was >= 0) {
      Element(was, child);
    } else {
      diff_.added.push_back({parent_before, child});
    }
  }

  int Match(int parent_before, int child) const {
    const XmlElement& e = after_.at(child);
    const std::string key = KeyOf(e);
    for (const int c : before_.at(parent_before).children) {
      const XmlElement& b = before_.at(c);
      // An actuator may become one of another kind.
      const bool same_tag = b.tag == e.tag || after_.at(e.parent).tag == "actuator";
      if (same_tag && KeyOf(b) == key && (!key.empty() || OrdinalOf(before_, c) == OrdinalOf(after_, child))) return c;
    }
    return -1;
  }

  void Element(int b, int a) {
    const XmlElement &was = before_.at(b), &is = after_.at(a);
    MjcfDiff::Changed changed{.before = b, .after = a, .attributes = {}};
    for (const auto& attribute : is.attributes) {
      if (const std::string* old = was.Find(attribute.name); !old || !SameValue(*old, attribute.value))
        changed.attributes.push_back(attribute.name);
    }
    for (const auto& attribute : was.attributes) {
      if (!is.Find(attribute.name)) changed.attributes.push_back(attribute.name);
    }
    if (is.tag == "option") std::erase_if(changed.attributes, [](const auto& name) { return name != "gravity"; });
    if (!changed.attributes.empty() || was.tag != is.tag) diff_.changed.push_back(std::move(changed));
    if (is.tag == "option") return;
    for (const int child : is.children) Child(b, child);
  }

  const XmlText &before_, &after_;
  MjcfDiff diff_;
};

}  // namespace

MjcfDiff DiffMjcf(const XmlText& before, const XmlText& after) { return Differ(before, after).Run(); }

bool SameValue(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const std::vector<std::string> left = WordsOf(a), right = WordsOf(b);
  return std::equal(left.begin(), left.end(), right.begin(), right.end(),
                    [](const std::string& one, const std::string& other) {
                      const auto x = NumberOf(one), y = NumberOf(other);
                      return one == other || (x && y && Close(*x, *y));
                    });
}

std::string ShortValue(const std::string& value) {
  std::string text;
  for (const std::string& word : WordsOf(value)) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%s", word.substr(0, sizeof digits - 1).c_str());
    if (const auto number = NumberOf(word)) {
      for (int count = kFewest; count <= 17; ++count) {
        std::snprintf(digits, sizeof digits, "%.*g", count, std::abs(*number) < kNothing ? 0 : *number);
        if (Close(std::strtod(digits, nullptr), *number)) break;
      }
    }
    text.append(text.empty() ? "" : " ").append(NumberOf(word) ? digits : word);
  }
  return text;
}

std::string SectionOf(const XmlText& xml, int element) {
  while (element > 0 && xml.at(element).parent > 0) element = xml.at(element).parent;
  return element > 0 ? xml.at(element).tag : "";
}

std::string KeyOf(const XmlElement& element) {
  const std::string* name = element.Find("name");
  return name ? *name : element.tag == "plugin" ? element.Get("plugin") : "";
}

int OrdinalOf(const XmlText& xml, int element) {
  int ordinal = 0;
  for (const int sibling : xml.at(xml.at(element).parent).children) {
    if (sibling == element) break;
    ordinal += xml.at(sibling).tag == xml.at(element).tag && KeyOf(xml.at(sibling)).empty() ? 1 : 0;
  }
  return ordinal;
}

}  // namespace gapscope

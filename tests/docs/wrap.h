// Made paragraphs in lines of at most 120 columns.
#ifndef GAPSCOPE_TESTS_DOCS_WRAP_H_
#define GAPSCOPE_TESTS_DOCS_WRAP_H_

#include <sstream>
#include <string>

namespace gapscope {

// What begins with a dash is indented under it.
inline std::string Wrapped(const std::string& text) {
  std::string lines, line;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > 120) {
      lines += line + "\n";
      line = text.starts_with("- ") ? " " : "";
    }
    line += (line.empty() ? "" : " ") + word;
  }
  return lines + line + "\n";
}

}  // namespace gapscope

#endif  // GAPSCOPE_TESTS_DOCS_WRAP_H_

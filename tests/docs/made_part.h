// A document's part that a test makes: paragraphs in lines of at most 120 columns, between two marks.
#ifndef GAPSCOPE_TESTS_DOCS_MADE_PART_H_
#define GAPSCOPE_TESTS_DOCS_MADE_PART_H_

#include <gtest/gtest.h>

#include <cstdlib>
#include <sstream>
#include <string>

#include "src/core/file.h"

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

// docs/reference/NAME.md holds `made` between "<!-- made from SOURCE -->" and "<!-- end -->"; with GAPSCOPE_WRITE_DOCS
// set it is written there. `test`: the program to do that with.
inline void ExpectMadePart(const std::string& name, const std::string& source, const std::string& made,
                           const std::string& test) {
  const std::string path = std::string(GAPSCOPE_SOURCE_DIR) + "/docs/reference/" + name + ".md",
                    begin = "<!-- made from " + source + " -->\n\n", end = "\n<!-- end -->";
  const auto file = ReadFile(path);
  ASSERT_TRUE(file.ok()) << file.error().Text();
  const std::string& text = file.value();
  const std::size_t from = text.find(begin), to = text.find(end);
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  const std::string whole = text.substr(0, from + begin.size()) + made + text.substr(to);
  if (std::getenv("GAPSCOPE_WRITE_DOCS")) {
    ASSERT_TRUE(WriteFile(path, whole).ok());
  } else {
    EXPECT_EQ(text, whole) << "run GAPSCOPE_WRITE_DOCS=1 build/tests/" << test;
  }
}

}  // namespace gapscope

#endif  // GAPSCOPE_TESTS_DOCS_MADE_PART_H_

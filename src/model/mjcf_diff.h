// Two MJCFs that MuJoCo's own writer made, before and after a change of the model: what differs between them.
#ifndef GAPSCOPE_MODEL_MJCF_DIFF_H_
#define GAPSCOPE_MODEL_MJCF_DIFF_H_

#include <string>
#include <vector>

#include "src/model/xml_text.h"

namespace gapscope {

// Elements by their index in the text before or after.
struct MjcfDiff {
  struct Changed {
    int before, after;
    std::vector<std::string> attributes;  // that are new, gone or of another value
  };
  struct Added {
    int parent_before, after;
  };
  std::vector<Changed> changed;
  std::vector<Added> added;
};
// Of the sections that a model's motion depends on and an effect may change.
MjcfDiff DiffMjcf(const XmlText& before, const XmlText& after);

// Attribute values, words or numbers: numbers are equal to a relative 1e-6.
bool SameValue(const std::string& a, const std::string& b);
// Each number by the fewest digits, from six on and without zeros at the end, that hold it to a relative 1e-6.
std::string ShortValue(const std::string& value);

// The child of the document's root that an element stands in: "worldbody". The root is in none.
std::string SectionOf(const XmlText& xml, int element);
// What tells an element from its siblings: its name, of a plugin that is declared its plugin; "": nothing does.
std::string KeyOf(const XmlElement& element);
// Its place among the siblings of its tag that have no key.
int OrdinalOf(const XmlText& xml, int element);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_MJCF_DIFF_H_

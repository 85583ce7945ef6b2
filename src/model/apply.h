// A result becomes a change of the user's own MJCF: its text with comments, blanks and order kept, and only what the
// effects and values change written anew, with a comment above it that says why.
//
// MuJoCo's own writer writes the rig's MJCF twice, as it was read and with the effects and values. What differs
// between the two is carried over into the user's text; then the text is read and compared with the model it stands
// for.
#ifndef GAPSCOPE_MODEL_APPLY_H_
#define GAPSCOPE_MODEL_APPLY_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "src/model/model.h"

namespace gapscope {

struct ApplyOptions {
  std::string out;                           // file that the text is for: paths in it are as seen from its folder
  std::map<std::string, std::string> notes;  // parameter -> what a comment says where that one acts
};

struct AppliedChange {
  std::string element;                   // "joint arm"
  std::string attribute, before, after;  // attribute: empty for an element that is new; before: empty for a new one
};

struct AppliedMjcf {
  std::string text;
  std::vector<AppliedChange> changes;
  std::vector<std::string> left_out;  // fields that each log sets anew: as they were
};

// `values`: of all of the model's parameters, SI. Elements of an included file that change take the place of its
// <include>. Errors: the MJCF cannot be read, lacks an element (it is made by <replicate> or <attach>), or would not
// move as the model does (a <frame> or a compiler option that text cannot follow); nothing is written.
Result<AppliedMjcf> ApplyToMjcf(const Model& model, std::span<const double> values, const ApplyOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_APPLY_H_

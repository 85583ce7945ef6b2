// What the name of a log's column says: who sends it, what it measures, in which unit, of which joint.
#ifndef GAPSCOPE_DRAFT_COLUMN_NAME_H_
#define GAPSCOPE_DRAFT_COLUMN_NAME_H_

#include <optional>
#include <string>
#include <vector>

namespace gapscope {

enum class Side { kUnknown, kCommand, kMeasured };
enum class Quantity { kUnknown, kAngle, kSpeed, kTorque, kElectric, kOther };  // kOther: a temperature, a flag

// "ArmAngle.deg", "q_des[3]" -> {arm, angle, deg}, {q, des, 3}: lower case, digits on their own.
std::vector<std::string> WordsOf(const std::string& name);

struct ColumnName {
  std::vector<std::string> words;
  Side side = Side::kUnknown;
  Quantity quantity = Quantity::kUnknown;
  std::string unit;  // as a name states it: "deg" of "arm_deg"; empty: it does not
  // Words that say neither side, quantity nor unit: the joint's name.
  std::vector<std::string> own;
  // A number that counts joints, and the name with '#' for it: columns of one stem are a family.
  std::optional<int> number;
  std::string stem;
  bool filtered = false;  // it says that it is a processed copy
};

// What members of a family share: the words but for the joint's name and number.
std::string FamilyOf(const ColumnName& name);

// "'q/*'" for a family: what is said of one of its members holds for all.
std::string LabelOf(const std::string& name, const ColumnName& said);

// Equal, or one is the other's usual letter: "l" and "left".
bool AreSameWord(const std::string& a, const std::string& b);

// All names of a log at once: which number of a name counts joints shows in its family.
std::vector<ColumnName> ReadNames(const std::vector<std::string>& names);

// How much a name speaks of an element: 1 all words of the element's name, less for some of them, 0 none. Words that
// many elements share ("joint", "motor") count where the name has no others. A number counts behind its word alone:
// "joint_pos[1]" is not of "joint1".
double NameMatch(const std::string& name, const std::string& element);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_COLUMN_NAME_H_

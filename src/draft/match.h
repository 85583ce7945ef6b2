// Columns matched with slots by what their names say: the best pair first.
#ifndef GAPSCOPE_DRAFT_MATCH_H_
#define GAPSCOPE_DRAFT_MATCH_H_

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "src/draft/pairing.h"

namespace gapscope {

inline constexpr double kByName = 1, kByKey = 0.93, kByNumber = 0.9, kByPart = 0.4, kByLooseNumber = 0.5;

// A place for one column.
struct Slot {
  std::vector<std::string> names;  // any of which a column may bear
  const Guess* like = nullptr;     // a column of the same joint: others with its own words and number belong to it
};

// Which slot a numbered column means: families of as many members as there are slots count them in order.
class Numbers {
 public:
  // `orders`: slots as the numbers may count them. Several orders are tried, the first of a family's size is taken. A
  // family with words that slots have ("left_arm_3") counts these slots.
  Numbers(const std::vector<Guess>& guesses, const std::vector<int>& candidates, const std::vector<Slot>& slots,
          std::vector<std::vector<int>> orders);
  // -1: it means none. `loose`: the family has another size than the orders.
  int SlotOf(const Guess& guess, bool* loose) const;

 private:
  // Orders of those slots alone that have the family's words: in front, then anywhere; all where no slot has one.
  std::vector<std::vector<int>> OrdersOf(const std::vector<std::string>& own) const;

  std::map<std::string, std::vector<int>> families_;          // stem: its numbers, ascending
  std::vector<std::vector<std::vector<std::string>>> words_;  // per slot, of each of its names
  std::vector<std::vector<int>> orders_;
};

// A score of a column in a slot; 0: it does not go there.
double Score(const Guess& guess, const Slot& slot, int slot_index, const Numbers& numbers);

// `bonus` is added to a score that is above zero.
std::vector<Pick> Match(const std::vector<Slot>& slots, const std::vector<int>& candidates, const Numbers& numbers,
                        const std::function<double(int slot, int candidate)>& bonus, std::vector<Guess>* guesses);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_MATCH_H_

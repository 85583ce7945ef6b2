#include "src/draft/match.h"

#include <algorithm>
#include <tuple>

namespace gapscope {
namespace {

constexpr double kNear = 0.12;  // a runner-up within this is named

std::string WhyOf(double score) {
  if (score >= kByNumber - kNear) return "";
  if (score >= kByLooseNumber - kNear / 2) return "its family has another size than the robot has joints";
  return "only a part of its name fits";
}

// A column of which no name tells what it measures is no rival of one that says it.
bool SaysAsMuch(const Guess& rival, const Guess& taken) {
  return rival.said.quantity != Quantity::kUnknown || taken.said.quantity == Quantity::kUnknown;
}

}  // namespace

Numbers::Numbers(const std::vector<Guess>& guesses, const std::vector<int>& candidates, const std::vector<Slot>& slots,
                 std::vector<std::vector<int>> orders)
    : orders_(std::move(orders)) {
  for (const Slot& slot : slots) {
    words_.emplace_back();
    for (const std::string& name : slot.names) words_.back().push_back(WordsOf(name));
  }
  for (const int c : candidates) {
    const ColumnName& said = guesses[c].said;
    if (said.number) families_[said.stem].push_back(*said.number);
  }
  for (auto& [stem, members] : families_) {
    std::ranges::sort(members);
    members.erase(std::unique(members.begin(), members.end()), members.end());
  }
}

int Numbers::SlotOf(const Guess& guess, bool* loose) const {
  *loose = false;
  if (!guess.said.number) return -1;
  const auto family = families_.find(guess.said.stem);
  if (family == families_.end()) return -1;
  const std::vector<int>& members = family->second;
  const auto rank = static_cast<std::size_t>(std::ranges::find(members, *guess.said.number) - members.begin());
  const std::vector<std::vector<int>> orders = OrdersOf(guess.said.own);
  for (const auto& order : orders) {
    if (order.size() == members.size()) return order[rank];
  }
  *loose = true;
  // One number alone counts nothing.
  const int first = members.front() == 0 ? 0 : 1;
  const int at = *guess.said.number - first;
  if (members.size() < 2 || orders.empty() || at < 0 || at >= static_cast<int>(orders.front().size())) return -1;
  return orders.front()[at];
}

std::vector<std::vector<int>> Numbers::OrdersOf(const std::vector<std::string>& own) const {
  const auto has = [](const std::vector<std::string>& words, const std::string& word) {
    return std::ranges::any_of(words, [&](const std::string& w) { return AreSameWord(w, word); });
  };
  const auto any_name = [&](int slot, const auto& fits) { return std::ranges::any_of(words_[slot], fits); };
  std::vector<std::string> shared;
  for (const std::string& word : own) {
    for (int slot = 0; slot < static_cast<int>(words_.size()); ++slot) {
      if (!any_name(slot, [&](const auto& words) { return has(words, word); })) continue;
      shared.push_back(word);
      break;
    }
  }
  if (shared.empty()) return orders_;
  std::vector<std::vector<int>> restricted;
  for (const bool in_front : {true, false}) {
    const auto fits = [&](const std::vector<std::string>& words) {
      if (in_front) return !words.empty() && has(shared, words.front());
      return std::ranges::all_of(shared, [&](const std::string& word) { return has(words, word); });
    };
    for (const std::vector<int>& order : orders_) {
      std::vector<int> slots;
      std::ranges::copy_if(order, std::back_inserter(slots), [&](int slot) { return any_name(slot, fits); });
      if (!slots.empty()) restricted.push_back(std::move(slots));
    }
  }
  return restricted;
}

double Score(const Guess& guess, const Slot& slot, int slot_index, const Numbers& numbers) {
  double score = 0;
  for (const std::string& name : slot.names) {
    const double match = NameMatch(guess.name, name);
    // Of two names that fit the longer one says more.
    if (match >= 0.95) score = std::max(score, kByName + 0.01 * static_cast<double>(WordsOf(name).size()));
    if (match > kByPart) score = std::max(score, kByPart + 0.3 * (match - kByPart));
  }
  bool loose = false;
  if (numbers.SlotOf(guess, &loose) == slot_index) score = std::max(score, loose ? kByLooseNumber : kByNumber);
  if (slot.like && guess.said.own == slot.like->said.own && guess.said.number == slot.like->said.number &&
      (!guess.said.own.empty() || guess.said.number))
    score = std::max(score, kByKey);
  if (score > 0 && guess.said.filtered) score -= 0.05;
  return score;
}

std::vector<Pick> Match(const std::vector<Slot>& slots, const std::vector<int>& candidates, const Numbers& numbers,
                        const std::function<double(int slot, int candidate)>& bonus, std::vector<Guess>* guesses) {
  std::vector<std::tuple<double, int, int>> pairs;
  for (int s = 0; s < static_cast<int>(slots.size()); ++s) {
    for (const int c : candidates) {
      const double score = Score((*guesses)[c], slots[s], s, numbers);
      if (const double all = score + bonus(s, c); score > 0 && all > 0) pairs.emplace_back(all, s, c);
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return get<0>(a) > get<0>(b); });
  std::vector<Pick> picks(slots.size());
  std::vector<double> scores(slots.size(), 0);
  for (const auto& [score, s, c] : pairs) {
    if (picks[s].column >= 0) {
      const bool near = scores[s] - score < kNear && SaysAsMuch((*guesses)[c], (*guesses)[picks[s].column]);
      if (picks[s].runner_up < 0 && near) picks[s].runner_up = c;
      continue;
    }
    if ((*guesses)[c].used) continue;
    (*guesses)[c].used = true;
    scores[s] = score;
    picks[s] = {.column = c, .runner_up = -1, .certain = score >= kByNumber - kNear, .why = WhyOf(score)};
  }
  // A column that went elsewhere is no rival.
  for (Pick& pick : picks) {
    if (pick.runner_up >= 0 && (*guesses)[pick.runner_up].used) pick.runner_up = -1;
  }
  return picks;
}

}  // namespace gapscope

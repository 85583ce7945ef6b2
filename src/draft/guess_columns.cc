#include "src/draft/guess_columns.h"

#include <cmath>
#include <map>

namespace gapscope {
namespace {

constexpr double kIsDerivative = 0.9;  // what no name says is a speed
constexpr std::size_t kFew = 4;
constexpr std::size_t kMostNameless = 150;  // columns whose data are compared with all others'

// Two columns that may be of one joint, one of them the other's command. Those of one family are of different joints;
// where there are few columns, names need not agree.
bool SameJoint(const Guess& a, const Guess& b, bool few) {
  const bool kin = FamilyOf(a.said) == FamilyOf(b.said) && !FamilyOf(a.said).empty() && a.said.own != b.said.own;
  if (a.said.number != b.said.number || kin) return false;
  return a.said.number ? a.said.stem != b.said.stem : a.said.own == b.said.own || few;
}

// A family is on one side: that of most of its members of which a side is known.
void SidesByFamily(std::vector<Guess>* guesses) {
  std::map<std::string, int> votes;
  for (const Guess& g : *guesses) {
    if (g.said.number && g.said.side != Side::kUnknown) votes[g.said.stem] += g.said.side == Side::kCommand ? 1 : -1;
  }
  for (Guess& g : *guesses) {
    const auto vote = votes.find(g.said.stem);
    if (!g.said.number || vote == votes.end() || vote->second == 0) continue;
    g.leads = g.leads || (g.said.side == Side::kUnknown && vote->second > 0);
    g.said.side = vote->second > 0 ? Side::kCommand : Side::kMeasured;
  }
}

// "q_d" or "q_t" beside "q": the desired one, or where it is the other's derivative its speed.
void SidesBySibling(const Samples& samples, std::vector<Guess>* guesses) {
  std::map<std::vector<std::string>, std::size_t> by_words;
  for (std::size_t i = 0; i < guesses->size(); ++i) by_words.emplace((*guesses)[i].said.words, i);
  for (Guess& g : *guesses) {
    if (g.said.side != Side::kUnknown || g.is_time) continue;
    for (const char* letter : {"d", "t"}) {
      std::vector<std::string> words = g.said.words;
      if (std::erase(words, letter) != 1 || !by_words.contains(words)) continue;
      Guess& sibling = (*guesses)[by_words[words]];
      if (sibling.said.side == Side::kCommand || sibling.is_time) continue;
      std::erase(g.said.own, letter);
      const FittedLine line = LineThrough(samples.slopes(sibling.column), samples.values(g.column));
      if (MayBe(g, Quantity::kAngle) && std::abs(line.correlation) > kIsDerivative) {
        g.said.quantity = Quantity::kSpeed;
      } else {
        g.said.side = Side::kCommand;
        sibling.said.side = Side::kMeasured;
      }
      break;
    }
  }
}

// A nameless column that is the derivative of another is a speed; of two nameless ones that move alike the one that
// leads is the command.
void ClassifyByData(const Samples& samples, std::vector<Guess>* guesses) {
  const std::vector<int> nameless = Select(*guesses, [&](const Guess& g) {
    return g.said.side == Side::kUnknown && MayBe(g, Quantity::kAngle) && samples.spread(g.column) > 0;
  });
  if (nameless.size() > kMostNameless) return;
  for (const int b : nameless) {
    for (const int a : nameless) {
      Guess &angle = (*guesses)[a], &speed = (*guesses)[b];
      if (a == b || speed.said.quantity != Quantity::kUnknown || angle.said.quantity == Quantity::kSpeed) continue;
      if (std::abs(LineThrough(samples.slopes(angle.column), samples.values(speed.column)).correlation) < kIsDerivative)
        continue;
      speed.said.quantity = Quantity::kSpeed;
      angle.said.quantity = Quantity::kAngle;
    }
  }
  for (const int a : nameless) {
    for (const int b : nameless) {
      Guess &leader = (*guesses)[a], &follower = (*guesses)[b];
      if (a == b || !SameJoint(leader, follower, nameless.size() <= kFew) || leader.said.side != Side::kUnknown)
        continue;
      if (!MayBe(leader, Quantity::kAngle) || !MayBe(follower, Quantity::kAngle)) continue;
      // "pos" leads "aux": it is the measured one.
      if (leader.said.quantity != Quantity::kUnknown && follower.said.quantity == Quantity::kUnknown) continue;
      if (follower.said.side == Side::kCommand || leader.name == follower.name) continue;
      const Following f = samples.Follow(leader.column, follower.column);
      if (std::abs(f.correlation) < kIsDerivative || !(f.lag_s > 0)) continue;
      leader.said.side = Side::kCommand;
      leader.leads = true;
      follower.said.side = Side::kMeasured;
    }
  }
  SidesByFamily(guesses);
}

}  // namespace

bool MayBe(const Guess& guess, Quantity quantity) {
  return !guess.is_time && (guess.said.quantity == quantity || guess.said.quantity == Quantity::kUnknown);
}

std::vector<Guess> GuessColumns(const Log& log, const Timeline& timeline, const Samples& samples) {
  const std::vector<ColumnName> said = ReadNames(log.ColumnNames());
  std::vector<Guess> guesses;
  guesses.reserve(said.size());
  for (std::size_t c = 0; c < said.size(); ++c) {
    guesses.push_back({.column = static_cast<int>(c),
                       .name = log.columns[c].name,
                       .said = said[c],
                       .file_unit = log.columns[c].unit,
                       .is_time = log.columns[c].name == timeline.time_column});
  }
  SidesBySibling(samples, &guesses);
  ClassifyByData(samples, &guesses);
  return guesses;
}

}  // namespace gapscope

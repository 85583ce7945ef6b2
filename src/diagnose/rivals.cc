#include "src/diagnose/rivals.h"

#include <algorithm>
#include <cmath>

#include "src/diagnose/beside.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"
#include "src/diagnose/rules.h"

namespace gapscope {
namespace {

class Rivals {
 public:
  Rivals(const Workbench& bench, SearchResult& found, Judgement* result)
      : bench_(bench), found_(found), result_(*result) {}

  void Tell() {
    AddRivals();
    AddRicher();
  }

  // What ties with a member beside others that have been left out since may have done their work: it is tried in the
  // set that is told.
  void AskAgain(const Say& say) {
    const EffectSet& set = found_.chosen->effects;
    for (Member& member : found_.members) {
      for (Rival& rival : member.rivals) {
        if (rival.behind > TieOf(member.gain)) continue;
        say("trying " + rival.use.Text() + " for " + member.use.Text());
        const Candidate* other = RefitInPlace(bench_, found_, {member.use}, rival.use, Effort::kTry);
        rival.behind = other ? Gain(*other, *found_.chosen) : kInfinity;
      }
      const Candidate* without = found_.ledger.FindOrTry(Without(set, member.use), *found_.chosen);
      if (without) member.gain = GainAboveNoise(*without, *found_.chosen);
    }
  }

 private:
  // As these logs and the base model have them.
  bool AreOne(const EffectUse& a, const EffectUse& b) const {
    return AreOneMotion(a, b, *found_.base->model, found_.logged);
  }

  // Whether it could be in the place of a member that the set leaves out: it then gains what that one gained.
  bool StandsIn(const EffectUse& use, const EffectSet& set) const {
    return std::any_of(found_.members.begin(), found_.members.end(), [&](const Member& member) {
      return !Has(set, member.use) &&
             (AreOne(use, member.use) || Imitated(found_.columns, member.use, use) >= kDiagnosePolicy.search.imitates);
    });
  }

  // By how much a set costs more with `use` in a member's place, where both are in the ledger. Infinite where the
  // member hardly gains: nothing at all would cost as little there.
  double BehindIn(const EffectSet& set, const EffectUse& member, const EffectUse& use) {
    const EffectSet rest = Without(set, member);
    const Candidate *own = found_.ledger.Find(set), *other = found_.ledger.Find(With(rest, use));
    if (!own || !other) return kInfinity;
    const Candidate* without = found_.ledger.FindOrTry(rest, *own);
    return without && Gain(*without, *own) >= kDiagnosePolicy.search.tie ? Gain(*other, *own) : kInfinity;
  }

  // What was tried in a member's place: by the search, or where the ledger has that set by another way. `present`: the
  // sure members, whose set is what remains in the end.
  std::vector<Rival> RivalsOf(const Member& member, const EffectSet& present) {
    std::vector<Rival> rivals;
    for (const EffectUse& use : found_.uses) {
      if (Has(found_.chosen->effects, use)) continue;
      double behind = AreOne(use, member.use) ? 0 : kInfinity;
      for (const Rival& tried : member.rivals) {
        if (tried.use == use) behind = std::min(behind, tried.behind);
      }
      const bool same = Contains(use, member.use, *bench_.rig, true) || Contains(member.use, use, *bench_.rig, true);
      if (!same) behind = std::min(behind, BehindIn(found_.chosen->effects, member.use, use));
      const bool is_sure = Has(present, member.use);
      if (!same && is_sure && !StandsIn(use, present)) behind = std::min(behind, BehindIn(present, member.use, use));
      if (std::isfinite(behind)) rivals.push_back({.use = use, .behind = behind});
    }
    std::stable_sort(rivals.begin(), rivals.end(), [](const Rival& a, const Rival& b) { return a.behind < b.behind; });
    return rivals;
  }

  // What costs as little in a member's place is told with it, and what the logs do not tell from that at all.
  void AddRivals() {
    EffectSet present;
    for (const Statement& s : result_.statements) {
      if (s.probability >= kDiagnosePolicy.probability.present) present = With(present, s.use);
    }
    // Sure ones first: what is there in one's place is not told as absent in another's.
    for (const bool sure : {true, false}) {
      for (std::size_t m = 0; m < found_.members.size(); ++m) {
        const Member& member = found_.members[m];
        if (Has(present, member.use) != sure) continue;
        const std::vector<Rival> rivals = RivalsOf(member, present);
        result_.statements[m].rivals = rivals;
        TellEach(member, rivals);
      }
    }
  }

  void TellEach(const Member& member, const std::vector<Rival>& rivals) {
    for (const Rival& rival : rivals) {
      if (!AreOne(rival.use, member.use) && rival.behind > TieOf(member.gain)) continue;
      if (IsLessLikely(rival.use, member.use, *found_.base->model)) continue;
      TellWith(member.use, rival.use, "costs as little in its place");
      for (const EffectUse& use : found_.uses) {
        if (!Has(found_.chosen->effects, use) && AreOne(use, rival.use))
          TellWith(member.use, use, "is one motion with " + rival.use.Text());
      }
    }
  }

  // A simpler effect is told alone only where the logs would show what a richer one usually does beyond it.
  void AddRicher() {
    std::vector<Beyond> asked;
    for (const Member& member : found_.members) {
      const Statement& own = *result_.Find(member.use);
      if (own.probability < kDiagnosePolicy.probability.present) continue;
      for (const EffectUse& use : found_.uses) {
        const bool is_told = own.group >= 0 && Has(result_.groups[static_cast<std::size_t>(own.group)], use);
        if (Contains(use, member.use, *bench_.rig, true) && !found_.HasMember(use) && !is_told)
          asked.push_back({.simpler = member.use, .richer = use});
      }
    }
    for (const Beyond& one : NotExcluded(bench_, *found_.chosen, asked))
      TellWith(one.simpler, one.richer, "would not show in these logs beyond " + one.simpler.Text());
  }

  // Told together with a member, as likely. Where that is not likely, not what is told already.
  void TellWith(const EffectUse& member, const EffectUse& use, const std::string& rule) {
    Statement& own = *result_.Find(member);
    if (own.probability < kDiagnosePolicy.probability.present && result_.Find(use)) return;
    if (own.group < 0) {
      own.group = static_cast<int>(result_.groups.size());
      result_.groups.push_back({own.use});
    }
    auto& group = result_.groups[static_cast<std::size_t>(own.group)];
    if (Has(group, use)) return;
    group.push_back(use);
    Statement other{.use = use,
                    .probability = AtPrior(own.evidence, bench_.PriorOf(use)),
                    .prior = bench_.PriorOf(use),
                    .evidence = own.evidence,
                    .group = own.group,
                    .beside = own.beside,
                    .numbers = own.numbers,
                    .sets = own.sets,
                    .rule = rule};
    result_.statements.push_back(std::move(other));
  }

  const Workbench& bench_;
  SearchResult& found_;
  Judgement& result_;
};

}  // namespace

void TellRivals(const Workbench& bench, SearchResult& found, bool anew, const Say& say, Judgement* result) {
  Rivals rivals(bench, found, result);
  if (anew) rivals.AskAgain(say);
  rivals.Tell();
}

}  // namespace gapscope

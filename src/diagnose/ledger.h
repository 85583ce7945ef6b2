// Every set of effects that was refitted, each once: the best fit so far stands for the set.
#ifndef GAPSCOPE_DIAGNOSE_LEDGER_H_
#define GAPSCOPE_DIAGNOSE_LEDGER_H_

#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "src/core/statistics.h"
#include "src/diagnose/candidate.h"

namespace gapscope {

using EffectSet = std::vector<EffectUse>;  // sorted
EffectSet Without(const EffectSet& set, const EffectUse& use);
EffectSet Without(const EffectSet& set, const std::vector<EffectUse>& uses);
EffectSet With(const EffectSet& set, const EffectUse& use);

// How far a fit goes: far enough to see whether it leads anywhere, to compare it, to its end.
enum class Effort { kTaste, kTry, kFinish };

class Ledger {
 public:
  explicit Ledger(const Workbench& bench) : bench_(bench) {}  // must outlive this

  // Null: the set was not refitted, or cannot be.
  Candidate* Find(const EffectSet& set) const;
  // Where it was not refitted, it is tried from there.
  Candidate* FindOrTry(const EffectSet& set, const Candidate& from);
  // Every set that could be fitted, in the order of effects.
  std::vector<Candidate*> All() const;
  // Fits the set from another set's solution; `values`: of effects that the other one lacks, by the names of their
  // parameters; `dy`: a step of the other one's y (empty: none). Keeps the better of this fit and an earlier one. A set
  // that ends above one of its own subsets is fitted again from there. Null: it cannot be built or simulated.
  Candidate* Refit(const EffectSet& set, const Candidate& from, const std::map<std::string, double>& values,
                   const Eigen::VectorXd& dy, Effort effort);
  // Forgets all sets, before the first of them is pointed to.
  void Clear();
  // Fits on from where the set is: above `reach` only as fast as would lead below it.
  void Continue(Candidate* candidate, Effort effort, double reach = kInfinity);
  // From where the size of each effect with a hidden mass is smaller or larger: blows leave kinks that a fit ends at.
  void LookAside(Candidate* candidate);

 private:
  struct Start {
    FitPoint point;
    const Candidate* from = nullptr;  // whose Jacobian, if it has one, the first steps are made with; null: none
    double cost = kInfinity;          // there
  };
  Start StartFrom(const Candidate& candidate, const Candidate& from, const std::vector<double>& values,
                  const Eigen::VectorXd& dy) const;
  // Null: no subset was fitted.
  const Candidate* BestSubset(const Candidate& candidate) const;
  Start StartFromSubset(const Candidate& candidate, const Candidate& part) const;
  // From where another shape of the effects that `from` lacks makes their torque (EffectParameter::takes_over).
  void StartFromOtherShapes(Candidate* candidate, const Candidate& from, Effort effort);
  // From where the candidate is, with other values.
  void TryWith(Candidate* candidate, const std::vector<double>& values, Effort effort);
  void Try(Candidate* candidate, const Start& start, Effort effort, double reach = kInfinity);
  // Jacobians are large: only those of the last few fits are kept.
  void Remember(Candidate* candidate);

  const Workbench& bench_;
  std::map<EffectSet, std::unique_ptr<Candidate>> fitted_;
  std::deque<Candidate*> remembered_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_LEDGER_H_

// The numbers that statements rest on: sets with and without effects, both refitted, on logs that were fitted and on
// those that were not, in free runs, and beside random torques.
#ifndef GAPSCOPE_DIAGNOSE_EVIDENCE_H_
#define GAPSCOPE_DIAGNOSE_EVIDENCE_H_

#include <set>
#include <vector>

#include "src/diagnose/columns.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

class Evidence {
 public:
  // Both must outlive this.
  Evidence(const Workbench& bench, SearchResult& found);

  // A statement's numbers, and the sets that they were taken from: of members of the chosen set, taken out as a whole.
  void Of(const std::vector<EffectUse>& uses, Statement* statement);
  // Of what the chosen set has more than another one, `uses` for it.
  void Of(const std::vector<EffectUse>& uses, Candidate* without, Statement* statement);
  // Another set becomes the chosen one.
  void Choose(Candidate* candidate);
  const FreeRuns& free_left() const { return free_left_; }  // of the chosen set

 private:
  // A fit that is not at its end promises, by its columns, what it does not reach. Once each.
  void Compare(Candidate* candidate);
  // What kind of effect the numbers are of.
  void SetCharacter(const std::vector<EffectUse>& uses, StatementNumbers* numbers) const;
  // What the chosen set leaves, with the torques' columns.
  const ColumnTable& Left();

  const Workbench& bench_;
  SearchResult& found_;
  std::vector<ProbeTorque> torques_;
  FreeRuns free_left_;
  std::set<const Candidate*> compared_;
  ColumnTable left_;
  const Candidate* left_of_ = nullptr;  // whose table that is
};

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_EVIDENCE_H_

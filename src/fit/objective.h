// A fit's cost as an optimiser sees it, and the same with a journal around it.
#ifndef GAPSCOPE_FIT_OBJECTIVE_H_
#define GAPSCOPE_FIT_OBJECTIVE_H_

#include "src/fit/journal.h"
#include "src/fit/normal_equations.h"

namespace gapscope {

class Objective {
 public:
  virtual ~Objective() = default;
  virtual Evaluation Evaluate(const FitPoint& point, Keep keep) = 0;
  virtual Linearization Linearize(const FitPoint& point, const DifferenceOptions& options) = 0;
};

class ProblemObjective : public Objective {
 public:
  explicit ProblemObjective(FitProblem& problem) : problem_(problem) {}  // must outlive this
  Evaluation Evaluate(const FitPoint& point, Keep keep) override { return problem_.Evaluate(point, keep); }
  Linearization Linearize(const FitPoint& point, const DifferenceOptions& options) override {
    return gapscope::Linearize(problem_, point, options);
  }

 private:
  FitProblem& problem_;
};

// Results are recorded, and taken from the journal as long as the same calls come in the same order. A result of the
// journal has no residuals.
class JournaledObjective : public Objective {
 public:
  JournaledObjective(Objective& inner, Journal& journal) : inner_(inner), journal_(journal) {}  // must outlive this
  Evaluation Evaluate(const FitPoint& point, Keep keep) override;
  Linearization Linearize(const FitPoint& point, const DifferenceOptions& options) override;

 private:
  Objective& inner_;
  Journal& journal_;
};

// As gapscope::SolveStates, every linearization asked of the objective.
FitPoint SolveStates(const FitProblem& problem, Objective& objective, FitPoint point, int steps, Work* work);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_OBJECTIVE_H_

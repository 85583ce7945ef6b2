// What effects, and random torques, would add to the residuals of a fitted model, as columns: sets of effects are then
// compared by arithmetic.
#ifndef GAPSCOPE_DIAGNOSE_COLUMNS_H_
#define GAPSCOPE_DIAGNOSE_COLUMNS_H_

#include <map>
#include <memory>
#include <vector>

#include "src/diagnose/candidate.h"
#include "src/fit/gram.h"

namespace gapscope {

// An effect at trial values of its parameters. Where two of them act linearly together (Parameter::with) it has two
// columns, else one.
struct Trial {
  enum class Form {
    kSize,   // coefficient: how far the sizes go from neutral to the trial values
    kAngle,  // coefficients: cosine and sine of the angle, times the size
    kRest,   // coefficients: the size, and the size times its rest
  };
  EffectUse use;
  std::size_t effect = 0;  // trials of one effect have the same number
  Form form = Form::kSize;
  std::vector<double> values;  // of PlacedParameters
  std::vector<Eigen::Index> columns;
};

struct ColumnTable {
  std::vector<Trial> trials;
  std::vector<Eigen::Index> torques;  // columns of random torques
  GramSystem gram;                    // its parts are in `sum` alone, but those of MakeFolds and MakeByLimb
  Eigen::MatrixXd sum;
  ColumnBounds bounds;
  Eigen::MatrixXd reduced;  // of the columns beside y, and the residual: y, with what is known of it, taken out
  double cost = 0;          // of the parent, y at its optimum as the columns see it
  bool valid = false;
  std::vector<Eigen::Index> FreeCoordinates() const;  // of y: those that no bound holds
  Eigen::Index Reduced(Eigen::Index column) const { return column - gram.parameters; }
};

// Columns of `uses` at all their trial values, and of `torques`, at the parent's point. What cannot be simulated has no
// trial. `scan`: a table at the base model, null: none; an effect of very many trials is tried at those that did best
// there (SearchPolicy::scan).
ColumnTable MakeColumns(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses,
                        const std::vector<ProbeTorque>& torques, const ColumnTable* scan = nullptr);
// Replays that the columns of `uses` take at the base model, where none can be made together.
std::size_t ColumnCount(const Workbench& bench, const std::vector<EffectUse>& uses);
// A set that could be in a parent's place, with an effect that the parent lacks, at each list of its values.
struct InPlace {
  Candidate child;
  EffectUse use;
  std::vector<std::vector<double>> values;
};
// Columns of such sets, less the parent, and of `torques`. Trial::effect: which child.
ColumnTable MakeInPlace(const Workbench& bench, Candidate& parent, std::vector<InPlace>& children,
                        const std::vector<ProbeTorque>& torques);
// Columns of torques alone, their products apart by two folds of each log (GramSystem::parts): two seconds in turn.
inline constexpr std::size_t kFolds = 2;
ColumnTable MakeFolds(const Workbench& bench, Candidate& parent, const std::vector<ProbeTorque>& torques);
// Likewise apart by limbs (Coupling::LimbOf); of one limb there are no parts.
ColumnTable MakeByLimb(const Workbench& bench, Candidate& parent, const std::vector<ProbeTorque>& torques);
// ColumnTable::reduced of a part's products.
Eigen::MatrixXd Reduce(const ColumnTable& table, const Eigen::MatrixXd& products);
// Values of an effect's parameters (in the order of PlacedParameters) at coefficients of its columns.
std::vector<double> ValuesAt(const Workbench& bench, const Trial& trial, std::span<const double> coefficients);

// A set of trials with its best cost by arithmetic.
struct TrialSet {
  std::vector<std::size_t> trials;  // indices in the table, each of another effect
  double cost = 0;
};
// The cheapest sets of each size up to `most`, cheapest first: sets[0] has single trials. Trials of one effect beside
// the same others count once, by the best.
std::vector<std::vector<TrialSet>> BeamSearch(const ColumnTable& table, std::size_t most, std::size_t width);
// Cost of one set.
double SetCost(const ColumnTable& table, const std::vector<std::size_t>& trials);
// The trial of the use that costs least beside others; the number of trials: it has none.
std::size_t BestTrial(const ColumnTable& table, const EffectUse& use, std::vector<std::size_t> beside);
// Coefficients of the set's columns, and y's step, y inside its bounds.
BoundedSolution SolveSet(const ColumnTable& table, const std::vector<std::size_t>& trials);

// Share of a trial's column (its larger one) that another effect's columns hold, y taken out.
double Imitated(const ColumnTable& table, const Trial& trial, const Trial& by);
// The most of any of their trials.
double Imitated(const ColumnTable& table, const EffectUse& use, const EffectUse& by);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_COLUMNS_H_

#include "src/diagnose/columns.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/diagnose/policy.h"

namespace gapscope {

// y taken out of all other columns; coordinates on a bound stay there.
Eigen::MatrixXd Reduce(const ColumnTable& table, const Eigen::MatrixXd& products) {
  const Eigen::Index n = table.gram.parameters, rest = products.cols() - n;
  const std::vector<Eigen::Index> free = table.FreeCoordinates();
  const auto f = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd own(f, f), cross(f, rest);
  for (Eigen::Index a = 0; a < f; ++a) {
    const Eigen::Index i = free[static_cast<std::size_t>(a)];
    for (Eigen::Index b = 0; b < f; ++b) own(a, b) = products(i, free[static_cast<std::size_t>(b)]);
    own(a, a) += table.bounds.prior_weight[i];
    cross.row(a) = products.row(i).tail(rest);
    cross(a, rest - 1) += table.bounds.prior_weight[i] * table.bounds.prior_gone[i];
  }
  Eigen::MatrixXd reduced = products.bottomRightCorner(rest, rest);
  reduced(rest - 1, rest - 1) += table.bounds.prior_weight.cwiseProduct(table.bounds.prior_gone.cwiseAbs2()).sum();
  if (f > 0) reduced -= cross.transpose() * Ldlt(own).Solve(cross);
  return reduced;
}

namespace {

constexpr double kMostSize = 2.5, kMostPart = 4;  // times the trial value

// The two parameters that act linearly together, by their places in the list; -1: there are none.
struct Pair {
  int size = -1, other = -1;
  Parameter::With with = Parameter::With::kNone;
};

Pair PairOf(const EffectUse& use, const Rig& rig) {
  const Effect& effect = EffectOf(use, rig);
  for (std::size_t i = 0; i < effect.parameters.size(); ++i) {
    if (effect.parameters[i].with != Parameter::With::kNone)
      return {.size = 0, .other = static_cast<int>(i), .with = effect.parameters[i].with};
  }
  return {};
}

// All combinations of trial values. The angle, or rest, of a pair has none: its columns span them.
std::vector<std::vector<double>> Combinations(const std::vector<PlacedParameter>& placed, const Pair& pair) {
  std::vector<std::vector<double>> all = {{}};
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const PlacedParameter& p = placed[i];
    std::vector<double> values = p.trials.empty() ? std::vector<double>{p.start} : p.trials;
    if (static_cast<int>(i) == pair.other) values = {0};
    // A torque that acts linearly looks the same at every size, but where it changes the motion itself.
    if (static_cast<int>(i) == pair.size && values.size() > 2) values = {values.front(), values.back()};
    std::vector<std::vector<double>> next;
    for (const auto& head : all) {
      for (const double value : values) {
        next.push_back(head);
        next.back().push_back(value);
      }
    }
    all = std::move(next);
  }
  std::erase_if(all, [&](const auto& values) {
    for (std::size_t i = 0; i < placed.size(); ++i) {
      if (!placed[i].trials.empty() && placed[i].role != ParameterRole::kPlace && values[i] != placed[i].neutral)
        return false;
    }
    return true;
  });
  return all;
}

// Columns that wait for their gram.
struct Wanted {
  std::vector<Trial> trials;
  std::vector<ExtraColumn> columns;
  Eigen::Index first = 0;  // of the extra columns
};

// Trial values of an effect: all, or of very many those that did best at the base model.
std::vector<std::vector<double>> TrialValues(const Workbench& bench, const EffectUse& use, const ColumnTable* scan) {
  const SearchPolicy& policy = kDiagnosePolicy.search;
  auto all = Combinations(PlacedParameters(use, *bench.rig, bench.scales), PairOf(use, *bench.rig));
  if (!scan || all.size() <= policy.scan) return all;
  std::vector<std::pair<double, std::vector<double>>> ranked;
  for (std::size_t t = 0; t < scan->trials.size(); ++t) {
    if (scan->trials[t].use == use) ranked.emplace_back(SetCost(*scan, {t}), scan->trials[t].values);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  all.clear();
  for (auto& [cost, values] : ranked) {
    if (all.size() < policy.scanned) all.push_back(std::move(values));
  }
  return all;
}

// One effect of a child model, its trials, and the values of its parameters for each of their columns.
struct Asked {
  EffectUse use;
  MovedSignals moved;
  std::vector<Trial> trials;
  std::vector<std::vector<double>> columns;
  std::vector<std::size_t> of_trial;  // each column's

  // Of the trial that comes next.
  void AddColumn(std::vector<double> values) {
    columns.push_back(std::move(values));
    of_trial.push_back(trials.size());
  }
};

Asked Ask(const Workbench& bench, const EffectUse& use, std::size_t effect, const ColumnTable* scan) {
  Asked asked{.use = use, .moved = bench.coupling->OfPlace(use.on, *bench.rig)};
  const auto placed = PlacedParameters(use, *bench.rig, bench.scales);
  const Pair pair = PairOf(use, *bench.rig);
  for (const auto& values : TrialValues(bench, use, scan)) {
    Trial trial{.use = use, .effect = effect, .values = values};
    asked.AddColumn(values);
    if (pair.other >= 0) {
      const auto other = static_cast<std::size_t>(pair.other);
      const bool angle = pair.with == Parameter::With::kAngle;
      trial.form = angle ? Trial::Form::kAngle : Trial::Form::kRest;
      std::vector<double> turned = values;
      turned[other] =
          angle ? std::numbers::pi / 2 : *std::max_element(placed[other].trials.begin(), placed[other].trials.end());
      asked.AddColumn(std::move(turned));
    }
    asked.trials.push_back(std::move(trial));
  }
  return asked;
}

// Column by column of the group's effects together.
void AddTrials(const Workbench& bench, Candidate& child, std::vector<Asked> group, Wanted* wanted) {
  const std::vector<double> neutral = bench.Nominal(*child.model);
  const auto set = [&](const Asked& asked, std::size_t column, std::vector<double>* values) {
    const auto placed = PlacedParameters(asked.use, *bench.rig, bench.scales);
    for (std::size_t i = 0; i < placed.size(); ++i)
      (*values)[static_cast<std::size_t>(child.model->IndexOf(placed[i].name))] = asked.columns[column][i];
  };
  std::size_t most = 0;
  for (const Asked& asked : group) most = std::max(most, asked.columns.size());
  for (std::size_t column = 0; column < most; ++column) {
    std::vector<double> together = neutral;
    for (const Asked& asked : group) {
      if (column < asked.columns.size()) set(asked, column, &together);
    }
    for (Asked& asked : group) {
      if (column >= asked.columns.size()) continue;
      ExtraColumn extra{.name = asked.use.Text(), .child = child.problem.get(), .values = together};
      if (group.size() > 1) {
        extra.moved = asked.moved;
        extra.own_values = neutral;
        set(asked, column, &extra.own_values);
      }
      asked.trials[asked.of_trial[column]].columns.push_back(wanted->first +
                                                             static_cast<Eigen::Index>(wanted->columns.size()));
      wanted->columns.push_back(std::move(extra));
    }
  }
  for (Asked& asked : group) std::move(asked.trials.begin(), asked.trials.end(), std::back_inserter(wanted->trials));
}

// Torques on joints that do not touch, in one replay.
void AddTorques(const Workbench& bench, Candidate& parent, const std::vector<ProbeTorque>& torques, Wanted* wanted,
                ColumnTable* table) {
  const mjModel& m = parent.model->compiled();
  std::map<int, std::vector<ProbeTorque>> of_joint;
  for (const ProbeTorque& torque : torques) of_joint[torque.joint].push_back(torque);
  std::vector<std::vector<ProbeTorque>> lists;
  std::vector<MovedSignals> moved;
  for (auto& [joint, list] : of_joint) {
    lists.push_back(std::move(list));
    moved.push_back(bench.coupling->OfPlace(mj_id2name(&m, mjOBJ_JOINT, joint), *bench.rig));
  }
  for (const auto& group : ApartGroups(moved)) {
    for (std::size_t i = 0; i < lists[group.front()].size(); ++i) {
      const auto probes = Collect(group, [&](std::size_t joint) { return lists[joint][i]; });
      for (std::size_t k = 0; k < group.size(); ++k) {
        table->torques.push_back(wanted->first + static_cast<Eigen::Index>(wanted->columns.size()));
        ExtraColumn extra{.name = "torque", .child = parent.problem.get(), .values = parent.values, .probes = probes};
        if (group.size() > 1) {
          extra.moved = moved[group[k]];
          extra.own_values = parent.values;
          extra.own_probes = {probes[k]};
        }
        wanted->columns.push_back(std::move(extra));
      }
    }
  }
}

// A size and its rest: the second column becomes that of the rest alone.
void TakeRestApart(const ColumnTable& table, Eigen::MatrixXd* sum) {
  for (const Trial& trial : table.trials) {
    if (trial.form != Trial::Form::kRest) continue;
    const Eigen::Index size = trial.columns[0], rest = trial.columns[1];
    sum->col(rest) -= sum->col(size);
    sum->row(rest) -= sum->row(size);
  }
}

ColumnBounds BoundsOf(const ColumnTable& table, const FitProblem& problem, const FitPoint& point) {
  ColumnBounds bounds = BoundsAt(problem, point, table.gram, kMostSize);
  for (const Trial& trial : table.trials) {
    for (std::size_t c = 0; c < trial.columns.size(); ++c) {
      const bool both_signs = trial.form == Trial::Form::kAngle || (trial.form == Trial::Form::kRest && c == 1);
      bounds.low[trial.columns[c]] = both_signs ? -kMostPart : 0;
      bounds.high[trial.columns[c]] = both_signs ? kMostPart : kMostSize;
    }
  }
  for (const Eigen::Index torque : table.torques) {
    bounds.low[torque] = -1e6;
    bounds.high[torque] = 1e6;
  }
  return bounds;
}

// Of all parts together; a single part is not kept beside it, since there may be thousands of columns.
Eigen::MatrixXd TakeSum(GramSystem* gram) {
  Eigen::MatrixXd sum = std::move(gram->parts.front());
  if (gram->parts.size() > 1) gram->parts.front() = sum;
  for (std::size_t p = 1; p < gram->parts.size(); ++p) sum += gram->parts[p];
  if (gram->parts.size() == 1) gram->parts.clear();
  return sum;
}

ColumnTable Finish(const Workbench& bench, Candidate& parent, Wanted wanted, const std::vector<ProbeTorque>& torques,
                   const GramParts& parts = {}) {
  ColumnTable table{.trials = std::move(wanted.trials)};
  AddTorques(bench, parent, torques, &wanted, &table);
  const auto make = [&] {
    // Not with the fit's own Jacobian, which is too fine to look ahead.
    return MakeGram(*parent.problem, parent.point, wanted.columns, {.step = 0.01, .steps = StepKind::kQuick}, parts,
                    bench.deadline.stop);
  };
  table.gram = bench.journal ? bench.journal->Gram("columns " + parent.Name(), parent.point,
                                                   ColumnNames(*parent.problem, wanted.columns), make)
                             : make();
  *bench.work += table.gram.work;
  if (!table.gram.valid) return table;
  std::erase_if(table.trials, [&](const Trial& trial) {
    return std::any_of(trial.columns.begin(), trial.columns.end(),
                       [&](Eigen::Index c) { return table.gram.failed[static_cast<std::size_t>(c - wanted.first)]; });
  });
  table.sum = TakeSum(&table.gram);
  TakeRestApart(table, &table.sum);
  table.bounds = BoundsOf(table, *parent.problem, parent.point);
  table.reduced = Reduce(table, table.sum);
  table.cost = 0.5 * table.reduced(table.reduced.rows() - 1, table.reduced.cols() - 1);
  table.valid = true;
  return table;
}

Wanted WantedOf(const Candidate& parent) { return {.first = parent.problem->layout().low.size()}; }

// Numbers of uses that are looked at together: one effect on places that do not touch.
std::vector<std::vector<std::size_t>> GroupsOf(const Workbench& bench, const std::vector<EffectUse>& have,
                                               const std::vector<EffectUse>& uses) {
  std::vector<std::pair<const Effect*, std::vector<std::size_t>>> effects;
  for (std::size_t u = 0; u < uses.size(); ++u) {
    if (Has(have, uses[u])) continue;
    const Effect* effect = &EffectOf(uses[u], *bench.rig);
    if (effects.empty() || effects.back().first != effect) effects.emplace_back(effect, std::vector<std::size_t>());
    effects.back().second.push_back(u);
  }
  std::vector<std::vector<std::size_t>> groups;
  for (const auto& [effect, numbers] : effects) {
    const auto moved = Collect(numbers, [&](std::size_t u) { return bench.coupling->OfPlace(uses[u].on, *bench.rig); });
    for (const auto& group : ApartGroups(moved))
      groups.push_back(Collect(group, [&](std::size_t i) { return numbers[i]; }));
  }
  return groups;
}

}  // namespace

ColumnTable MakeColumns(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses,
                        const std::vector<ProbeTorque>& torques, const ColumnTable* scan) {
  Wanted wanted = WantedOf(parent);
  std::vector<std::unique_ptr<Candidate>> children;  // until the columns are made
  const auto add = [&](const std::vector<std::size_t>& group) {
    std::vector<EffectUse> effects = parent.effects;
    for (const std::size_t u : group) effects.push_back(uses[u]);
    auto made = MakeCandidate(bench, effects);
    if (!made.ok()) return false;
    children.push_back(std::make_unique<Candidate>(std::move(made).value()));
    AddTrials(bench, *children.back(), Collect(group, [&](std::size_t u) { return Ask(bench, uses[u], u, scan); }),
              &wanted);
    return true;
  };
  for (const auto& group : GroupsOf(bench, parent.effects, uses)) {
    if (add(group) || group.size() == 1) continue;
    for (const std::size_t u : group) add({u});
  }
  return Finish(bench, parent, std::move(wanted), torques);
}

std::size_t ColumnCount(const Workbench& bench, const std::vector<EffectUse>& uses) {
  std::size_t count = 0;
  for (const EffectUse& use : uses) count += Ask(bench, use, 0, nullptr).columns.size();
  return count;
}

ColumnTable MakeInPlace(const Workbench& bench, Candidate& parent, std::vector<InPlace>& children,
                        const std::vector<ProbeTorque>& torques) {
  Wanted wanted = WantedOf(parent);
  for (std::size_t i = 0; i < children.size(); ++i) {
    Asked asked{.use = children[i].use, .moved = {}};
    for (const auto& values : children[i].values) {
      asked.AddColumn(values);
      asked.trials.push_back({.use = asked.use, .effect = i, .values = values});
    }
    AddTrials(bench, children[i].child, {std::move(asked)}, &wanted);
  }
  return Finish(bench, parent, std::move(wanted), torques);
}

ColumnTable MakeFolds(const Workbench& bench, Candidate& parent, const std::vector<ProbeTorque>& torques) {
  constexpr long kHalfSeconds = 4;
  return Finish(bench, parent, WantedOf(parent), torques,
                {.count = kFolds, .of = [](std::size_t log, long half_second, std::size_t) {
                   return (static_cast<std::size_t>(half_second / kHalfSeconds) + log) % kFolds;
                 }});
}

ColumnTable MakeByLimb(const Workbench& bench, Candidate& parent, const std::vector<ProbeTorque>& torques) {
  const Coupling& coupling = *bench.coupling;
  return Finish(bench, parent, WantedOf(parent), torques,
                {.count = coupling.limb_count(),
                 .of = [&](std::size_t, long, std::size_t signal) { return coupling.LimbOf(signal); }});
}

std::vector<Eigen::Index> ColumnTable::FreeCoordinates() const {
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < gram.parameters; ++i) {
    const double room = std::min(-bounds.low[i], bounds.high[i]);
    if (room > 1e-6 * (bounds.high[i] - bounds.low[i])) free.push_back(i);
  }
  return free;
}

std::vector<double> ValuesAt(const Workbench& bench, const Trial& trial, std::span<const double> c) {
  constexpr double kLeastScale = 0.3, kMostScale = 2;
  const auto placed = PlacedParameters(trial.use, *bench.rig, bench.scales);
  std::vector<double> values = trial.values;
  if (trial.form == Trial::Form::kSize) {
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const PlacedParameter& p = placed[i];
      if (p.trials.empty() || p.role == ParameterRole::kPlace || p.neutral == p.high) continue;
      values[i] = p.neutral + std::clamp(c[0], kLeastScale, kMostScale) * (values[i] - p.neutral);
    }
  } else {
    const auto other = static_cast<std::size_t>(PairOf(trial.use, *bench.rig).other);
    if (trial.form == Trial::Form::kAngle) {
      values[0] *= std::hypot(c[0], c[1]);
      values[other] = std::atan2(c[1], c[0]);
    } else {
      const double unit = *std::max_element(placed[other].trials.begin(), placed[other].trials.end());
      const double size = std::max(c[0], 0.02);
      values[0] *= size;
      values[other] = unit * c[1] / size;
    }
  }
  for (std::size_t i = 0; i < placed.size(); ++i) values[i] = std::clamp(values[i], placed[i].low, placed[i].high);
  return values;
}

namespace {

// Indices of a set's columns in the reduced matrix.
std::vector<Eigen::Index> ReducedColumns(const ColumnTable& table, const std::vector<std::size_t>& trials) {
  std::vector<Eigen::Index> columns;
  for (const std::size_t t : trials) {
    for (const Eigen::Index c : table.trials[t].columns) columns.push_back(table.Reduced(c));
  }
  return columns;
}

ColumnBounds ReducedBounds(const ColumnTable& table) {
  const Eigen::Index count = table.reduced.cols() - 1;
  return {.low = table.bounds.low.tail(count),
          .high = table.bounds.high.tail(count),
          .prior_weight = Eigen::VectorXd::Zero(count),
          .prior_gone = Eigen::VectorXd::Zero(count)};
}

}  // namespace

double SetCost(const ColumnTable& table, const std::vector<std::size_t>& trials) {
  return SolveBounded(table.reduced, ReducedColumns(table, trials), ReducedBounds(table)).cost;
}

std::vector<std::vector<TrialSet>> BeamSearch(const ColumnTable& table, std::size_t most, std::size_t width) {
  std::vector<std::vector<TrialSet>> levels;
  std::vector<TrialSet> heads = {{.trials = {}, .cost = table.cost}};
  const ColumnBounds bounds = ReducedBounds(table);
  for (std::size_t size = 1; size <= most; ++size) {
    std::map<std::vector<std::size_t>, TrialSet> best;  // by the effects' numbers
    for (const TrialSet& head : heads) {
      for (std::size_t t = 0; t < table.trials.size(); ++t) {
        auto effects = Collect(head.trials, [&](std::size_t i) { return table.trials[i].effect; });
        if (std::find(effects.begin(), effects.end(), table.trials[t].effect) != effects.end()) continue;
        effects.push_back(table.trials[t].effect);
        std::sort(effects.begin(), effects.end());
        TrialSet set{.trials = head.trials};
        set.trials.push_back(t);
        set.cost = SolveBounded(table.reduced, ReducedColumns(table, set.trials), bounds).cost;
        const auto [place, fresh] = best.try_emplace(std::move(effects), set);
        if (!fresh && set.cost < place->second.cost) place->second = std::move(set);
      }
    }
    auto level = Collect(best, [](const auto& entry) { return entry.second; });
    std::stable_sort(level.begin(), level.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
    if (level.size() > width && size > 1) level.resize(width);
    heads.assign(level.begin(), level.begin() + static_cast<long>(std::min(width, level.size())));
    levels.push_back(std::move(level));
  }
  return levels;
}

std::size_t BestTrial(const ColumnTable& table, const EffectUse& use, std::vector<std::size_t> beside) {
  std::size_t best = table.trials.size();
  double least = kInfinity;
  beside.push_back(best);
  for (std::size_t t = 0; t < table.trials.size(); ++t) {
    if (table.trials[t].use != use) continue;
    beside.back() = t;
    if (const double cost = SetCost(table, beside); cost < least) least = cost, best = t;
  }
  return best;
}

BoundedSolution SolveSet(const ColumnTable& table, const std::vector<std::size_t>& trials) {
  std::vector<Eigen::Index> set(static_cast<std::size_t>(table.gram.parameters));
  std::iota(set.begin(), set.end(), 0);
  for (const std::size_t t : trials) {
    for (const Eigen::Index c : table.trials[t].columns) set.push_back(c);
  }
  return SolveBounded(table.sum, set, table.bounds);
}

double Imitated(const ColumnTable& table, const Trial& trial, const Trial& by) {
  Eigen::Index column = table.Reduced(trial.columns.front());
  for (const Eigen::Index c : trial.columns) {
    if (table.reduced(table.Reduced(c), table.Reduced(c)) > table.reduced(column, column)) column = table.Reduced(c);
  }
  const double own = table.reduced(column, column);
  if (!(own > 0)) return 1;
  const auto k = static_cast<Eigen::Index>(by.columns.size());
  Eigen::MatrixXd square(k, k);
  Eigen::VectorXd cross(k);
  for (Eigen::Index a = 0; a < k; ++a) {
    const Eigen::Index i = table.Reduced(by.columns[static_cast<std::size_t>(a)]);
    for (Eigen::Index b = 0; b < k; ++b)
      square(a, b) = table.reduced(i, table.Reduced(by.columns[static_cast<std::size_t>(b)]));
    square(a, a) *= 1 + 1e-9;
    cross[a] = table.reduced(i, column);
  }
  return std::clamp(cross.dot(Ldlt(square).Solve(cross)) / own, 0.0, 1.0);
}

double Imitated(const ColumnTable& table, const EffectUse& use, const EffectUse& by) {
  double most = 0;
  for (const Trial& x : table.trials) {
    for (const Trial& y : table.trials) {
      if (x.use == use && y.use == by) most = std::max(most, Imitated(table, x, y));
    }
  }
  return most;
}

}  // namespace gapscope

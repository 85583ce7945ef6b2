// One blind-check case: a plant whose truth is known, the logs that it made, and the label that says what was done.
#ifndef GAPSCOPE_TESTS_TWIN_CASE_H_
#define GAPSCOPE_TESTS_TWIN_CASE_H_

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/twin/campaign.h"
#include "tests/twin/effects.h"
#include "tests/twin/gap.h"
#include "tests/twin/plant.h"
#include "tests/twin/recorder.h"
#include "tests/twin/rough.h"

namespace gapscope::twin {

inline constexpr int kTries = 12;  // of the size of an effect

enum class Kind { kAuto, kNone, kSingle, kPair, kTriple, kUnknown, kAmbiguous, kRough };
const char* KindName(Kind kind);
bool ParseKind(std::string_view name, Kind* kind);

struct CaseRequest {
  std::uint64_t seed = 1, index = 0;
  Kind kind = Kind::kAuto;
  std::string rig;      // empty: drawn
  std::string effect;   // empty: drawn; NAME or NAME@ON; for kUnknown the name of an outside effect
  double severity = 0;  // 0: searched, so that the effect-to-floor ratio is as drawn
};

struct EffectLabel {
  EffectChoice choice;
  Values parameters, extra;
  Gap gap;  // what the logs change when this effect alone is taken away
  // kRough: whether the effect stands clear of the roughness, and what random torques leave of gap.refit (JudgeClear).
  bool clear = true;
  double beside_torques = 0;
};

// kRough: what was put on one joint.
struct RoughLabel {
  Place place = Place::kFirst;
  double alone = 0, refit = 0;  // floors after refit: on the base model alone, as searched; and in the given logs
  double rms_n_m = 0;
  Hold held;  // by the one other law that holds most of it
};

struct Case {
  Rig rig = Rig::kJoint;
  Kind kind = Kind::kNone;
  std::uint64_t seed = 0, index = 0;
  bool nominal_base = false;
  Plant base, truth;  // without and with everything
  Sensors sensors;
  std::vector<LogSpec> logs;
  std::vector<EffectLabel> effects;
  std::string outside;  // name, for kUnknown
  Values outside_parameters;
  double outside_severity = 0;
  // kAmbiguous: names and places of the group, and how far each rival's best imitation stays from the logs, in floors.
  struct Member {
    std::string name, on;
    double distance_to_floor = 0;
  };
  std::vector<Member> group;
  std::vector<RoughLabel> roughness;  // kRough
  double rough_refit = 0;             // floors after refit, all of it, in the logs that a diagnosis is given
  Gap gap;                            // all effects together, roughness too
  std::array<double, 2> Floor() const { return {sensors.angle[0].Floor(), sensors.angle[1].Floor()}; }
};

// Errors (unknown rig, effect or place; an effect that cannot be made visible) come as text in `problem`.
bool MakeCase(const CaseRequest& request, Case* made, std::string* problem);

// The case's records for writing, at the fine step.
std::vector<Record> MakeRecords(const Case& c, bool noise, double step_s = 5e-5);

// For the builders of cases.
std::vector<Record> CoarseRecords(const Plant& plant, const std::vector<LogSpec>& logs, const Sensors& sensors,
                                  const GapOptions& options);
struct Search {
  double severity = 0;
  Gap gap;
  bool reached = false;  // the ratio is within a quarter of the target
};
// Severity between those whose gap is `target` floors after refit; no gap: what nobody would tolerate, so too severe.
Search SearchSeverity(const std::function<std::optional<Gap>(double)>& gap_at, double target, double lowest,
                      double highest);
// Severity at which plant_at(severity) differs from `reference` by `target` floors after refit; plants beyond what the
// rig tolerates count as too severe.
Search FindSeverity(const std::function<Plant(double)>& plant_at, const Plant& reference,
                    const std::vector<LogSpec>& logs, const Sensors& sensors, double target, double lowest,
                    double highest);

bool TameAll(const Plant& plant, std::vector<LogSpec>* logs, Random* random);
// With only the position logged a late sensor equals a late command: such a case would be ambiguous.
void RequireColumns(const std::vector<EffectChoice>& choices, std::vector<LogSpec>* logs);

// Effects drawn for a case's base, each with a severity at which it alone shows.
struct Listed {
  std::vector<EffectChoice> choices;
  Motion motion;
  bool visible = false;
  // The case's base with these effects, the one numbered `without` left out.
  Plant On(const Plant& base, std::size_t without = static_cast<std::size_t>(-1)) const;
};
// Draws `count` effects, logs for them and severities. False with a text in `problem` when there are none such.
bool DrawListed(const CaseRequest& request, int count, Random* random, Case* c, Listed* drawn, std::string* problem);
constexpr double kLowestRatio = 3, kHighestRatio = 100;  // floors after refit

// What a rough case of the mix holds: effects of the list, or a cause outside it.
struct Mix {
  int effects = 0;
  bool outside = false;
};
Mix DrawMix(const CaseRequest& request, Random* random);
constexpr double kLowestRough = 1.5, kHighestRough = 60;  // floors after refit, of each joint's roughness alone
constexpr double kUnitRough = 0.1;                        // of the joint's torque, root mean square: severity one
constexpr double kPause_s = 4;                            // between two logs
constexpr int kTorques = 12;                              // of the oracle, on every joint
// Of an effect that leaves `refit` floors: what is left beside random torques, and whether it stands clear of roughness
// that leaves `rough_refit`.
double BesideTorques(double refit, const Trace& trace);
bool StandsClear(double refit, double beside_torques, double rough_refit);

// case_outside.cc, case_ambiguous.cc, case_rough.cc.
std::vector<std::string> OutsideNames();
Values AddOutside(const std::string& name, double severity, std::uint64_t shape_seed, const Motion& motion,
                  Plant* plant);
// Draws a cause outside the list, logs for it and a severity, and sets `truth`. False when it does not show, with a
// text in `problem` when it never can.
bool DrawOutside(const CaseRequest& request, Random* random, Case* c, std::string* problem);
bool MakeAmbiguous(Random* random, Case* made, std::string* problem);
bool MakeRough(const CaseRequest& request, Random* random, Case* c, std::string* problem);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_CASE_H_

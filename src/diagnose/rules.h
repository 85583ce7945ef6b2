// What the search knows about effects beyond their equations: which are findings, which contain or resemble each other, thresholds, words.
#ifndef GAPSCOPE_DIAGNOSE_RULES_H_
#define GAPSCOPE_DIAGNOSE_RULES_H_

#include <string>

#include "src/diagnose/candidate.h"
#include "src/diagnose/diagnosis.h"

namespace gapscope {

// Thresholds: first guesses after diagnosis.md's prototype, not yet set on a bank of twin cases. `relative` gains are shares of the held-out cost.
inline constexpr double kFirstGain = 0.01, kFirstZ = 2.5;         // first effect over the refitted baseline
inline constexpr double kRemains = 1.05;                          // residual over noise below which nothing more is sought
inline constexpr double kSecondGain = 0.06, kSecondZ = 3.0;       // second effect over the first
inline constexpr double kSecondExcess = 0.25;                     // and of what the first left above the noise
inline constexpr double kNestedZ = 3.0, kNestedShare = 0.05;      // a richer effect over the simpler one that it contains
inline constexpr double kRivalShare = 0.06, kRivalZ = 2.0, kRivalEqual = 0.004;  // rivals: this close to the winner, in shares of the winner's gain
inline constexpr double kUnknownFloors = 1.8, kUnknownRemoved = 0.55;  // left above the noise, and share of the excess removed
inline constexpr double kRetuned = 0.05;                          // nominal against refit
inline constexpr double kProbabilityShare = 0.02;

// Whether the effect can be a finding here: a bias on a servo equals a zero offset, viscous friction is a parameter.
bool IsFinding(const EffectUse& use, const Model& model);
// Whether the effects are known to be confused with each other, at places that are one.
bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model);
// Whether `richer` can do all that `simpler` does (same other effects).
bool Contains(const Candidate& richer, const Candidate& simpler);

std::string Reason(const Candidate& candidate, const Candidate& base, const Candidate& chosen, const PairedGain& gain, const PairedGain& behind);
std::string Explain(const Diagnosis& diagnosis, double floors_before);
// A command for `gapscope design`, inside the rig's own limits.
std::string NextExperiment(const EffectUse& a, const EffectUse& b, const Model& model, const ScaleTable& scales);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_RULES_H_

// What the catalogue says of effects beside each other: which are findings, which contain or equal each other.
#ifndef GAPSCOPE_DIAGNOSE_RULES_H_
#define GAPSCOPE_DIAGNOSE_RULES_H_

#include <set>
#include <string>
#include <vector>

#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

// Whether the effect can be a finding on a base model (without effects, which may turn a plain motor into a plugin): a
// bias on a servo equals a zero offset.
bool IsFinding(const EffectUse& use, const Model& base);
// Whether `richer` can do all that `simpler` does, at the same place; `exactly`: not only nearly, as far as its bounds
// go. Nearly, too, one size for all places and the same effect on one of them: they are rivals.
bool Contains(const EffectUse& richer, const EffectUse& simpler, const Rig& rig, bool exactly = false);
// Whether, where `simpler` is, `richer` mostly is too, which holds it.
bool IsUsual(const EffectUse& richer, const EffectUse& simpler, const Rig& rig);

// What the stamps of a log's columns are: one clock, or they say less of delays.
enum class Clocks {
  kOne,
  kMixed,   // commands by another clock than measurements: what a message takes on its way is in between
  kMadeUp,  // a frame's number over the frame rate
};
// What an effect of time must be told with; empty: nothing.
std::string CaveatOf(Clocks clocks);

// What the logs hold, as far as it bears on what can be said.
struct LoggedSignals {
  bool one = false;                    // one command that changes (a constant supply does not) and one signal are all
  bool torque = false;                 // a drive's torque is measured: a constant load on a servo shows
  std::set<std::string> signals = {};  // that are scored in any log
  Clocks clocks = Clocks::kOne;        // the worst of any log
};
LoggedSignals WhatIsLogged(const std::vector<Recording>& recordings);
// Whether the effect is a sensor's whose signal no log has, or none that is scored.
bool IsOfMissingSensor(const EffectUse& use, const Rig& rig, const LoggedSignals& logged);
// Joints that nothing drives or ties to one that is known, where neither their own motion nor that of anything they
// carry is measured in any log. Where such a joint is when a window begins is a guess, which an effect on it would only
// mend.
std::set<std::string> JointsOutOfSight(const Model& base, const std::vector<Recording>& recordings);
// Whether the two are the same motion on such logs, whatever their fits cost: a late command and a late sensor where
// that sensor is all that is measured, or where all commands, and all sensors, are late alike; Coulomb friction and
// friction by direction on a joint that a servo or a spring holds, apart by a zero offset.
bool AreOneMotion(const EffectUse& a, const EffectUse& b, const Model& model, const LoggedSignals& logged);
// Whether the catalogue has each of them down for what is mistaken for the other one (Effect::partners), at one joint.
bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model);
// Whether `a` is the less likely of two that explain the logs equally well: gravity on a joint whose axis stands
// upright, where only a tilted rig would feel it, beside a cable.
bool IsLessLikely(const EffectUse& a, const EffectUse& b, const Model& model);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_RULES_H_

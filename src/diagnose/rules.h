// What the search knows about effects beyond their equations: which are findings, which contain or resemble each other;
// and its thresholds.
#ifndef GAPSCOPE_DIAGNOSE_RULES_H_
#define GAPSCOPE_DIAGNOSE_RULES_H_

#include "src/diagnose/evidence.h"

namespace gapscope {

// Thresholds, set on banks of twin cases (scripts/blind_check) and judged on others: docs/diagnosis.md,
// docs/results_diagnose.md.
inline constexpr Limits kFirst{.share = 0.01, .z = 2.5};  // the first effect over the refitted base model
inline constexpr Limits kFirstNearFloor{.share = 0.06,
                                        .z = 3.0};  // the same where the base model is near the noise (kUnknownFloors),
inline constexpr Limits kFirstAtFloor{
    .share = 0.25, .z = 3.0};  // and where it is at the noise (kAtNoise): what is left there is the noise's own colour
inline constexpr double kRemains = 1.25;                   // residual over noise below which nothing more is sought
inline constexpr Limits kSecond{.share = 0.06, .z = 3.0};  // a second effect over the first
inline constexpr double kSecondTrain =
    0.1;  // that much of the training cost too: a speck of an effect can move what the training logs leave open,
inline constexpr double kSecondExcess = 0.5;  // and of what the first left above the noise,
inline constexpr Limits kSureSecond{.share = 0.3,
                                    .z = 8.5};  // or beyond doubt: what else is missing need not be small;
inline constexpr double kSecondOfGap =
    0.025;  // and of the base model's residual: the first effect's shape is never quite the real one;
inline constexpr double kUntoldOfGap = 0.15;  // this much where unlike effects would do as well,
inline constexpr double kShapeOfGap = 0.25;   // and this much where it may be the first one's shape
inline constexpr double kAtNoise =
    1.0;  // residual over noise at which a model explains everything: of two such models neither is the better one
inline constexpr Limits kNested{.share = 0.03, .z = 3.0};  // a richer effect over a simpler one that it contains
inline constexpr Limits kSureNested{
    .share = 0.01,
    .z =
        6.0};  // or this, beyond doubt: of 199 single findings no simpler one that was true stood further back than 3.4
inline constexpr double kNestedShare = 0.03;   // and of what the richer one gains,
inline constexpr double kNestedExcess = 0.25;  // or of what the simpler one leaves above the noise
inline constexpr Limits kTold{
    .share = 0.06, .z = 2.5};  // the winner over a rival; below (a quarter of the noise apart), the two are ambiguous
inline constexpr double
    kUnknownFloors = 2.5,
    kUnknownRemoved = 0.55;  // left above the noise, and share of the excess removed (in windows, or of a free run),
inline constexpr double kUnknownRemovedInBoth =
    0.35;  // or in both: what stands for another cause helps one of the two only
inline constexpr double kTwoAtOnce =
    0.8;  // share of the excess that two effects must remove where neither was accepted alone
inline constexpr Limits kRetuned{.share = 0.05, .z = 2.5};  // the refitted base model over the nominal one

// What a first effect must gain over this base model.
inline const Limits& FirstLimits(const Candidate& base) {
  return base.held_out_floors > kUnknownFloors ? kFirst
         : base.held_out_floors > kAtNoise     ? kFirstNearFloor
                                               : kFirstAtFloor;
}
// Whether the effect can be a finding on a base model (without effects, which may turn a plain motor into a plugin): a
// bias on a servo equals a zero offset, viscous friction is a parameter.
bool IsFinding(const EffectUse& use, const Model& base);
// Whether the effects are known to be confused with each other, at places that are one.
bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model);
// Whether `second` may stand for what the model of `first` leaves out of the real effect: dry friction gives way
// elastically before it slides.
bool IsShape(const EffectUse& second, const EffectUse& first, const Model& model);
// Whether `richer` can do all that `simpler` does (same other effects, in any order); `exactly`: not only nearly, as
// far as its bounds go.
bool Contains(const Candidate& richer, const Candidate& simpler, bool exactly = false);
// Whether a parameter ended on a bound that does not mean "no effect": on a positive range of decades, in its
// logarithm, as it is searched.
bool IsStretched(const PlacedParameter& parameter, double value);
// Whether the two can be taken for each other: neither contains the other exactly, and neither is stretched to a bound.
bool MayBeRivals(const Candidate& a, const Candidate& b);

// Whether one command that changes (a constant supply does not) and one signal are all that the logs hold.
bool IsOneSignal(const std::vector<Recording>& recordings);
// Whether the two are a late command and a late sensor: the same motion where that sensor is all that is measured,
// whatever their fits cost.
bool IsSameDelay(const EffectUse& a, const EffectUse& b, const Model& model);
// Whether the two are Coulomb friction and friction that differs by direction on one joint: apart by a constant torque,
// which moves the rest of a spring-held joint and nothing else. Where that is a zero offset to the sensor, they are the
// same motion.
bool IsSameFriction(const EffectUse& a, const EffectUse& b, const Model& model);

// Whether `a` is the less likely of two that explain the logs equally well: gravity on a joint whose axis stands
// upright, where only a tilted rig would feel it, beside a cable; two late sensors beside a late command and one.
bool IsLessLikely(const Candidate& a, const Candidate& b);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_RULES_H_

// Which joints of a rig touch: whose signals move when a joint is pushed, or a parameter changes. What moves no signal
// in common is looked at in one replay, each in its own signals (columns of a sparse Jacobian that share no row:
// Curtis, Powell and Reid, "On the estimation of sparse Jacobian matrices", J. Inst. Maths Applics 13, 1974).
#ifndef GAPSCOPE_FIT_COUPLING_H_
#define GAPSCOPE_FIT_COUPLING_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "src/fit/fit_problem.h"

namespace gapscope {

// Numbers of `moved` in groups whose members move no signal in common; each group in the order of the list. A member
// that moves all signals is alone.
std::vector<std::vector<std::size_t>> ApartGroups(const std::vector<MovedSignals>& moved);

// For each of `count` things the number of its part, where the things of a group belong together. Parts are numbered in
// the order of their first things.
std::vector<std::size_t> NumberParts(std::size_t count, const std::vector<std::vector<std::size_t>>& groups);

// Leaves of one window's column what lies in the signals that it moves.
void KeepMoved(const Recording& recording, const FitWindow& window, const MovedSignals& moved,
               Eigen::Ref<Eigen::VectorXd> column);

class Coupling {
 public:
  // Nothing is known of it: everything touches.
  Coupling() = default;
  // Measured at a point, by quick steps: one Jacobian, and one replay for the first torque of each joint.
  static Coupling Measure(FitProblem& problem, const FitPoint& point, std::span<const ProbeTorque> torques, Work* work);

  // By the experiment's signals; empty: all, or nothing is known.
  // Of a joint, an actuator on one, or a signal; of anything else, all.
  MovedSignals OfPlace(const std::string& place, const Rig& rig) const;
  // Of a parameter of the base model, or of an effect on a place.
  MovedSignals OfParameter(const std::string& name, const Rig& rig) const;
  // Of the initial angle and speed of the joint that a signal measures.
  MovedSignals OfState(std::size_t signal) const;
  // Limbs, numbered from 0: no joint moves signals of two of them. Where nothing is known there is one.
  std::size_t limb_count() const;
  std::size_t LimbOf(std::size_t signal) const { return limbs_.empty() ? 0 : limbs_[signal]; }
  // By limb, whether any of these signals is of it.
  std::vector<char> LimbsOf(const MovedSignals& moved) const;

 private:
  void FindLimbs(std::size_t signals);

  std::map<std::string, MovedSignals> of_joint_, of_parameter_;
  std::map<std::size_t, MovedSignals> of_state_;
  std::vector<std::size_t> limbs_;  // by signal; empty: one
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_COUPLING_H_

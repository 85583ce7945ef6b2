// What a body weighs, where and about which axes, and ten numbers that change it without leaving what mass can be:
// Rucker and Wensing, Smooth Parameterization of Rigid-Body Inertia, IEEE RA-L 7 (2022). About the body's origin, with
// mass m, centre c and second moments S = sum of m_i x_i x_i',
//
//   J = [ S   m c ]      J' = U J U'      U = e^alpha [ A  t ]      A = [ e^d1  s12   s13  ]
//       [ m c'  m ]                                   [ 0  1 ]          [ 0     e^d2  s23  ]
//                                                                       [ 0     0     e^d3 ]
//
// The body's mass is stretched by x -> A x + t and weighs e^(2 alpha) times as much: m' = e^(2 alpha) m, c' = A c + t.
// All zero is the body as it was. Any ten numbers give a body that mass can be made into.
#ifndef GAPSCOPE_MODEL_PSEUDO_INERTIA_H_
#define GAPSCOPE_MODEL_PSEUDO_INERTIA_H_

#include <mujoco/mujoco.h>

#include <array>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/core/rotation.h"
#include "src/experiment/experiment.h"

namespace gapscope {

struct BodyInertia {
  double mass_kg = 0;
  Vector3 centre_m = {};          // in the body's frame
  Vector3 moments_kg_m2 = {};     // about the centre, along `axes`
  Quaternion axes = kNoRotation;  // from the principal axes to the body's
};
BodyInertia InertiaOf(const mjModel& model, int body);
// How far a body reaches from its frame: its centre and its radius of gyration, m. 0: it has no mass.
double LengthOf(const BodyInertia& inertia);
// Whether mass can have these three moments, to rounding: none is negative, none larger than the other two together.
bool IsInertia(const double* moments);
void WriteInertia(const BodyInertia& inertia, int body, mjModel* model);

inline constexpr std::array kPseudoInertia = {"alpha", "d1", "d2", "d3", "s12", "s23", "s13", "t1", "t2", "t3"};
using PseudoInertia = std::array<double, kPseudoInertia.size()>;  // in that order; t in m

// The principal axes are those nearest to the ones before: small numbers turn them little.
BodyInertia Changed(const BodyInertia& inertia, const PseudoInertia& by);

// Parameters BODY.alpha ... for each body of `inertia:`, and the setting that they make; an experiment's own of that
// name holds. `model`: the rig as its MJCF has it. Errors: no such body, or one without mass.
Status AddInertiaParameters(const mjModel& model, Experiment* experiment);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_PSEUDO_INERTIA_H_

// A bristle that bends with a displacement and slides at its limit: the rate-independent core of the Dahl and LuGre
// models. With x the bend divided by its limit, dx = (1 - x sgn(dq)) dq / reach, whose solution over a displacement of
// one sign is exact and needs no small step:
//   x' = s + (x - s) exp(-|dq| / reach),  s = sgn(dq)
// P. R. Dahl, "A solid friction model", Aerospace Corp. TOR-0158, 1968; C. Canudas de Wit et al., "A new model for
// control of systems with friction", IEEE TAC 40(3), 1995.
#ifndef GAPSCOPE_PLUGINS_COMMON_BRISTLE_H_
#define GAPSCOPE_PLUGINS_COMMON_BRISTLE_H_

#include <cmath>

namespace gapscope::plugins {

// The bend, as a part of its limit in -1 .. 1, after `displacement`. A reach of 0 is a bristle that slides at once.
inline double BendBristle(double bend, double displacement, double reach) {
  if (displacement == 0) return bend;
  const double sign = displacement > 0 ? 1 : -1;
  if (!(reach > 0)) return sign;
  return sign + (bend - sign) * std::exp(-std::abs(displacement) / reach);
}

// Where and when the bend was last settled: three numbers of an instance's `plugin_state`, and so part of every saved
// state. RK4 calls `compute` at four times of one step; a call at the step's own time sets the anchor, later ones bend
// the bristle from the anchor without settling it, and `advance` settles it once. A host that moves the joint or the
// clock between steps does not bend the bristle.
struct BristleState {
  double bend, angle_rad, time_s;

  // The displacement since the anchor, which is set anew when this is the step's first compute.
  double Displacement(double q, double now_s, double step_s) {
    const double elapsed = now_s - time_s;
    if (!(elapsed > 0 && elapsed <= step_s * (1 + 1e-9))) {
      angle_rad = q;
      time_s = now_s;
    }
    return q - angle_rad;
  }

  // Ends the step.
  void Settle(double new_bend, double q, double now_s) {
    bend = new_bend;
    angle_rad = q;
    time_s = now_s;
  }
};
static_assert(sizeof(BristleState) == 3 * sizeof(double));

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_BRISTLE_H_

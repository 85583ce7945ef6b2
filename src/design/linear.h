// State feedback and observers for a linearised rig: Riccati, pole placement, and their duals.
#ifndef GAPSCOPE_DESIGN_LINEAR_H_
#define GAPSCOPE_DESIGN_LINEAR_H_

#include <Eigen/Core>
#include <complex>
#include <map>
#include <string>
#include <vector>

#include "src/model/model.h"

namespace gapscope {

// x' = A x + B u about an equilibrium; x: positions of all joints in the order of the model, then their speeds.
struct LinearSystem {
  Eigen::MatrixXd a, b;
  std::vector<std::string> states;  // "arm", "pendulum", "arm speed", ...
};

// `at`: joint -> position, others at the model's initial pose; speeds and commands zero. Central differences of
// MuJoCo's accelerations. `command`: index in the experiment's commands. Errors: no such joint; not an equilibrium (an
// acceleration above 1e-3 of what a unit of position or command does); dry friction, which has no linearisation;
// parameters that make no model.
Result<LinearSystem> Linearize(const Model& model, const std::vector<double>& values,
                               const std::map<std::string, double>& log_values, const std::map<std::string, double>& at,
                               std::size_t command);

// u = -K x that minimises the integral of x'Q x + u'R u: K = R^-1 B'P with P the stabilising solution of A'P + P A - P
// B R^-1 B'P + Q = 0, from the stable eigenvectors of the Hamiltonian (Potter 1966; Laub, "A Schur method for solving
// algebraic Riccati equations", IEEE Trans. Autom. Control 24, 1979, on when that is sound), polished by Newton and
// Kleinman. Errors: no stabilising solution (not stabilisable, or an unstable mode that Q does not see).
struct Feedback {
  Eigen::MatrixXd gain;                     // inputs x states
  Eigen::MatrixXd cost;                     // P; empty for pole placement
  std::vector<std::complex<double>> poles;  // of A - B K, sorted by real part
};
Result<Feedback> Lqr(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& q,
                     const Eigen::MatrixXd& r);

// One input: the K that gives A - B K these poles (complex ones in pairs), by Ackermann's formula on a balanced system.
// Errors: not controllable; number or pairing of poles.
Result<Feedback> PlacePoles(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                            const std::vector<std::complex<double>>& poles);

// Observers x^' = A x^ + B u + L (y - C x^). Kalman-Bucy: the dual of Lqr with noise densities W of the states and V of
// the readings. Luenberger for one output: the dual of PlacePoles. gain: states x outputs.
Result<Feedback> KalmanGain(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c, const Eigen::MatrixXd& w,
                            const Eigen::MatrixXd& v);
Result<Feedback> ObserverGain(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c,
                              const std::vector<std::complex<double>>& poles);

std::vector<std::complex<double>> SortedPoles(const Eigen::MatrixXd& a);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_LINEAR_H_

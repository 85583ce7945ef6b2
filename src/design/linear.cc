#include "src/design/linear.h"

#include <algorithm>
#include <cmath>

#include "src/core/dense.h"
#include "src/core/names.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

// A'X + X A + Q = 0 as one linear system; the matrices here have a handful of rows.
Eigen::MatrixXd SolveLyapunov(const Eigen::MatrixXd& a, const Eigen::MatrixXd& q) {
  const Eigen::Index n = a.rows();
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n * n, n * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index k = 0; k < n; ++k) {
        system(i + n * j, k + n * j) += a(k, i);
        system(i + n * j, i + n * k) += a(k, j);
      }
    }
  }
  const Eigen::MatrixXd x = SolveLu(system, -q.reshaped()).reshaped(n, n);
  return 0.5 * (x + x.transpose());
}

std::string PoleText(const std::vector<std::complex<double>>& poles) {
  std::string text;
  for (const auto& p : poles)
    text += (text.empty() ? "" : ", ") + std::to_string(p.real()) +
            (p.imag() != 0 ? (p.imag() > 0 ? "+" : "") + std::to_string(p.imag()) + "i" : "");
  return text;
}

}  // namespace

std::vector<std::complex<double>> SortedPoles(const Eigen::MatrixXd& a) {
  const Eigen::VectorXcd values = Eigenvalues(a);
  std::vector<std::complex<double>> poles(values.data(), values.data() + values.size());
  std::sort(poles.begin(), poles.end(), [](const auto& x, const auto& y) {
    return std::pair(-x.real(), x.imag()) < std::pair(-y.real(), y.imag());
  });
  return poles;
}

Result<LinearSystem> Linearize(const Model& model, const std::vector<double>& values,
                               const std::map<std::string, double>& log_values, const std::map<std::string, double>& at,
                               std::size_t command) {
  const mjModel& compiled = model.compiled();
  const ModelPtr m(mj_copyModel(nullptr, &compiled));
  const DataPtr d(mj_makeData(m.get()));
  ParameterWriter writer(model, m.get(), d.get());
  if (!writer.Write(values, log_values))
    return Error{.what = "the parameters make no model", .where = model.experiment().path};
  GS_CHECK(command < model.command_actuators().size());
  if (m->nq != m->nv || m->na > 0)
    return Error{.what = "only rigs of hinges and slides without actuator states are linearised",
                 .where = model.experiment().model_path};
  for (int dof = 0; dof < m->nv; ++dof) {
    if (m->dof_frictionloss[dof] > 1e-5)
      return Error{.what = "dry friction has no linearisation",
                   .where = model.experiment().model_path,
                   .cure = "set it to zero by --set"};
  }
  LinearSystem system;
  std::vector<mjtNum> pose(m->qpos0, m->qpos0 + m->nq);
  std::vector<std::string> names;
  for (int j = 0; j < m->njnt; ++j) {
    const char* name = mj_id2name(m.get(), mjOBJ_JOINT, j);
    names.push_back(name ? name : "joint " + std::to_string(j));
  }
  for (const auto& [name, value] : at) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) return NoSuch("no such joint", name, names, "--at");
    pose[static_cast<std::size_t>(m->jnt_qposadr[found - names.begin()])] = value;
  }
  const Eigen::Index n = m->nv;
  const auto acceleration = [&](Eigen::Index state, double step, double u) {
    mj_resetData(m.get(), d.get());
    std::copy(pose.begin(), pose.end(), d->qpos);
    if (state >= 0) (state < n ? d->qpos[state] : d->qvel[state - n]) += step;
    d->ctrl[model.command_actuators()[command]] = u;
    mj_forward(m.get(), d.get());
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(d->qacc, n));
  };
  constexpr double kStep = 1e-5;
  system.a = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  system.b = Eigen::MatrixXd::Zero(2 * n, 1);
  system.a.topRightCorner(n, n).setIdentity();
  for (Eigen::Index i = 0; i < 2 * n; ++i)
    system.a.block(n, i, n, 1) = (acceleration(i, kStep, 0) - acceleration(i, -kStep, 0)) / (2 * kStep);
  system.b.bottomRows(n) = (acceleration(-1, 0, kStep) - acceleration(-1, 0, -kStep)) / (2 * kStep);
  const double scale = std::max(system.a.bottomRows(n).cwiseAbs().maxCoeff(), system.b.cwiseAbs().maxCoeff()),
               left = acceleration(-1, 0, 0).cwiseAbs().maxCoeff();
  if (left > 1e-3 * scale)
    return Error{.what = "the pose is not an equilibrium",
                 .where = "--at",
                 .actual = "accelerations up to " + std::to_string(left) + " rad/s^2"};
  for (const auto& name : names) system.states.push_back(name);
  for (const auto& name : names) system.states.push_back(name + " speed");
  return system;
}

Result<Feedback> Lqr(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, const Eigen::MatrixXd& q,
                     const Eigen::MatrixXd& r) {
  const Eigen::Index n = a.rows();
  GS_CHECK(a.cols() == n && b.rows() == n && q.rows() == n && q.cols() == n && r.rows() == b.cols() &&
           r.cols() == b.cols());
  if (!(SymmetricEigen(r).values.minCoeff() > 0) || !(SymmetricEigen(q).values.minCoeff() >= -1e-12 * q.norm())) {
    return Error{.what = "the weights are not positive", .where = "--q, --r", .allowed = "r above zero, q not below"};
  }
  const Ldlt weight(r);
  const Eigen::MatrixXd g = b * weight.Solve(b.transpose());
  Eigen::MatrixXd hamiltonian(2 * n, 2 * n);
  hamiltonian << a, -g, -q, -a.transpose();
  const GeneralEigen eigen(hamiltonian);
  // Real and imaginary part of a pair's vectors span what the pair does.
  Eigen::MatrixXd stable(2 * n, n);
  Eigen::Index found = 0;
  const double size = eigen.values.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    if (!(eigen.values[i].real() < -1e-10 * size) || found == n) continue;
    if (eigen.values[i].imag() < 0) {
      stable.col(found++) = eigen.vectors.col(i).imag();
    } else {
      stable.col(found++) = eigen.vectors.col(i).real();
    }
  }
  const auto no_solution = [] {
    return Error{.what = "no stabilising feedback exists",
                 .where = "--q",
                 .cure = "weigh every position that does not come back by itself"};
  };
  if (found < n) return no_solution();
  Eigen::MatrixXd p = SolveLu(stable.topRows(n).transpose(), stable.bottomRows(n).transpose());
  p = 0.5 * (p + p.transpose()).eval();
  // Newton's iteration on the Riccati equation takes what rounding left.
  for (int i = 0; i < 3; ++i) {
    const Eigen::MatrixXd k = weight.Solve(b.transpose() * p), closed = a - b * k;
    if (!(Eigenvalues(closed).real().maxCoeff() < 0)) return no_solution();
    p = SolveLyapunov(closed, q + k.transpose() * r * k);
  }
  Feedback feedback{.gain = weight.Solve(b.transpose() * p), .cost = p, .poles = {}};
  if (!feedback.gain.allFinite()) return no_solution();
  feedback.poles = SortedPoles(a - b * feedback.gain);
  if (!(feedback.poles.front().real() < 0)) return no_solution();
  return feedback;
}

Result<Feedback> PlacePoles(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                            const std::vector<std::complex<double>>& poles) {
  const Eigen::Index n = a.rows();
  if (b.cols() != 1) return Error{.what = "pole placement is for one input"};
  if (static_cast<Eigen::Index>(poles.size()) != n)
    return Error{.what = "as many poles as states are needed",
                 .where = "--poles",
                 .actual = std::to_string(poles.size()),
                 .allowed = std::to_string(n)};
  // Coefficients of the product of (s - p), from the highest power down.
  std::vector<std::complex<double>> polynomial = {1};
  for (const auto& p : poles) {
    polynomial.push_back(0);
    for (std::size_t i = polynomial.size() - 1; i > 0; --i) polynomial[i] -= p * polynomial[i - 1];
  }
  double size = 0, imaginary = 0;
  for (const auto& c : polynomial)
    size = std::max(size, std::abs(c)), imaginary = std::max(imaginary, std::abs(c.imag()));
  if (imaginary > 1e-9 * size)
    return Error{.what = "complex poles come in pairs", .where = "--poles", .actual = PoleText(poles)};
  // Time in units of the system's own speed keeps the powers of A of one size.
  const double fastest = Eigenvalues(a).cwiseAbs().maxCoeff(), rate = fastest > 0 ? fastest : 1;
  const Eigen::MatrixXd slow = a / rate;
  Eigen::MatrixXd controllability(n, n);
  Eigen::VectorXd column = b;
  for (Eigen::Index i = 0; i < n; ++i) controllability.col(i) = column, column = slow * column;
  const Eigen::VectorXd lengths = controllability.colwise().norm();
  const Eigen::VectorXd sizes = SingularValues(controllability * lengths.cwiseInverse().asDiagonal());
  if (!(lengths.minCoeff() > 0) || sizes[n - 1] < 1e-10 * sizes[0])
    return Error{.what = "the system is not controllable from this input", .where = "--poles"};
  Eigen::MatrixXd value = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t i = 0; i < polynomial.size(); ++i)
    value = value * slow +
            Eigen::MatrixXd::Identity(n, n) * (polynomial[i].real() / std::pow(rate, static_cast<double>(i)));
  const Eigen::VectorXd last = Eigen::VectorXd::Unit(n, n - 1);
  Feedback feedback;
  feedback.gain = rate * SolveLu(controllability.transpose(), last).transpose() * value;
  feedback.poles = SortedPoles(a - b * feedback.gain);
  return feedback;
}

Result<Feedback> KalmanGain(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c, const Eigen::MatrixXd& w,
                            const Eigen::MatrixXd& v) {
  GS_ASSIGN(Feedback dual, Lqr(a.transpose(), c.transpose(), w, v));
  dual.gain.transposeInPlace();
  return dual;
}

Result<Feedback> ObserverGain(const Eigen::MatrixXd& a, const Eigen::MatrixXd& c,
                              const std::vector<std::complex<double>>& poles) {
  GS_ASSIGN(Feedback dual, PlacePoles(a.transpose(), c.transpose(), poles));
  dual.gain.transposeInPlace();
  return dual;
}

}  // namespace gapscope

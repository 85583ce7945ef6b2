#include "src/model/pseudo_inertia.h"

#include <Eigen/Core>
#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>

#include "src/experiment/added_actuators.h"
#include "src/model/fields.h"

namespace gapscope {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d MatrixOf(const Quaternion& q) {
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> matrix;
  mju_quat2Mat(matrix.data(), q.data());
  return matrix;
}

Quaternion QuaternionOf(const Matrix3d& turn) {
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> matrix = turn;
  Quaternion q;
  mju_mat2Quat(q.data(), matrix.data());
  return q;
}

// Turns a symmetric matrix diagonal, by Jacobi's rotations of at most an eighth of a turn; what turned it. Library
// solvers sort what they find, so that axes change places where two moments are alike.
Matrix3d TurnDiagonal(Matrix3d* m) {
  constexpr int kMostSweeps = 30;
  const double nothing = std::numeric_limits<double>::epsilon() * m->trace();
  Matrix3d turn = Matrix3d::Identity();
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool done = true;
    for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
      if (!(std::abs((*m)(p, q)) > nothing)) continue;
      Eigen::JacobiRotation<double> rotation;
      rotation.makeJacobi(*m, p, q);
      m->applyOnTheLeft(p, q, rotation.adjoint());
      m->applyOnTheRight(p, q, rotation);
      turn.applyOnTheRight(p, q, rotation);
      done = false;
    }
    if (done) break;
  }
  return turn;
}

}  // namespace

BodyInertia InertiaOf(const mjModel& m, int body) {
  BodyInertia inertia{.mass_kg = m.body_mass[body]};
  std::copy_n(m.body_ipos + 3 * body, 3, inertia.centre_m.begin());
  std::copy_n(m.body_inertia + 3 * body, 3, inertia.moments_kg_m2.begin());
  std::copy_n(m.body_iquat + 4 * body, 4, inertia.axes.begin());
  return inertia;
}

double LengthOf(const BodyInertia& inertia) {
  if (!(inertia.mass_kg > 0)) return 0;
  return std::hypot(mju_norm3(inertia.centre_m.data()),
                    std::sqrt(std::ranges::max(inertia.moments_kg_m2) / inertia.mass_kg));
}

bool IsInertia(const double* moments) {
  constexpr double kRounding = 1e-9;
  const auto [least, most] = std::minmax({moments[0], moments[1], moments[2]});
  return least >= 0 && 2 * most <= (1 + kRounding) * (moments[0] + moments[1] + moments[2]);
}

void WriteInertia(const BodyInertia& inertia, int body, mjModel* m) {
  m->body_mass[body] = inertia.mass_kg;
  std::ranges::copy(inertia.centre_m, m->body_ipos + 3 * body);
  std::ranges::copy(inertia.moments_kg_m2, m->body_inertia + 3 * body);
  std::ranges::copy(inertia.axes, m->body_iquat + 4 * body);
}

BodyInertia Changed(const BodyInertia& inertia, const PseudoInertia& by) {
  const auto& [alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3] = by;
  const double scale = std::exp(2 * alpha);
  Matrix3d stretch;
  stretch << std::exp(d1), s12, s13, 0, std::exp(d2), s23, 0, 0, std::exp(d3);
  BodyInertia changed{.mass_kg = scale * inertia.mass_kg};
  const Vector3d centre = stretch * Vector3d(inertia.centre_m.data()) + Vector3d(t1, t2, t3);
  std::copy_n(centre.data(), 3, changed.centre_m.begin());
  // Second moments about the centre, along the principal axes, where they are diagonal before. What rounding leaves
  // below zero of a rod or a plate is zero.
  const Vector3d moments(inertia.moments_kg_m2.data());
  const Vector3d second = (Vector3d::Constant(0.5 * moments.sum()) - moments).cwiseMax(0);
  const Matrix3d axes = MatrixOf(inertia.axes), along = axes.transpose() * stretch * axes;
  Matrix3d stretched = along * second.asDiagonal() * along.transpose();
  const Matrix3d turn = TurnDiagonal(&stretched);
  const Vector3d left = scale * stretched.diagonal().cwiseMax(0);
  for (Eigen::Index i = 0; i < 3; ++i)
    changed.moments_kg_m2[static_cast<std::size_t>(i)] = left[(i + 1) % 3] + left[(i + 2) % 3];
  changed.axes = turn.isIdentity(0) ? inertia.axes : Normalised(inertia.axes * QuaternionOf(turn));
  return changed;
}

Status AddInertiaParameters(const mjModel& m, Experiment* experiment) {
  for (const NamedBody& body : experiment->inertia) {
    FieldSetting setting{.field = "body/" + body.name + "/pseudo_inertia", .expressions = {}, .where = body.where};
    GS_RETURN_IF_ERROR(ResolveField(m, setting.field, body.where));
    // Mass from a third to three times, lengths from two thirds to one and a half: what a drawing may be wrong by.
    constexpr double kRoom = 0.5;
    const double length = LengthOf(InertiaOf(m, mj_name2id(&m, mjOBJ_BODY, body.name.c_str())));
    for (const std::string key : kPseudoInertia) {
      const bool moves = key[0] == 't';
      const double room = moves ? kRoom * length : kRoom;
      Parameter parameter{.name = NameForExpressions(body.name + "." + key),
                          .unit = moves ? "m" : "1",
                          .doc = "inertia of " + body.name + " beside the MJCF's",
                          .low = -room,
                          .high = room,
                          .frozen = true,
                          .if_known = true};
      setting.expressions.push_back(parameter.name);
      const bool listed =
          std::ranges::any_of(experiment->parameters, [&](const Parameter& p) { return p.name == parameter.name; });
      if (!listed) experiment->parameters.push_back(std::move(parameter));
    }
    experiment->settings.push_back(std::move(setting));
  }
  return Ok();
}

}  // namespace gapscope
